"""The grains of a case: their shapes, their material and their sizes, and how they are drawn from a seed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from dem_warp.clumps import ClumpShape
from dem_warp.materials import Material
from dem_warp.parameters import LATER

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


GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
"""Step of the sequence that classes are drawn by: of all numbers the worst to come near with fractions."""

MIXED = 16
"""Grains of a drawn order that change places, so that neighbours in the rain are strangers."""

CHANGES, STRAY = 4, 1.5
"""Grains among them that change their class, at most, and grains by which a class may miss its share then."""


@dataclass(frozen=True)
class SizeClasses:
    """Sizes that occur, each with its part of the number of grains.

    Raises
    ------
    ValueError
        If the sizes do not rise, or the fractions do not add up.
    """

    sizes: tuple[float, ...]
    """Scales of the shape, rising."""
    fractions: tuple[float, ...]
    """Part of the number of grains of each; positive, together 1."""

    def __post_init__(self) -> None:
        if not self.sizes or len(self.sizes) != len(self.fractions):
            raise ValueError(
                f"SizeClasses.fractions: must be one for each size, got {len(self.fractions)} for "
                f"{len(self.sizes)}"
            )
        rising = all(a < b for a, b in pairwise((0.0, *self.sizes)))
        if not (rising and math.isfinite(self.sizes[-1])):
            raise ValueError(f"SizeClasses.sizes: must be positive, finite and rise, got {self.sizes!r}")
        total = sum(self.fractions)
        if not (min(self.fractions) > 0.0 and math.isclose(total, 1.0, abs_tol=FRACTION_TOLERANCE)):
            raise ValueError(
                f"SizeClasses.fractions: must be positive and add up to 1, got {self.fractions!r}"
            )

    def moment(self, power: int) -> float:
        """Mean of a power of the size over the number of grains."""
        return float(np.dot(self.fractions, np.power(self.sizes, power)))

    def draw(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Draw the sizes of `count` grains, (count,).

        The sequence n golden mod 1, from a random start, has the lowest discrepancy of its kind. After each
        MIXED grains a few of them change their class, so that all so far have the mean mass, and every class
        its share within STRAY grains. So a world of few grains keeps the mean mass, and so does a container
        that takes the first of them.

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
    """Change classes of the last grains, in place, until all so far have the mean mass; the new counts."""
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
    classes: SizeClasses | None = field(default=None, metadata=LATER)
    """Sizes that were measured, instead of a normal distribution: mean and standard deviation are theirs."""

    def __post_init__(self) -> None:
        if self.classes is not None:
            self._check_classes(self.classes)
            return
        if not self.size_mean > 0:
            raise ValueError(f"GrainPopulation.size_mean: must be positive, got {self.size_mean!r}")
        if not 0 <= SIZE_LIMIT * self.size_sd < self.size_mean:
            raise ValueError(
                f"GrainPopulation.size_sd: must be at least 0 and below size_mean / {SIZE_LIMIT:g}, "
                f"got {self.size_sd!r}"
            )

    def _check_classes(self, classes: SizeClasses) -> None:
        mean = classes.moment(1)
        spread = math.sqrt(max(classes.moment(2) - mean**2, 0.0))
        for name, its in (("size_mean", mean), ("size_sd", spread)):
            if not math.isclose(getattr(self, name), its, rel_tol=1e-9, abs_tol=1e-9):
                rule = f"must be that of its classes, {its:.9g}"
                raise ValueError(f"GrainPopulation.{name}: {rule}, got {getattr(self, name)!r}")

    @classmethod
    def of_classes(
        cls, shape: ClumpShape | ShapeMixture, material: Material, classes: SizeClasses
    ) -> GrainPopulation:
        """Build a population of classes of size."""
        mean = classes.moment(1)
        spread = math.sqrt(max(classes.moment(2) - mean**2, 0.0))
        return cls(shape, material, mean, spread, classes)

    @property
    def size_range(self) -> tuple[float, float]:
        """Smallest and largest size that the population may hold."""
        if self.classes is not None:
            return self.classes.sizes[0], self.classes.sizes[-1]
        reach = SIZE_LIMIT * self.size_sd
        return self.size_mean - reach, self.size_mean + reach

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
        return smallest * self.size_range[0]

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
        if self.classes is not None:
            return self.classes.draw(count, rng)
        sizes = rng.normal(size=count)
        while (wide := np.abs(sizes) > SIZE_LIMIT).any():
            sizes[wide] = rng.normal(size=int(wide.sum()))
        return self.size_mean + self.size_sd * sizes
