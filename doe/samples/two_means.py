"""Two means: t-tests, the interval of their difference, and equivalence within a margin (TOST)."""

from __future__ import annotations

import math
import numbers
from dataclasses import dataclass

import numpy as np
from scipy import stats

from doe.arguments import checked_choice, checked_level, checked_number
from doe.errors import DesignError
from doe.samples.sample import Sample, Values
from doe.samples.two_errors import TwoErrors

METHODS = ("welch", "pooled", "guarded", "one-sample")


@dataclass(frozen=True)
class Comparison:
    """Difference of two means with its tests; made by ``compare_means``."""

    a: Sample
    b: Sample | float
    method: str
    difference: float
    """Mean of a less mean of b."""
    se: float
    df: float
    alpha: float
    margin: float | None
    equivalence_alpha: float
    """Level of the two one-sided tests."""

    @property
    def t(self) -> float:
        """Difference over its standard error."""
        return self.difference / self.se

    @property
    def p(self) -> float:
        """Two-sided p value of no difference. A large one does not show equality: see ``equivalent``."""
        return self._tails(self.t)

    @property
    def interval(self) -> tuple[float, float]:
        """Interval of the difference that holds with probability 1 - alpha."""
        reach = self._critical(self.alpha) * self.se
        return self.difference - reach, self.difference + reach

    @property
    def different(self) -> bool:
        """True if the difference is significant at alpha."""
        return self.p < self.alpha

    @property
    def equivalence_p(self) -> float | None:
        """P value of the two one-sided tests (Schuirmann 1987) that the difference exceeds the margin."""
        if self.margin is None:
            return None
        t = (self.margin - abs(self.difference)) / self.se
        return 0.5 * self._tails(t) if t >= 0.0 else 1.0 - 0.5 * self._tails(t)

    @property
    def equivalent(self) -> bool | None:
        """True if the means are shown to differ by less than the margin; None without a margin."""
        return None if self.equivalence_p is None else self.equivalence_p < self.equivalence_alpha

    @property
    def smallest_margin(self) -> float:
        """Smallest margin for which these data show equivalence."""
        return abs(self.difference) + self._critical(2.0 * self.equivalence_alpha) * self.se

    @property
    def _guard(self) -> tuple[TwoErrors, float] | None:
        """Rule of the guarded method and the second sample's share of the variance; None for others."""
        if self.method != "guarded" or not isinstance(self.b, Sample):
            return None
        return TwoErrors(float(self.a.df), float(self.b.df)), (self.b.se / self.se) ** 2

    def _critical(self, alpha: float) -> float:
        """Return the two-sided critical value of t."""
        if self._guard is None:
            return float(stats.t.isf(0.5 * alpha, self.df))
        errors, share = self._guard
        return float(errors.critical(share, alpha))

    def _tails(self, t: float) -> float:
        """Return the two-sided p value of a t."""
        if self._guard is None:
            return float(2.0 * stats.t.sf(abs(t), self.df))
        errors, share = self._guard
        return errors.p(t, share)


def compare_means(
    a: Sample | Values,
    b: Sample | Values | float,
    margin: float | None = None,
    method: str = "welch",
    alpha: float = 0.05,
    equivalence_alpha: float | None = None,
) -> Comparison:
    """Compare the means of two samples.

    Parameters
    ----------
    a, b : values, or Sample(mean, sd, n)
        Two samples; with ``method="one-sample"`` b is a plain number.
    margin : float, optional
        Difference that does not matter, for the equivalence test (TOST).
    method : {"welch", "pooled", "guarded", "one-sample"}
        Welch's t with two variances; Student's t with one variance for both, whose level is wrong where they
        differ (a test of equivalence at .05 may have .15 with 4 and 12 values); the rule of
        ``doe.samples.two_errors``, whose level holds for few values too (at most .0575 for .05, where Welch's
        becomes .12 with 2 and 12); a against the number b.
    alpha : float
        Level of the tests; 1 - alpha is that of the interval. With a margin below .5.
    equivalence_alpha : float, optional
        Level of the test of equivalence, below .5. Default: alpha. Several comparisons that *all* must show
        equivalence need no smaller one: together they hold it (Berger, *Technometrics* 24 (1982) 295).

    Raises
    ------
    DesignError
        Fewer than two values, values that are not finite, no spread, a margin that is not positive, a sample
        in place of a number or a number in place of a sample.
    """
    checked_choice("method", method, METHODS)
    if margin is not None:
        margin = checked_number("an equivalence margin", margin)
        if not margin > 0.0:
            raise DesignError(f"an equivalence margin must be positive, got {margin:g}")
    level = checked_level(alpha)
    equivalence_alpha = level if equivalence_alpha is None else checked_level(equivalence_alpha)
    if equivalence_alpha >= 0.5 and margin is not None:
        raise DesignError(f"alpha of a test of equivalence must be below 0.5, got {equivalence_alpha}")
    first = Sample.of(a)
    if method == "one-sample":
        if isinstance(b, Sample) or np.ndim(b) > 0:
            raise DesignError(
                "method='one-sample' compares with a known number, and a sample has an error of its own: "
                f"give its mean where that error is to be ignored, or choose another method, got {b!r}"
            )
        second: Sample | float = checked_number("the number to compare with", b)
    elif isinstance(b, numbers.Real):
        raise DesignError(f"a plain number has no spread: give a sample or method='one-sample', got {b}")
    else:
        second = Sample.of(b)
    se, df = _difference_error(first, second, method)
    if not se > 0.0:
        raise DesignError("no test without spread: every value of the samples is the same")
    known = second.mean if isinstance(second, Sample) else second
    difference = first.mean - known
    return Comparison(first, second, method, difference, se, df, level, margin, equivalence_alpha)


def _difference_error(a: Sample, b: Sample | float, method: str) -> tuple[float, float]:
    """Return the standard error of the difference and its degrees of freedom."""
    if not isinstance(b, Sample):
        return a.se, float(a.df)
    if method == "pooled":
        df = a.df + b.df
        variance = (a.df * a.sd**2 + b.df * b.sd**2) / df
        return math.sqrt(variance * (1.0 / a.n + 1.0 / b.n)), float(df)
    variance = a.se**2 + b.se**2
    spread = a.se**4 / a.df + b.se**4 / b.df
    return math.sqrt(variance), variance**2 / spread if spread > 0.0 else float(a.df + b.df)
