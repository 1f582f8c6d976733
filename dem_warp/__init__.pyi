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
from .scenes.compression import Compression
from .scenes.draw_down import DrawDown
from .scenes.drop import Drop
from .scenes.drum import Drum
from .scenes.hopper import Hopper
from .scenes.incline import Incline
from .scenes.ledge import Ledge
from .scenes.library import SCENES
from .scenes.lifted_cylinder import LiftedCylinder
from .scenes.penetration import Penetration
from .scenes.placed_scene import PlacedController, PlacedScene
from .scenes.poured_controller import PouredController
from .scenes.poured_heap import PouredHeap
from .scenes.poured_scene import PouredScene
from .scenes.roll import Roll
from .scenes.shear import Shear
from .scenes.tilting_box import TiltingBox
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
    "Compression",
    "ContactLaws",
    "DrawDown",
    "Drop",
    "Drum",
    "Film",
    "Frame",
    "GrainPopulation",
    "Hopper",
    "Incline",
    "Interaction",
    "Ledge",
    "LiftedCylinder",
    "Material",
    "Mechanism",
    "Numerics",
    "Parameter",
    "Penetration",
    "PlacedController",
    "PlacedScene",
    "PouredController",
    "PouredHeap",
    "PouredScene",
    "Processes",
    "Progress",
    "Roll",
    "ShapeMixture",
    "Shear",
    "SizeClasses",
    "TiltingBox",
    "WallPart",
    "__version__",
    "effective_moduli",
    "laws_named",
    "rayleigh_time",
    "simulate",
    "simulate_frames",
]
