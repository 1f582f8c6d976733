"""``[grain.sizes]``: the sizes of the grains as they were measured, from a table or as a distribution."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from dem_warp import ClumpShape, GrainPopulation, Material, SizeClasses
from experiments.grains.sizes.diameters import DIAMETERS
from experiments.grains.sizes.distribution import Continuous, Distribution
from experiments.grains.sizes.size_classes import Classes, cut_classes
from experiments.io.units import unit_size
from experiments.studyfile.schema import Length, Number, Section, StudyFile

SOURCES = ("sieves", "counts", "distribution")
"""Keys of which a section has one."""

TERMS: Mapping[str, tuple[str, ...]] = {
    "normal": ("mean", "sd"),
    "lognormal": ("median", "geometric_sd"),
    "rosin-rammler": ("d63", "spread"),
}
"""Numbers that each distribution takes."""


class SizesSection(Section):
    """``[grain.sizes]``: the sizes as they were measured, in place of size_mean and size_sd.

    The clump or the sphere then says the shape alone: it is scaled to each size.
    """

    sieves: StudyFile | None = None
    """File of a sieve analysis, a CSV relative to the study: opening, and retained, retained_percent or
    passing_percent, or the names of a laboratory's sheet."""
    counts: StudyFile | None = None
    """File of an image analyser, a CSV relative to the study: a diameter a grain, or from, to and count."""
    unit: str | None = None
    """Unit of the diameters of the file that have no unit, e.g. um."""
    column: str | None = None
    """Name of the diameter's column in the file of an image analyser. Default: diameter."""
    distribution: Literal["normal", "lognormal", "rosin-rammler"] | None = None
    """Distribution instead of a file."""
    mean: Length | None = Field(default=None, gt=0.0)
    """Mean diameter of a normal distribution."""
    sd: Length | None = Field(default=None, gt=0.0)
    """Standard deviation of a normal distribution."""
    median: Length | None = Field(default=None, gt=0.0)
    """Median diameter of a lognormal distribution."""
    geometric_sd: Number | None = Field(default=None, gt=1.0)
    """Geometric standard deviation of a lognormal distribution: 84 % lie below as many medians."""
    d63: Length | None = Field(default=None, gt=0.0)
    """Diameter that 63.2 % of a Rosin-Rammler distribution lie below."""
    spread: Number | None = Field(default=None, gt=0.0)
    """Exponent of a Rosin-Rammler distribution: the larger, the narrower."""
    by: Literal["number", "volume", "mass"] | None = None
    """Quantity that the shares are of. Default: mass of a sieve analysis, number of counts."""
    diameter: Literal["sieve", "feret", "volume"] | None = None
    """Diameter that was measured: the side of the square opening that a grain just passes, its largest extent
    (Feret), or that of a sphere of its volume. Default: sieve of a sieve analysis, any of spheres."""
    correction: Number = Field(default=1.0, gt=0.0)
    """Number that all diameters are multiplied by. A factor with a direct reading, it is a table's error."""
    cut: tuple[Annotated[float, Field(ge=0.0, lt=1.0)], Annotated[float, Field(gt=0.0, le=1.0)]] = (
        0.01,
        0.99,
    )
    """Quantiles between which the grains are simulated; the report says how much mass is beyond them."""
    classes: int = Field(default=10, ge=1, le=50)
    """Classes of equal shares between the cuts, each of the size of its mean mass."""

    @field_validator("unit")
    @classmethod
    def _is_a_length(cls, unit: str | None) -> str | None:
        if unit is not None:
            unit_size(unit, "length")
        return unit

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        given = [name for name in SOURCES if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(
                f"must have one of {', '.join(SOURCES)}, got {' and '.join(given) or 'no source'}"
            )
        wanted = TERMS[self.distribution] if self.distribution else ()
        known = {name for names in TERMS.values() for name in names}
        found = {name for name in known if getattr(self, name) is not None}
        if missing := [name for name in wanted if name not in found]:
            raise ValueError(f"a {self.distribution} distribution needs {' and '.join(missing)}")
        if odd := sorted(found - set(wanted)):
            raise ValueError(f"{given[0]} must not have {', '.join(odd)}")
        if self.distribution and self.by is None:
            raise ValueError('a distribution needs by = "number", "volume" or "mass"')
        if self.unit is not None and self.distribution:
            raise ValueError("must have unit only with a file")
        if self.column is not None and self.counts is None:
            raise ValueError("must have column only with counts")
        if self.sieves is not None and self.by == "number":
            raise ValueError("a sieve analysis must be by mass or volume, not by number")
        if not self.cut[0] < self.cut[1]:
            raise ValueError(f"cut must rise, got {self.cut[0]:g} and {self.cut[1]:g}")
        self.cut_into_classes()
        return self

    @property
    def files(self) -> tuple[Path, ...]:
        return tuple(file for file in (self.sieves, self.counts) if file is not None)

    def cut_into_classes(self) -> Classes:
        """Classes of the diameter as it was measured."""
        return _classes(self, tuple(file.stat().st_mtime_ns for file in self.files))

    def population(self, shape: ClumpShape, material: Material) -> GrainPopulation:
        """Build the population of a shape: scaled so that size 1 is the grain of mean mass."""
        classes = self.cut_into_classes()
        middle = classes.mean_mass_diameter
        sizes = tuple(diameter / middle for diameter in classes.diameters)
        scaled = shape.scaled(self.correction * middle / self._diameter_of(shape))
        return GrainPopulation.of_classes(scaled, material, SizeClasses(sizes, classes.fractions))

    def check_shape(self, shape: ClumpShape) -> None:
        """Raise a ValueError where the kind of diameter is not given, and the shape has several."""
        self._diameter_of(shape)

    def _diameter_of(self, shape: ClumpShape) -> float:
        kind = self.diameter or ("sieve" if self.sieves is not None else None)
        if kind is None and shape.sphere_count > 1:
            raise ValueError('needs diameter = "sieve", "feret" or "volume", as the grains are no spheres')
        return DIAMETERS[kind or "volume"](shape)


@lru_cache(maxsize=64)
def _classes(section: SizesSection, modified: tuple[int, ...]) -> Classes:
    """Cut a section into classes; a file that is written anew is read anew."""
    distribution, unaccounted = _distribution(section)
    basis = section.by or ("mass" if section.sieves is not None else "number")
    return cut_classes(distribution, basis, section.cut, section.classes, unaccounted)


def _distribution(section: SizesSection) -> tuple[Distribution, float]:
    """Distribution of the diameter, and the share of the mass without a diameter in the table."""
    # The formulas of scipy.stats take a second to load, and few studies need them; the readers of tables know
    # the units of this package.
    from scipy import stats

    from experiments.grains.sizes.size_tables import read_counts, read_sieves

    if section.sieves is not None:
        return read_sieves(section.sieves, section.unit)
    if section.counts is not None:
        return read_counts(section.counts, section.unit, section.column), 0.0
    first, second = (float(getattr(section, name)) for name in TERMS[section.distribution or ""])
    laws: Mapping[str, Any] = {
        "normal": lambda: stats.norm(first, second),
        "lognormal": lambda: stats.lognorm(math.log(second), scale=first),
        "rosin-rammler": lambda: stats.weibull_min(second, scale=first),
    }
    return Continuous(laws[section.distribution or ""]()), 0.0
