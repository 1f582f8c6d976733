"""Factors: parameters that a design varies, with their coding between natural units and -1..+1."""

import math
import numbers
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from doe.errors import DesignError

if TYPE_CHECKING:
    import pandas as pd

Values = TypeVar("Values", float, np.ndarray, "pd.Series")

RESERVED_NAMES = frozenset(
    {"intercept", "blocks", "curvature", "model", "residual", "lack of fit", "pure error", "total"}
)
"""Names of rows of the analysis tables, which no factor may have."""


@dataclass(frozen=True)
class Factor:
    """One parameter and the two levels that are coded -1 and +1.

    Parameters
    ----------
    name : str
        Unique in a design; without ``:``, ``^`` (they write interactions and squares) or outer blanks.
    low, high : float
        Levels in natural units, ``low < high``.
    unit : str
        For labels only.
    """

    name: str
    low: float
    high: float
    unit: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise DesignError(f"a factor's name must be text, got {self.name!r}")
        if not self.name or self.name != self.name.strip() or set(self.name) & set(":^"):
            raise DesignError(
                f"a factor's name must not be empty or have outer blanks, ':' or '^', got {self.name!r}"
            )
        if self.name in RESERVED_NAMES:
            raise DesignError(
                f"{self.name!r} names a row of the analysis tables: give the factor another name"
            )
        for place in ("low", "high"):
            value = getattr(self, place)
            if not isinstance(value, numbers.Real) or not math.isfinite(value):
                raise DesignError(f"factor {self.name!r}: {place} must be finite, got {getattr(self, place)}")
        if not self.low < self.high:
            raise DesignError(f"factor {self.name!r}: low must be below high, got {self.low} and {self.high}")

    @classmethod
    def around(cls, name: str, center: float, half_range: float, unit: str = "") -> "Factor":
        """Return the factor with this center and half range (both in natural units)."""
        return cls(name, center - half_range, center + half_range, unit)

    @property
    def center(self) -> float:
        """Natural value of the coded 0."""
        return 0.5 * (self.low + self.high)

    @property
    def half_range(self) -> float:
        """Natural length of one coded unit."""
        return 0.5 * (self.high - self.low)

    @property
    def label(self) -> str:
        """Name and unit for an axis or a table head; the unit 1 is not written."""
        return self.name if self.unit in ("", "1") else f"{self.name} [{self.unit}]"

    @property
    def levels_text(self) -> str:
        """Levels and unit, for a heading: ``150..170 degC``."""
        return f"{self.low:g}..{self.high:g}{'' if self.unit in ('', '1') else ' ' + self.unit}"

    def to_natural(self, coded: Values) -> Values:
        """Return natural values; -1 and +1 give ``low`` and ``high`` to the last bit."""
        return 0.5 * (self.low * (1.0 - coded) + self.high * (1.0 + coded))

    def to_coded(self, natural: Values) -> Values:
        """Return coded values of natural ones."""
        return (natural - self.center) / self.half_range


@dataclass(frozen=True)
class Category(Factor):
    """A factor whose levels are names: a variety, a supplier, an operator.

    Two levels are coded -1 and +1, as those of a number; more are numbered 0, 1, 2, ..., so that a polynomial
    rejects them and a formula (``doe.fit_formula``) takes their names.

    Parameters
    ----------
    levels : sequence of str
        Two or more, all different.
    """

    low: float = field(init=False, default=-1.0, repr=False)
    high: float = field(init=False, default=1.0, repr=False)
    unit: str = field(init=False, default="", repr=False)
    levels: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        levels = tuple(self.levels) if isinstance(self.levels, Iterable) else ()
        if isinstance(self.levels, str) or len(levels) < 2 or len(set(levels)) < len(levels):
            raise DesignError(f"category {self.name!r} must have two or more levels, got {self.levels!r}")
        object.__setattr__(self, "levels", levels)

    @property
    def codes(self) -> tuple[float, ...]:
        """Coded value of each level."""
        return (-1.0, 1.0) if len(self.levels) == 2 else tuple(float(k) for k in range(len(self.levels)))

    @property
    def levels_text(self) -> str:
        """The levels' names: ``{old, new}``."""
        return "{" + ", ".join(map(str, self.levels)) + "}"

    def to_natural(self, coded: Any) -> Any:
        """Return the levels' names of coded values; raise DesignError between the levels."""
        return self._translated(coded, dict(zip(self.codes, self.levels, strict=True)))

    def to_coded(self, natural: Any) -> Any:
        """Return the coded values of levels' names; raise DesignError for an unknown name."""
        return self._translated(natural, dict(zip(self.levels, self.codes, strict=True)))

    def _translated(self, values: Any, table: dict) -> Any:
        unknown = [value for value in np.ravel(values) if value not in table]
        if unknown:
            raise DesignError(f"category {self.name!r} must be one of {list(table)}, got {unknown[0]!r}")
        if hasattr(values, "map"):  # a column of a table
            return values.map(table)
        found = np.array([table[value] for value in np.ravel(values)])
        return found.reshape(np.shape(values)) if np.ndim(values) else found[0]


def numeric_factors(factors: Iterable[Factor], what: str) -> tuple[Factor, ...]:
    """Return the factors; raise DesignError when one is a category (no values between its levels)."""
    factors = checked_factors(factors)
    for factor in factors:
        if isinstance(factor, Category):
            raise DesignError(f"{what} needs factors that are numbers; {factor.name!r} is a category")
    return factors


def two_level_factors(factors: Iterable[Factor], what: str) -> tuple[Factor, ...]:
    """Return the factors; raise DesignError when one is a category of more than two levels."""
    factors = checked_factors(factors)
    for factor in factors:
        if isinstance(factor, Category) and len(factor.levels) > 2:
            raise DesignError(
                f"{what} has two levels a factor; category {factor.name!r} has {len(factor.levels)} "
                "(a formula takes them by name)"
            )
    return factors


def checked_factors(factors: Iterable[Factor]) -> tuple[Factor, ...]:
    """Return factors as a tuple; raise DesignError for an empty list, other values or a repeated name."""
    if not isinstance(factors, Iterable) or isinstance(factors, str | bytes):
        raise DesignError(f"factors must be a list of Factor or Category, got {factors!r}")
    factors = tuple(factors)
    for factor in factors:
        if not isinstance(factor, Factor | Category):
            raise DesignError(f"factors must be a list of Factor or Category, got {factor!r} in it")
    if not factors:
        raise DesignError("factors must be one or more, got an empty list")
    names = [factor.name for factor in factors]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise DesignError(f"factor names must differ, got twice: {', '.join(twice)}")
    return factors
