"""Ten cards: five grains from spheres to elongated and angular clumps, each with two frictions."""

from dataclasses import dataclass

import numpy as np

from dem_warp import (
    PRESETS,
    Case,
    ClumpShape,
    GrainPopulation,
    Interaction,
    LiftedCylinder,
    Material,
    Numerics,
)

GRAIN_COUNT = 2000
VOLUME = 4.0 / 3.0 * np.pi * 1.25e-3**3
"""Grains of a heap, and the volume of one [m3]: all shapes have the same."""

MATERIAL = Material(density=1000.0, shear_modulus=30.0e6, poisson_ratio=0.25)
WALL = Material(density=7800.0, shear_modulus=70.0e9, poisson_ratio=0.30)
SOFTENING = 400.0
"""Factor that the grains' modulus is divided by."""

TUBE = LiftedCylinder(
    diameter=0.030, height=0.055, wall_material=WALL, grain_count=GRAIN_COUNT, rest_speed=2e-3
)

CODES = {"liggghts": "liggghts", "lammps": "lammps", "yade": "yade", "deme": "deme"}
"""Codes of the proof, and the set of laws that each has."""

TIME_STEP = 0.25
FINER_STEPS = {
    ("yade", "rod-high"): 0.1,
    ("deme", "sphere-high"): 0.1,
    ("deme", "rod-high"): 0.1,
    ("deme", "tetrapod-high"): 0.1,
}
"""Time steps as parts of Rayleigh's time: the usual one, and by code and card where grains tremble in place
at it and do not come to rest. At a tenth they do."""

SEEDS = (1, 2, 3, 4, 5)
"""Seeds of the heaps in each code."""
FRESH_SEEDS = tuple(range(6, 21))
"""Seeds of the heaps on both sides that alone decide a cell that `SEEDS` have not shown."""
OWN_SEEDS = tuple(range(1, 21))
"""Seeds of our heaps: they cost little, and their mean should not blur the comparison."""


def _shapes() -> dict[str, ClumpShape]:
    """Build the grains, by name."""
    corner = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3.0)
    rod = np.linspace(-1.6, 1.6, 4)
    disc = np.linspace(0.0, 2.0 * np.pi, 5, endpoint=False)
    spheres = {
        "sphere": ([[0.0, 0.0, 0.0]], [1.0]),
        "egg": ([[-0.35, 0.0, 0.0], [0.45, 0.0, 0.0]], [1.0, 0.8]),
        "rod": (np.column_stack([rod, 0.0 * rod, 0.0 * rod]), [1.0] * 4),
        "tetrapod": (0.8 * corner, [0.75] * 4),
        "lentil": (np.column_stack([np.cos(disc), np.sin(disc), 0.0 * disc]), [0.7] * 5),
    }
    shapes = {
        name: ClumpShape.from_spheres(np.array(at) * 1e-3, 1e-3 * np.array(radii))
        for name, (at, radii) in spheres.items()
    }
    return {name: _of_volume(shape) for name, shape in shapes.items()}


def _of_volume(shape: ClumpShape) -> ClumpShape:
    scale = np.cbrt(VOLUME / shape.volume)
    return ClumpShape(shape.centers * scale, shape.radii * scale, VOLUME, shape.inertia_over_mass * scale**2)


SHAPES = _shapes()
"""Grains by name."""

FRICTIONS = {
    "low": (Interaction(0.5, 0.3, 0.05), Interaction(0.5, 0.3, 0.05)),
    "high": (Interaction(0.5, 0.6, 0.2), Interaction(0.5, 0.5, 0.2)),
}
"""Grain on grain and grain on wall, by name: restitution, static and rolling friction."""


@dataclass(frozen=True)
class Card:
    """One grain with one friction."""

    shape: str
    friction: str

    @property
    def name(self) -> str:
        """Shape and friction."""
        return f"{self.shape}-{self.friction}"

    def case(self, code: str, seed: int) -> Case[LiftedCylinder]:
        """Build a case under the laws of a code."""
        among, wall = FRICTIONS[self.friction]
        step = FINER_STEPS.get((code, self.name), TIME_STEP)
        return Case(
            scene=TUBE,
            grains=GrainPopulation(SHAPES[self.shape], MATERIAL),
            grain_grain=among,
            grain_wall=wall,
            seed=seed,
            numerics=Numerics(time_step_fraction=step, modulus_scale=SOFTENING),
            laws=PRESETS[CODES[code]],
        )


CARDS = {card.name: card for card in (Card(shape, friction) for shape in SHAPES for friction in FRICTIONS)}
"""Every card by its name."""
