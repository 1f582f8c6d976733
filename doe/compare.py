"""Two means: t-tests, the interval of their difference, and equivalence within a margin (TOST)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from doe.errors import DesignError

METHODS = ("pooled", "welch", "one-sample")


@dataclass(frozen=True)
class Sample:
    """A sample by its summary: mean, standard deviation (n - 1 in its denominator), size."""

    mean: float
    sd: float
    n: int

    def __post_init__(self) -> None:
        if not math.isfinite(self.mean):
            raise DesignError(f"a sample's mean must be finite, received {self.mean}")
        if not (math.isfinite(self.sd) and self.sd >= 0.0):
            raise DesignError(f"a sample's sd must be finite and not negative, received {self.sd}")
        if self.n < 2 or int(self.n) != self.n:
            raise DesignError(f"a sample needs at least 2 values to have a spread, received n = {self.n}")

    @classmethod
    def of(cls, values: "Sample | Sequence[float] | NDArray") -> "Sample":
        """Return the summary of values (a Sample is returned as it is)."""
        if isinstance(values, Sample):
            return values
        numbers = np.asarray(values, dtype=np.float64)
        if numbers.ndim != 1 or numbers.size < 2:
            raise DesignError(f"a sample is at least 2 values in one row, received shape {numbers.shape}")
        bad = np.flatnonzero(~np.isfinite(numbers))
        if bad.size:
            raise DesignError(f"a sample's values must be finite: {numbers[bad[0]]} at position {bad[0] + 1}")
        return cls(float(numbers.mean()), float(numbers.std(ddof=1)), int(numbers.size))

    @property
    def df(self) -> int:
        """Degrees of freedom of the standard deviation."""
        return self.n - 1

    @property
    def se(self) -> float:
        """Standard error of the mean."""
        return self.sd / math.sqrt(self.n)


@dataclass(frozen=True)
class Comparison:
    """Difference of two means and what can be said of it; made by ``compare_means``."""

    a: Sample
    b: Sample | float
    method: str
    difference: float
    """Mean of a less mean of b."""
    se: float
    df: float
    alpha: float
    margin: float | None

    @property
    def t(self) -> float:
        """Difference over its standard error."""
        return self.difference / self.se

    @property
    def p(self) -> float:
        """Two-sided p value of no difference. A large one is no proof of equality: see ``equivalent``."""
        return float(2.0 * stats.t.sf(abs(self.t), self.df))

    @property
    def interval(self) -> tuple[float, float]:
        """Interval of the difference that holds with probability 1 - alpha."""
        reach = float(stats.t.isf(0.5 * self.alpha, self.df)) * self.se
        return self.difference - reach, self.difference + reach

    @property
    def different(self) -> bool:
        """Whether the difference is significant at alpha."""
        return self.p < self.alpha

    @property
    def equivalence_p(self) -> float | None:
        """p value of the two one-sided tests (Schuirmann 1987) that the difference exceeds the margin."""
        if self.margin is None:
            return None
        return float(stats.t.sf((self.margin - abs(self.difference)) / self.se, self.df))

    @property
    def equivalent(self) -> bool | None:
        """Whether the means are shown to differ by less than the margin, at alpha; None without a margin."""
        return None if self.equivalence_p is None else self.equivalence_p < self.alpha

    @property
    def smallest_margin(self) -> float:
        """Margin from which on these data show equivalence at alpha."""
        return abs(self.difference) + float(stats.t.isf(self.alpha, self.df)) * self.se


def compare_means(
    a: Sample | Sequence[float] | NDArray,
    b: Sample | Sequence[float] | NDArray | float,
    margin: float | None = None,
    method: str = "pooled",
    alpha: float = 0.05,
) -> Comparison:
    """Compare the means of two samples.

    Parameters
    ----------
    a, b : values, or Sample(mean, sd, n)
        With ``method="one-sample"`` b may be a plain number.
    margin : float, optional
        Difference that does not matter: asks for the equivalence test (TOST).
    method : {"pooled", "welch", "one-sample"}
        Student's t with one variance for both; Welch's with two; a against the mean of b taken as known.
    alpha : float
        Level of the tests; 1 - alpha that of the interval.

    Raises
    ------
    DesignError
        Fewer than two values, values that are not finite, no spread at all, a margin that is not positive.
    """
    if method not in METHODS:
        raise DesignError(f"method is one of {', '.join(METHODS)}, received {method!r}")
    if margin is not None and not margin > 0.0:
        raise DesignError(f"an equivalence margin must be positive, received {margin}")
    if not 0.0 < alpha < 1.0:
        raise DesignError(f"alpha lies between 0 and 1, received {alpha}")
    first = Sample.of(a)
    if not isinstance(b, float | int):
        b = Sample.of(b)
    elif method != "one-sample":
        raise DesignError(f"a plain number has no spread: give a sample or method='one-sample', received {b}")
    se, df = _difference_error(first, b, method)
    if not se > 0.0:
        raise DesignError("no test without spread: every value of the samples is the same")
    known = b.mean if isinstance(b, Sample) else float(b)
    return Comparison(first, b, method, first.mean - known, se, df, alpha, margin)


def _difference_error(a: Sample, b: Sample | float, method: str) -> tuple[float, float]:
    """Return the standard error of the difference and its degrees of freedom."""
    if method == "one-sample" or not isinstance(b, Sample):
        return a.se, float(a.df)
    if method == "pooled":
        df = a.df + b.df
        variance = (a.df * a.sd**2 + b.df * b.sd**2) / df
        return math.sqrt(variance * (1.0 / a.n + 1.0 / b.n)), float(df)
    variance = a.se**2 + b.se**2
    spread = a.se**4 / a.df + b.se**4 / b.df
    return math.sqrt(variance), variance**2 / spread if spread > 0.0 else float(a.df + b.df)
