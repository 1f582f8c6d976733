"""The grains of a case: shapes, material and sizes, drawn from a seed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from dem_warp.clumps import ClumpShape
from dem_warp.materials import Material
from dem_warp.parameters import LATER, Parameter

SIZE_LIMIT = 3.0
"""Truncation of the normal distribution of sizes, in standard deviations."""

SIZE_VARIANCE = 1.0 - 2.0 * SIZE_LIMIT * math.exp(-0.5 * SIZE_LIMIT**2) / (
    math.sqrt(2.0 * math.pi) * math.erf(SIZE_LIMIT / math.sqrt(2.0))
)
"""Variance of a standard normal variable truncated at SIZE_LIMIT."""

FRACTION_TOLERANCE = 1e-6
"""Largest difference of the sum of fractions from 1, for rounded decimals."""

_SIZES, _SHAPES = 0, 2
"""Random streams of a seed; 1 is for the orientations."""


def _check_sum(place: str, fractions: tuple[float, ...]) -> None:
    total = sum(fractions)
    if not math.isclose(total, 1.0, rel_tol=0.0, abs_tol=FRACTION_TOLERANCE):
        raise ValueError(f"{place}: must add up to 1, got {fractions!r}, together {total:g}")


@dataclass(frozen=True)
class ShapeMixture:
    """Several shapes, each with its part of the grains."""

    shapes: tuple[ClumpShape, ...]
    fractions: tuple[float, ...]
    """Part of the number of grains with each shape; 0 or more, together 1. The shape of every grain is drawn
    independently: the counts of a world are multinomial."""

    def __post_init__(self) -> None:
        if not self.shapes:
            raise ValueError("ShapeMixture.shapes: must hold at least one shape, got none")
        if len(self.fractions) != len(self.shapes):
            rule = f"must be one for each of {len(self.shapes)} shapes"
            raise ValueError(f"ShapeMixture.fractions: {rule}, got {len(self.fractions)}")
        for index, fraction in enumerate(self.fractions):
            Parameter("1", at_least=0.0).check(f"ShapeMixture.fractions[{index}]", fraction)
        _check_sum("ShapeMixture.fractions", self.fractions)


GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
"""Step of the sequence that classes are drawn with: the number worst approximated by fractions."""

MIXED = 16
"""Grains of the drawn order that are shuffled, so that neighbours in the rain are independent."""

CHANGES, STRAY = 4, 1.5
"""Most grains among them that change their class, and largest difference of a class from its share then."""


@dataclass(frozen=True)
class SizeClasses:
    """Discrete sizes, each with its part of the number of grains."""

    sizes: tuple[float, ...]
    """Scales of the shape, increasing."""
    fractions: tuple[float, ...]
    """Part of the number of grains with each size; positive, together 1."""

    def __post_init__(self) -> None:
        if not self.sizes or len(self.sizes) != len(self.fractions):
            rule = f"must be one for each of {len(self.sizes)} sizes"
            raise ValueError(f"SizeClasses.fractions: {rule}, got {len(self.fractions)}")
        increasing = all(a < b for a, b in pairwise((0.0, *self.sizes)))
        if not (increasing and math.isfinite(self.sizes[-1])):
            raise ValueError(
                f"SizeClasses.sizes: must be positive, finite and increasing, got {self.sizes!r}"
            )
        if not min(self.fractions) > 0.0:
            raise ValueError(f"SizeClasses.fractions: must be positive, got {self.fractions!r}")
        _check_sum("SizeClasses.fractions", self.fractions)

    def moment(self, power: int) -> float:
        """Return the mean of a power of the size over the number of grains."""
        return float(np.dot(self.fractions, np.power(self.sizes, power)))

    def draw(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Draw the sizes of `count` grains, (count,).

        The sequence n golden mod 1, from a random start, has the lowest discrepancy of its kind. After each
        MIXED grains some change their class, so that all so far have the mean mass and every class has its
        share within STRAY grains: the mean mass holds for few grains and for the first ones.

        References
        ----------
        Niederreiter, Random Number Generation and Quasi-Monte Carlo Methods, SIAM (1992), section 3.1.
        """
        below = np.cumsum(self.fractions)
        shares = (rng.random() + GOLDEN * np.arange(count)) % 1.0
        places = np.searchsorted(below / below[-1], shares, side="right")
        masses = np.power(self.sizes, 3) / self.moment(3)
        counts = np.zeros(len(masses))
        for start in range(0, count, MIXED):
            some = places[start : start + MIXED]
            counts += np.bincount(some, minlength=len(masses))
            counts = _balanced(some, counts, masses, np.array(self.fractions))
            rng.shuffle(some)
        return np.array(self.sizes)[places]


def _balanced(some: np.ndarray, counts: np.ndarray, masses: np.ndarray, fractions: np.ndarray) -> np.ndarray:
    """Change classes of the last grains, in place, until all have the mean mass; return the new counts."""
    for _ in range(CHANGES):
        ahead = counts - counts.sum() * fractions
        excess = counts @ masses - counts.sum()
        left = np.abs(excess + masses - masses[:, None])
        from_may = (np.bincount(some, minlength=len(masses)) > 0) & (ahead - 1.0 > -STRAY)
        left[~np.outer(from_may, ahead + 1.0 < STRAY)] = np.inf
        old, new = np.unravel_index(np.argmin(left), left.shape)
        if left[old, new] >= abs(excess):
            break
        some[np.argmax(some == old)] = new
        counts = counts + np.eye(len(masses))[new] - np.eye(len(masses))[old]
    return counts


