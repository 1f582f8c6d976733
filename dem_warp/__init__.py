"""Discrete element simulation of clumped grains on NVIDIA Warp: many worlds at once, on a GPU or a CPU."""

from dem_warp.case import Case, Numerics
from dem_warp.clumps import ClumpShape
from dem_warp.laws.conventions import EDEM, PRESETS, RELATIVE, ContactLaws, laws_named
from dem_warp.laws.library import MECHANISMS
from dem_warp.laws.mechanism import Mechanism
from dem_warp.materials import Interaction, Material, WallPart, effective_moduli, rayleigh_time
from dem_warp.parameters import Parameter
from dem_warp.population import GrainPopulation, ShapeMixture, SizeClasses
from dem_warp.result import CaseResult, Progress
from dem_warp.scenes.draw_down import DrawDown
from dem_warp.scenes.drum import Drum
from dem_warp.scenes.hopper import Hopper
from dem_warp.scenes.library import SCENES
from dem_warp.scenes.lifted_cylinder import LiftedCylinder
from dem_warp.simulation import simulate
from dem_warp.version import __version__

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
    "GrainPopulation",
    "Hopper",
    "Interaction",
    "LiftedCylinder",
    "Material",
    "Mechanism",
    "Numerics",
    "Parameter",
    "Progress",
    "ShapeMixture",
    "SizeClasses",
    "WallPart",
    "__version__",
    "effective_moduli",
    "laws_named",
    "rayleigh_time",
    "simulate",
]
