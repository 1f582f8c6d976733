"""Factors: parameters that a design varies, with the coding between natural units and -1..+1."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import pandas as pd

from doe.errors import DesignError

Values = TypeVar("Values", float, np.ndarray, pd.Series)

RESERVED_NAMES = frozenset({"intercept", "model", "residual", "lack of fit", "pure error", "total"})
"""Rows of the analysis tables: a factor of that name could not be told from them."""


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
        if not self.name or self.name != self.name.strip() or set(self.name) & set(":^"):
            raise DesignError(f"a factor's name is not empty, has no outer blanks, ':' or '^': {self.name!r}")
        if self.name in RESERVED_NAMES:
            raise DesignError(
                f"{self.name!r} names a row of the analysis tables: give the factor another name"
            )
        for place in ("low", "high"):
            if not math.isfinite(getattr(self, place)):
                raise DesignError(
                    f"factor {self.name!r}: {place} must be finite, received {getattr(self, place)}"
                )
        if not self.low < self.high:
            raise DesignError(
                f"factor {self.name!r}: low must be below high, received {self.low} and {self.high}"
            )

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

    def to_natural(self, coded: Values) -> Values:
        """Return natural values; -1 and +1 give ``low`` and ``high`` to the last bit."""
        return 0.5 * (self.low * (1.0 - coded) + self.high * (1.0 + coded))

    def to_coded(self, natural: Values) -> Values:
        """Return coded values of natural ones."""
        return (natural - self.center) / self.half_range


def checked_factors(factors: Iterable[Factor]) -> tuple[Factor, ...]:
    """Return the factors as a tuple; raise DesignError when empty or when a name comes twice."""
    factors = tuple(factors)
    if not factors:
        raise DesignError("a design needs at least one factor, received none")
    names = [factor.name for factor in factors]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise DesignError(f"factor names must differ, received twice: {', '.join(twice)}")
    return factors


def natural_points(factors: Iterable[Factor], coded: pd.DataFrame) -> pd.DataFrame:
    """Return the natural values of coded points: columns are the factors' names, same index."""
    return pd.DataFrame({f.name: f.to_natural(coded[f.name]) for f in factors}, index=coded.index)


def coded_points(factors: Iterable[Factor], natural: pd.DataFrame) -> pd.DataFrame:
    """Return the coded values of natural points: columns are the factors' names, same index."""
    return pd.DataFrame({f.name: f.to_coded(natural[f.name]) for f in factors}, index=natural.index)