@dataclass(frozen=True, eq=False)
class DrawnGrains:
    """Grains drawn from a population, without places."""

    clumps: tuple[ClumpShape, ...]
    shapes: np.ndarray
    """Index of each grain's shape into `clumps`, shape (n,)."""
    sizes: np.ndarray
    """Scale of each grain's shape, shape (n,)."""

    @property
    def count(self) -> int:
        return len(self.sizes)

    @property
    def bounding_radii(self) -> np.ndarray:
        """Distance of the farthest point of each grain from its centre [m], (n,)."""
        return np.array([clump.bounding_radius for clump in self.clumps])[self.shapes] * self.sizes


def size_of_mean_mass(size: float, size_sd: float) -> float:
    """Return the mean of sizes with a spread whose mean mass is that of a grain of `size`.

    `size_sd` is the standard deviation before the truncation. The mean of the cube over a symmetric
    distribution of mean m and variance v is m^3 + 3 m v; this is Cardano's real root of m^3 + 3 m v = size^3.
    """
    variance, half = SIZE_VARIANCE * size_sd**2, 0.5 * size**3
    root = math.cbrt(half + math.sqrt(half**2 + variance**3))
    return root - variance / root


def _mean_and_sd(classes: SizeClasses) -> tuple[float, float]:
    mean = classes.moment(1)
    return mean, math.sqrt(max(classes.moment(2) - mean**2, 0.0))


@dataclass(frozen=True)
class GrainPopulation:
    """Grains of one material with varying sizes and shapes."""

    shape: ClumpShape | ShapeMixture
    material: Material
    size_mean: float = 1.0
    size_sd: float = 0.05
    """Mean and standard deviation of the normal distribution of the scale of the shape, the same for every
    shape, truncated at 3 standard deviations."""
    classes: SizeClasses | None = field(default=None, metadata=LATER)
    """Measured sizes instead of the normal distribution; mean and standard deviation must be theirs."""

    def __post_init__(self) -> None:
        if self.classes is not None:
            self._check_classes(self.classes)
            return
        if not self.size_mean > 0:
            raise ValueError(f"GrainPopulation.size_mean: must be positive, got {self.size_mean!r}")
        if not 0 <= SIZE_LIMIT * self.size_sd < self.size_mean:
            rule = f"must be at least 0 and below size_mean / {SIZE_LIMIT:g}"
            raise ValueError(f"GrainPopulation.size_sd: {rule}, got {self.size_sd!r}")

    def _check_classes(self, classes: SizeClasses) -> None:
        for name, its in zip(("size_mean", "size_sd"), _mean_and_sd(classes), strict=True):
            if not math.isclose(getattr(self, name), its, rel_tol=1e-9, abs_tol=1e-9):
                rule = f"must be that of the classes, {its:.9g}"
                raise ValueError(f"GrainPopulation.{name}: {rule}, got {getattr(self, name)!r}")

    @classmethod
    def of_classes(
        cls, shape: ClumpShape | ShapeMixture, material: Material, classes: SizeClasses
    ) -> GrainPopulation:
        return cls(shape, material, *_mean_and_sd(classes), classes)

    @property
    def size_range(self) -> tuple[float, float]:
        if self.classes is not None:
            return self.classes.sizes[0], self.classes.sizes[-1]
        reach = SIZE_LIMIT * self.size_sd
        return self.size_mean - reach, self.size_mean + reach

    @property
    def mixture(self) -> ShapeMixture:
        """Shapes with a fraction above 0, and their fractions."""
        if isinstance(self.shape, ClumpShape):
            return ShapeMixture((self.shape,), (1.0,))
        present = [i for i, fraction in enumerate(self.shape.fractions) if fraction > 0.0]
        return ShapeMixture(
            tuple(self.shape.shapes[i] for i in present), tuple(self.shape.fractions[i] for i in present)
        )

    @property
    def sphere_count(self) -> int:
        """Largest number of spheres of a shape."""
        return max(shape.sphere_count for shape in self.mixture.shapes)

    @property
    def smallest_sphere(self) -> float:
        """Smallest possible sphere radius [m]."""
        smallest = min(float(shape.radii.min()) for shape in self.mixture.shapes)
        return smallest * self.size_range[0]

    def mean(self, quantity: Callable[[ClumpShape], float]) -> float:
        """Return the mean of a quantity of the shapes over the number of grains, at size 1."""
        mixture = self.mixture
        return float(np.dot(mixture.fractions, [quantity(shape) for shape in mixture.shapes]))

    @property
    def grain_reach(self) -> float:
        """Bounding radius of a typical grain [m]: the mean over the solid volume, at size 1."""
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
        """Draw the shapes of `count` grains as indices into the mixture's, (count,)."""
        below = np.cumsum(self.mixture.fractions)
        return np.searchsorted(below / below[-1], rng.random(count), side="right")

    def draw_sizes(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Draw the sizes of `count` grains, (count,)."""
        if self.classes is not None:
            return self.classes.draw(count, rng)
        sizes = rng.normal(size=count)
        while (wide := np.abs(sizes) > SIZE_LIMIT).any():
            sizes[wide] = rng.normal(size=int(wide.sum()))
        return self.size_mean + self.size_sd * sizes
