"""A small lifted cylinder that leaves for other codes."""

from dataclasses import replace
from typing import Any

from dem_warp import (
    PRESETS,
    Case,
    ClumpShape,
    GrainPopulation,
    Interaction,
    LiftedCylinder,
    Material,
    Numerics,
    ShapeMixture,
)
from experiments.export import ExportedTest

GRAIN = Material(density=1000.0, shear_modulus=3e5, poisson_ratio=0.25)
WALL = Material(density=7800.0, shear_modulus=7e10, poisson_ratio=0.3)
ROD = ClumpShape.from_spheres([[-1e-3, 0, 0], [0, 0, 0], [1e-3, 0, 0]], [1e-3] * 3)
COUNT = 30


def exported_lift(laws: str, shape: ClumpShape | ShapeMixture = ROD, **changes: Any) -> ExportedTest:
    """Return a test of these grains in the laws of a code."""
    scene = LiftedCylinder(diameter=0.014, height=0.02, wall_material=WALL, rain_rate=3e3, rest_speed=3e-3)
    scene = replace(scene, **({"grain_count": COUNT} | changes))
    case = Case(
        scene, GrainPopulation(shape, GRAIN), Interaction(0.5, 0.5, 0.1), Interaction(0.6, 0.4, 0.2),
        seed=3, numerics=Numerics(modulus_scale=4.0), laws=PRESETS[laws],
    )  # fmt: skip
    return ExportedTest("small", case, "a test")
