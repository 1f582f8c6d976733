"""Samples by their summary: mean, standard deviation, size."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from doe.arguments import checked_count, checked_number, real_array
from doe.errors import DesignError

if TYPE_CHECKING:
    import pandas as pd

Values: TypeAlias = "Sequence[float] | NDArray | pd.Series"


@dataclass(frozen=True)
class Sample:
    """A sample by its summary: mean, standard deviation (n - 1 in its denominator), size."""

    mean: float
    sd: float
    n: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "mean", checked_number("a sample's mean", self.mean))
        object.__setattr__(self, "sd", checked_number("a sample's sd", self.sd, least=0.0))
        count = checked_count("n, the size of a sample, which needs 2 values to have a spread,", self.n, 2)
        object.__setattr__(self, "n", count)

    @classmethod
    def of(cls, values: Sample | Values) -> Sample:
        """Return the summary of values (a Sample is returned as it is)."""
        if isinstance(values, Sample):
            return values
        numbers = real_array("a sample", values)
        if numbers.ndim != 1 or numbers.size < 2:
            raise DesignError(f"a sample must be at least 2 values in one row, got shape {numbers.shape}")
        bad = np.flatnonzero(~np.isfinite(numbers))
        if bad.size:
            raise DesignError(f"a sample's values must be finite: {numbers[bad[0]]} at position {bad[0] + 1}")
        return cls(float(numbers.mean()), float(numbers.std(ddof=1)), int(numbers.size))

    @property
    def df(self) -> float:
        """Degrees of freedom of the standard deviation."""
        return self.n - 1

    @property
    def se(self) -> float:
        """Standard error of the mean."""
        return self.sd / math.sqrt(self.n)


@dataclass(frozen=True)
class StatedValue(Sample):
    """A single value whose standard deviation is stated, not estimated from a scatter: it counts as known."""

    n: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "mean", checked_number("a stated value", self.mean))
        object.__setattr__(self, "sd", checked_number("a stated value's sd", self.sd, least=0.0))
        if self.n != 1:
            raise DesignError(f"n of a stated value must be 1, got {self.n!r}")

    @property
    def df(self) -> float:
        """Degrees of freedom of the standard deviation: infinite."""
        return math.inf
