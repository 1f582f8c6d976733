"""Lifted cylinder as the input of another code needs it: templates of grains, walls, rain, phases."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from dem_warp import Case, ClumpShape, Drum, LiftedCylinder
from dem_warp.scenes.drum import HATCH
from dem_warp.scenes.lifted_cylinder import LiftController
from dem_warp.scenes.phases import CALM
from dem_warp.scenes.rain import CrossSection
from experiments.export.exporter import ExportedTest
from experiments.export.sizes import classes_of
from experiments.io.errors import InputError

FIRST_SEED = 10_000
"""Number that LIGGGHTS' seeds, which are primes, exceed."""

RAIN_DENSITY = 0.12
"""Largest solid fraction of the rain: in a denser one not all grains find a place at random."""

SIDES = 60
"""Sides of the prism around the tube; its edges are 0.14 % of the radius outside the cylinder."""

LOOK = 5e-3
"""Time between two looks at the grains [s]."""


@dataclass(frozen=True, eq=False)
class Template:
    """Grain that represents a part of the population: a shape at a size."""

    shape: ClumpShape
    size: float
    fraction: float
    """Share of the number of grains."""
    density: float

    @property
    def centers(self) -> np.ndarray:
        """Centres of the spheres about the centre of mass, along the principal axes [m], (S, 3)."""
        return self.shape.centers * self.size

    @property
    def radii(self) -> np.ndarray:
        """Their radii [m], (S,)."""
        return self.shape.radii * self.size

    @property
    def mass(self) -> float:
        """Mass of the union of the spheres [kg]."""
        return self.density * self.shape.volume * self.size**3

    @property
    def inertia(self) -> np.ndarray:
        """Principal moments of the union [kg m2], (3,)."""
        return self.mass * self.shape.inertia_over_mass * self.size**2

    @property
    def reach(self) -> float:
        """Bounding radius [m]."""
        return self.shape.bounding_radius * self.size


@dataclass(frozen=True)
class Lift:
    """Lifted cylinder, hopper or drum, and the numbers that follow from its case.

    Raises
    ------
    InputError
        When the test is of another kind.
    """

    test: ExportedTest
    code: str = "this code"
    """Name of the code that it is exported to."""
    kinds: tuple[type, ...] = (LiftedCylinder,)
    """Kinds of tests that the code is given."""

    def __post_init__(self) -> None:
        scene = self.test.case.scene
        if not isinstance(scene, self.kinds):
            rule = f"the test must be a {' or a '.join(kind.name for kind in self.kinds)}: {self.code} "  # type: ignore[attr-defined]
            raise InputError(
                self.test.source, rule + "is given no other", getattr(scene, "name", type(scene).__name__)
            )
        shapes = len(self.case.grains.mixture.shapes)
        if not isinstance(scene, LiftedCylinder) and shapes > 1:
            rule = f"the grains must be of one shape: {self.code} is given no {self.scene.name} of a mixture"
            raise InputError(self.test.source, rule, f"{shapes} shapes")
        if isinstance(scene, LiftedCylinder) and scene.lip > 0.0:
            rule = "the plate must have no lip: no code is given one"
            raise InputError(self.test.source, rule, f"lip = {scene.lip:g} m")
        if isinstance(scene, Drum) and scene.is_hatched:
            rule = "the drum must be level and filled to a half at most: no code is given another"
            found = f"inclination = {math.degrees(scene.inclination):g} deg, filling = {scene.filling:g}"
            raise InputError(self.test.source, rule, found)

    @property
    def case(self) -> Case[Any]:
        """The case."""
        return self.test.case

    @property
    def scene(self) -> Any:
        """Its scene."""
        return self.case.scene

    @cached_property
    def templates(self) -> tuple[Template, ...]:
        """Templates of every shape in every class of size."""
        grains, density = self.case.grains, self.case.grain_material.density
        return tuple(
            Template(shape, size, part * share, density)
            for shape, part in zip(grains.mixture.shapes, grains.mixture.fractions, strict=True)
            for size, share in classes_of(grains)
        )

    @property
    def is_of_spheres(self) -> bool:
        """True when every grain is one sphere."""
        return all(template.shape.sphere_count == 1 for template in self.templates)

    @property
    def reach(self) -> float:
        """Largest bounding radius [m]."""
        return max(template.reach for template in self.templates)

    @property
    def largest_radius(self) -> float:
        """Largest sphere radius [m]."""
        return max(float(template.radii.max()) for template in self.templates)

    @property
    def skin(self) -> float:
        """Reach of the neighbour lists beyond contact [m]."""
        return 0.4 * min(float(template.radii.mean()) for template in self.templates)

    def seeds(self, count: int) -> tuple[int, ...]:
        """Draw distinct primes above 10000 from the seed of the case."""
        drawn = np.random.default_rng([self.case.seed, FIRST_SEED]).integers(FIRST_SEED, 10**7, count)
        seeds: list[int] = []
        for number in drawn.tolist():
            while number in seeds or not all(
                number % divisor for divisor in range(2, math.isqrt(number) + 1)
            ):
                number += 1
            seeds.append(number)
        return tuple(seeds)

    def steps(self, time: float) -> int:
        """Return the number of steps of a time [s]."""
        return max(round(time / self.case.time_step), 1)

    @property
    def count(self) -> int:
        """Grains to pour, or kept ready where the tube is filled to its rim."""
        return self.scene.supply(self.case)

    @property
    def rain_section(self) -> CrossSection:
        """Opening that the rain stays in: a circle, in a drum the rectangle that fits at the rain's top."""
        radius, gap = self.scene.diameter / 2, 0.5 * self.skin
        if not isinstance(self.scene, Drum):
            return CrossSection.circle(radius - gap)
        top = self.rain_bottom + self.rain_height + self.reach
        return CrossSection((math.sqrt(radius**2 - (top - radius) ** 2) - gap, self.scene.length / 2 - gap))

    @property
    def rain_bottom(self) -> float:
        """Lowest height that a grain is put at [m]."""
        return self.scene.release(self.reach) + self.skin

    @property
    def rain_height(self) -> float:
        """Height of the space that grains are put in [m]: three of the largest grain, or a drum's room."""
        height = 6.0 * self.reach
        if not isinstance(self.scene, Drum):
            return height
        return min(height, (1.0 + HATCH) * self.scene.diameter / 2 - self.rain_bottom - self.reach)

    @property
    def rain_period(self) -> float:
        """Time in which grains leave that space at the speed of the rain [s]."""
        return self.rain_height / self.scene.rain_speed

    @property
    def given_rate(self) -> float:
        """Grains a second in the scene."""
        return self.scene.grains_per_second(self.case)

    @property
    def rain_rate(self) -> float:
        """Grains a second: the scene's, or the most that find a place."""
        volume = self.case.grains.mean(lambda shape: shape.volume)
        area = self.rain_section.open_area(self.reach)
        return min(self.given_rate, RAIN_DENSITY * self.scene.rain_speed * area / volume)

    @property
    def fill_limit(self) -> float:
        """Time after which the filling has failed [s]."""
        return self.count / self.rain_rate + LiftController.FILL_MARGIN

    @property
    def calm_speed(self) -> float:
        """Speed that no grain at rest exceeds [m/s]."""
        return CALM * self.scene.rest_speed

    @property
    def strike(self) -> float:
        """Height above which spheres are struck off with their grains [m], in the mean as many as grains."""
        return self.scene.brim + self.rise_of_spheres

    @cached_property
    def rise_of_spheres(self) -> float:
        """Mean height of a grain's highest sphere centre above its centre, over all directions [m]."""
        directions = np.random.default_rng(FIRST_SEED).normal(size=(4096, 3))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        rises = [(directions @ template.centers.T).max(axis=1).mean() for template in self.templates]
        return float(np.dot([template.fraction for template in self.templates], rises))


