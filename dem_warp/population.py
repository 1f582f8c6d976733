"""The grains of a case: their shapes, their material and their sizes, and how they are drawn from a seed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dem_warp.clumps import ClumpShape
from dem_warp.materials import Material

SIZE_LIMIT = 3.0
"""Sizes are drawn within this many standard deviations of their mean."""

SIZE_VARIANCE = 1.0 - 2.0 * SIZE_LIMIT * math.exp(-0.5 * SIZE_LIMIT**2) / (
    math.sqrt(2.0 * math.pi) * math.erf(SIZE_LIMIT / math.sqrt(2.0))
)
"""Variance of a standard normal variable that is cut at SIZE_LIMIT."""

FRACTION_TOLERANCE = 1e-6
"""Fractions add up to 1 within this, so that decimals may be rounded."""

_SIZES, _SHAPES = 0, 2
"""Streams of random numbers of a seed; 1 is that of the orientations."""


@dataclass(frozen=True)
class ShapeMixture:
    """Several shapes, each with its part of the grains.

    Raises
    ------
    ValueError
        If there is no shape, or the fractions break their rule.
    """

    shapes: tuple[ClumpShape, ...]
    fractions: tuple[float, ...]
    """Part of the number of grains that has each shape; 0 or more, together 1. The shape of every grain
    is drawn by itself, so that the counts of a world are multinomial."""

    def __post_init__(self) -> None:
        if not self.shapes:
            raise ValueError("ShapeMixture.shapes: must hold at least one shape, got none")
        if len(self.fractions) != len(self.shapes):
            raise ValueError(
                f"ShapeMixture.fractions: must be one for each of {len(self.shapes)} shapes, got "
                f"{len(self.fractions)}"
            )
        for index, fraction in enumerate(self.fractions):
            if not (math.isfinite(fraction) and fraction >= 0.0):
                raise ValueError(
                    f"ShapeMixture.fractions[{index}]: must be finite and at least 0, got {fraction!r}"
                )
        if not math.isclose(sum(self.fractions), 1.0, rel_tol=0.0, abs_tol=FRACTION_TOLERANCE):
            raise ValueError(
                f"ShapeMixture.fractions: must add up to 1, got {self.fractions!r}, together "
                f"{sum(self.fractions):g}"
            )


@dataclass(frozen=True, eq=False)
class DrawnGrains:
    """Grains drawn from a population, before they have a place."""

    clumps: tuple[ClumpShape, ...]
    shapes: np.ndarray
    """Index of each grain's shape into `clumps`, shape (n,)."""
    sizes: np.ndarray
    """Scale of the shape, shape (n,)."""

    @property
    def count(self) -> int:
        """Number of grains."""
        return len(self.sizes)

    @property
    def bounding_radii(self) -> np.ndarray:
        """Distance of the farthest point of each grain from its centre [m], (n,)."""
        return np.array([clump.bounding_radius for clump in self.clumps])[self.shapes] * self.sizes


def size_of_mean_mass(size: float, size_sd: float) -> float:
    """Mean of the sizes whose spread leaves the mean mass at that of a grain of one size.

    The mass goes as the cube of the size, whose mean over a distribution symmetric about m, of variance v, is
    m^3 + 3 m v; this is Cardano's real root of m^3 + 3 m v = size^3.

    Parameters
    ----------
    size
        The size that has the mean mass, positive.
    size_sd
        Standard deviation of the sizes before they are cut.
    """
    variance, half = SIZE_VARIANCE * size_sd**2, 0.5 * size**3
    root = math.cbrt(half + math.sqrt(half**2 + variance**3))
    return root - variance / root


@dataclass(frozen=True)
class GrainPopulation:
    """Grains of one material whose sizes, and shapes where there are several, vary.

    Raises
    ------
    ValueError
        If a size leaves its range.
    """

    shape: ClumpShape | ShapeMixture
    material: Material
    size_mean: float = 1.0
    size_sd: float = 0.05
    """Of the normal distribution of the factor that scales a grain's shape, the same for every shape;
    truncated at +-3 standard deviations."""

    def __post_init__(self) -> None:
        if not self.size_mean > 0:
            raise ValueError(f"GrainPopulation.size_mean: must be positive, got {self.size_mean!r}")
        if not 0 <= SIZE_LIMIT * self.size_sd < self.size_mean:
            raise ValueError(
                f"GrainPopulation.size_sd: must be at least 0 and below size_mean / {SIZE_LIMIT:g}, "
                f"got {self.size_sd!r}"
            )

    @property
    def mixture(self) -> ShapeMixture:
        """The shapes that occur, and their fractions: a shape of fraction 0 is as good as absent."""
        if isinstance(self.shape, ClumpShape):
            return ShapeMixture((self.shape,), (1.0,))
        present = [i for i, fraction in enumerate(self.shape.fractions) if fraction > 0.0]
        return ShapeMixture(
            tuple(self.shape.shapes[i] for i in present), tuple(self.shape.fractions[i] for i in present)
        )

    @property
    def sphere_count(self) -> int:
        """Number of spheres of the shape that has most."""
        return max(shape.sphere_count for shape in self.mixture.shapes)

    @property
    def smallest_sphere(self) -> float:
        """Smallest sphere radius that the population may hold [m]."""
        smallest = min(float(shape.radii.min()) for shape in self.mixture.shapes)
        return smallest * (self.size_mean - SIZE_LIMIT * self.size_sd)

    def mean(self, quantity: Callable[[ClumpShape], float]) -> float:
        """Mean of a quantity of the shapes over the number of grains, at size 1."""
        mixture = self.mixture
        return float(np.dot(mixture.fractions, [quantity(shape) for shape in mixture.shapes]))

    @property
    def grain_reach(self) -> float:
        """Bounding radius of a typical grain [m]: the mean over the volume of solid, at size 1."""
        volume = self.mean(lambda shape: shape.volume)
        return self.mean(lambda shape: shape.volume / volume * shape.bounding_radius)

    def draw(self, count: int, seed: int) -> DrawnGrains:
        """Draw `count` grains, the same ones from the same seed."""
        return DrawnGrains(
            self.mixture.shapes,
            self.draw_shapes(count, np.random.default_rng([seed, _SHAPES])),
            self.draw_sizes(count, np.random.default_rng([seed, _SIZES])),
        )

    def draw_shapes(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Shapes of `count` grains as indices into the mixture's, (count,)."""
        below = np.cumsum(self.mixture.fractions)
        return np.searchsorted(below / below[-1], rng.random(count), side="right")

    def draw_sizes(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Sizes of `count` grains, (count,)."""
        sizes = rng.normal(size=count)
        while (wide := np.abs(sizes) > SIZE_LIMIT).any():
            sizes[wide] = rng.normal(size=int(wide.sum()))
        return self.size_mean + self.size_sd * sizes
