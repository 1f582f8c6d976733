"""Public names; a module is imported when its name is first used."""

from .case import Case, Numerics
from .clumps import ClumpShape
from .frames import Film, Frame, simulate_frames
from .laws.conventions import EDEM, PRESETS, RELATIVE, ContactLaws, laws_named
from .laws.library import MECHANISMS
from .laws.mechanism import Mechanism
from .materials import Interaction, Material, WallPart, effective_moduli, rayleigh_time
from .parameters import Parameter
from .population import GrainPopulation, ShapeMixture, SizeClasses
from .processes import Processes
from .result import CaseResult, Progress
from .scenes.draw_down import DrawDown
from .scenes.drum import Drum
from .scenes.hopper import Hopper
from .scenes.library import SCENES
from .scenes.lifted_cylinder import LiftedCylinder
from .scenes.poured_controller import PouredController
from .scenes.poured_scene import PouredScene
from .simulation import simulate
from .version import __version__

__all__ = [
    "EDEM",
    "MECHANISMS",
    "PRESETS",
    "RELATIVE",
    "SCENES",
    "Case",
    "CaseResult",
    "ClumpShape",
    "ContactLaws",
    "DrawDown",
    "Drum",
    "Film",
    "Frame",
    "GrainPopulation",
    "Hopper",
    "Interaction",
    "LiftedCylinder",
    "Material",
    "Mechanism",
    "Numerics",
    "Parameter",
    "PouredController",
    "PouredScene",
    "Processes",
    "Progress",
    "ShapeMixture",
    "SizeClasses",
    "WallPart",
    "__version__",
    "effective_moduli",
    "laws_named",
    "rayleigh_time",
    "simulate",
    "simulate_frames",
]