def prism(radius: float, height: float, sides: int = SIDES) -> np.ndarray:
    """Return the triangles of a prism around a tube on z = 0, touching it [m], (2 sides, 3, 3)."""
    corner = radius / np.cos(np.pi / sides)
    return shell(corner, corner, height, sides)


def shell(low_corner: float, high_corner: float, height: float, sides: int = SIDES) -> np.ndarray:
    """Return the triangles between two polygons, at z = 0 and above, by the radii of their corners [m]."""
    turns = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    circle = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(sides)])
    low, high = low_corner * circle, high_corner * circle + np.array([0.0, 0.0, height])
    next_low, next_high = np.roll(low, -1, axis=0), np.roll(high, -1, axis=0)
    halves = [(low, next_low, next_high), (low, next_high, high)]
    return np.concatenate([np.stack(corners, axis=1) for corners in halves])


def disc(radius: float, sides: int = SIDES) -> np.ndarray:
    """Return the triangles of a regular polygon at z = 0 with the area of a disc [m], (sides, 3, 3)."""
    return shell(disc_corner(radius, sides), 0.0, 0.0, sides)[:sides, [2, 0, 1]]


def disc_corner(radius: float, sides: int = SIDES) -> float:
    """Return the radius of the corners of a regular polygon with the area of a disc [m]."""
    return radius * math.sqrt(2.0 * np.pi / (sides * math.sin(2.0 * np.pi / sides)))


def stl_text(name: str, triangles: np.ndarray) -> str:
    """Write triangles as an STL file in text, in metres."""
    lines = [f"solid {name}"]
    for corners in triangles:
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        normal /= np.linalg.norm(normal)
        lines.append(f"facet normal {_numbers(normal)}\n outer loop")
        lines += [f"  vertex {_numbers(corner)}" for corner in corners]
        lines.append(" endloop\nendfacet")
    return "\n".join([*lines, f"endsolid {name}\n"])


def _numbers(values: np.ndarray) -> str:
    return " ".join(f"{value:.9g}" for value in values)
