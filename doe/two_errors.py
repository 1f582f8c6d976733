"""A difference with two independent errors whose variances are both estimated (Behrens and Fisher's problem).

D is normal with the variance v1 + v2, and s1^2, s2^2 estimate v1, v2 on their own degrees of freedom. Welch's
approximation refers D / sqrt(s1^2 + s2^2) to Student's t (Biometrika 34, 1947, p. 28). With few degrees of
freedom it finds differences too often: a level of .05 becomes .12 with 1 and 12, and small levels, as those
shared among several tests, are missed by far more. Banerjee's rule D^2 <= t1^2 s1^2 + t2^2 s2^2 holds for any
ratio of the variances (Sankhya A 23, 1961, p. 359), with some to spare where both matter. No rule that is
continuous in the data holds its level exactly for all ratios (Linnik 1968), and of those that nearly do
with 1 or 2 degrees of freedom, the critical value swings up and down without sense.

So the critical value here lies between the two: Welch's to the power 1 - w times Banerjee's to the power w,
with the smallest w whose largest probability of a false alarm, over all ratios of the variances, is at most
1.08 times the level. That probability is an integral over one beta variable, computed here by quadrature.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, special, stats

from doe.checks import checked_level

SLACK = 1.08
"""Largest false alarms over the level: .054 for .05."""

LEVELS = np.array([1e-6, 1e-4, 1e-3, 0.003, 0.05 / 6, 0.0125, 0.05 / 3, 0.025, 0.05, 0.1, 0.2, 0.5])
"""Levels at which the weight is solved for, among them .05 shared by 1 to 6; interpolated in the log."""

MANY = 200.0
"""More degrees of freedom than these change the weight no more."""

RATIOS, NODES = 33, 96
"""Ratios of the variances that are tried, and points of the quadrature."""

SHARES = np.sin(np.linspace(0.0, 0.5 * np.pi, 513)) ** 2
"""Shares of the second error between which critical values are interpolated: to 1e-5 of themselves."""


@dataclass(frozen=True)
class TwoErrors:
    """Critical values and p values of a difference with two errors.

    Parameters
    ----------
    first_df, second_df : float
        Degrees of freedom of the two variances; infinite where one is known.
    """

    first_df: float
    second_df: float

    def critical(self, share: ArrayLike, alpha: float) -> NDArray[np.float64]:
        """Return the size above which difference / error is significant at a two-sided level.

        Parameters
        ----------
        share : array-like
            s2^2 / (s1^2 + s2^2), the second error's share of the estimated variance.
        alpha : float
        """
        return np.interp(np.asarray(share, np.float64), SHARES, self._table(checked_level(alpha)))

    def df(self, share: ArrayLike) -> NDArray[np.float64]:
        """Return the degrees of freedom of both errors together (Welch and Satterthwaite)."""
        part = np.asarray(share, np.float64)
        spread = (1.0 - part) ** 2 / self.first_df + part**2 / self.second_df
        return 1.0 / np.maximum(spread, np.finfo(float).tiny)

    def p(self, t: float, share: float) -> float:
        """Return the two-sided p value of a difference over its error: the level at which it is critical."""
        size = abs(float(t))
        if not size > 0.0:
            return 1.0

        def excess(log_level: float) -> float:
            return float(np.log(self._critical(np.array(share), float(np.exp(log_level)))) - np.log(size))

        lowest, highest = np.log(1e-100), np.log(0.9999)
        if excess(lowest) <= 0.0 or excess(highest) >= 0.0:
            return 0.0 if excess(lowest) <= 0.0 else 1.0
        return float(np.exp(optimize.brentq(excess, lowest, highest, xtol=1e-10)))

    def worst_level(self, alpha: float) -> float:
        """Return the largest probability of a false alarm at a level, over all ratios of the variances."""
        first, second = min(self.first_df, MANY), min(self.second_df, MANY)
        return float(false_alarms(first, second, alpha, self._weight(alpha)).max())

    def _weight(self, alpha: float) -> float:
        weights = _weights(min(self.first_df, MANY), min(self.second_df, MANY))
        return float(np.interp(np.log(alpha), np.log(LEVELS), weights))

    def _table(self, alpha: float) -> NDArray[np.float64]:
        return _table(self.first_df, self.second_df, alpha)

    def _critical(self, share: NDArray[np.float64], alpha: float) -> NDArray[np.float64]:
        return _between(self.first_df, self.second_df, share, alpha, self._weight(alpha))


@cache
def _table(first_df: float, second_df: float, alpha: float) -> NDArray[np.float64]:
    """Return the critical values at `SHARES`."""
    return TwoErrors(first_df, second_df)._critical(SHARES, alpha)


def _between(
    first_df: float, second_df: float, share: NDArray[np.float64], alpha: float, weight: float
) -> NDArray[np.float64]:
    """Return critical values between Welch's (weight 0) and Banerjee's (weight 1)."""
    spread = (1.0 - share) ** 2 / first_df + share**2 / second_df
    welch = stats.t.isf(0.5 * alpha, 1.0 / np.maximum(spread, np.finfo(float).tiny))
    first, second = stats.t.isf(0.5 * alpha, np.array([first_df, second_df]))
    banerjee = np.hypot(np.sqrt(1.0 - share) * first, np.sqrt(share) * second)
    return np.asarray(welch ** (1.0 - weight) * banerjee**weight)


@cache
def _weights(first_df: float, second_df: float) -> tuple[float, ...]:
    """Return the weight at each of `LEVELS`."""
    return tuple(_weight(first_df, second_df, float(alpha)) for alpha in LEVELS)


def _weight(first_df: float, second_df: float, alpha: float) -> float:
    """Return the smallest weight that keeps the false alarms at `SLACK` times the level."""

    def excess(weight: float) -> float:
        return float(false_alarms(first_df, second_df, alpha, weight).max()) / (SLACK * alpha) - 1.0

    if excess(0.0) <= 0.0:
        return 0.0
    return 1.0 if excess(1.0) >= 0.0 else float(optimize.brentq(excess, 0.0, 1.0, xtol=1e-3))


def false_alarms(first_df: float, second_df: float, alpha: float, weight: float) -> NDArray[np.float64]:
    """Return the probability of a false alarm at `RATIOS` shares of the second variance from 0 to 1.

    Given the share b of the second in the sum of the two chi-squares, which is Beta(df2 / 2, df1 / 2), the
    sum is independent of b and D over its root is Student's t on df1 + df2: the tail is known, and its mean
    over b is a Gauss-Jacobi quadrature.
    """
    true_share = np.sin(np.linspace(0.0, 0.5 * np.pi, RATIOS))[:, None] ** 2
    nodes, weights = special.roots_jacobi(NODES, 0.5 * first_df - 1.0, 0.5 * second_df - 1.0)
    part = 0.5 * (1.0 + nodes)
    first, second = (1.0 - true_share) * (1.0 - part) / first_df, true_share * part / second_df
    critical = _between(first_df, second_df, second / (first + second), alpha, weight)
    df = first_df + second_df
    tails = 2.0 * stats.t.sf(critical * np.sqrt(df * (first + second)), df)
    return np.asarray(tails @ (weights / weights.sum()))
