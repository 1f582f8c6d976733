"""A difference with two independent errors whose variances are both estimated (Behrens and Fisher's problem).

D is normal with the variance v1 + v2, and s1^2, s2^2 estimate v1, v2 on their own degrees of freedom. Welch's
approximation refers D / sqrt(s1^2 + s2^2) to Student's t (Biometrika 34, 1947, p. 28). With few degrees of
freedom it finds differences too often: a level of .05 becomes .12 with 1 and 12. Banerjee's rule D^2 <= t1^2
s1^2 + t2^2 s2^2 holds for any ratio of the variances (Sankhya A 23, 1961, p. 359), conservatively where both
matter: .01 for .05. No rule that is continuous in the data holds its level exactly for all ratios (Linnik,
Statistical Problems with Nuisance Parameters, 1968).

The rule here is |D| <= ((t1 s1)^(1/q) + (t2 s2)^(1/q))^q with both t at the level k alpha: Banerjee's for q =
1/2 and k = 1, the larger of t1 s1 and t2 s2 for q = 0. The k nearest to 1 is taken with a q whose level
deviates from alpha by at most an eighth over all ratios of the variances; else the least deviation that is
nowhere above 1.15 alpha. The level is an integral over one beta variable, computed here by quadrature. With 7
degrees of freedom for the one error the coverage for .95 is .943 to .976 with 1 for the other, .945 to .957
with 2, .947 to .953 with 3 and more. Where an error is zero, the other one alone counts: Student's t.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, special, stats

from doe.arguments import checked_level

MOST = 1.15
"""Largest level over alpha: the coverage for .95 is nowhere below .9425."""

STRAY = 0.125
"""Deviation of a level from alpha that ends the search: .944 to .956 for .95."""

LEVELS = (1e-6, 1e-4, 1e-3, 0.003, 0.05 / 6, 0.0125, 0.05 / 3, 0.025, 0.05, 0.1, 0.2, 0.5, 1.0)
"""Levels for which a rule is searched, with .05 shared by 1 to 6; interpolated in the log."""

SCALES, BENDS = (1.0, 0.95, 1.05, 0.9, 1.1, MOST), np.linspace(0.0, 0.5, 21)
"""Values of k, the nearest to 1 first, and of q among which a rule is searched."""

MANY = 200.0
"""Degrees of freedom above which the rule no longer changes."""

RATIOS, NODES = 33, 64
"""Number of ratios of the variances that are tried, and of points of the quadrature."""

CELLS = 512
SHARES = np.sin(np.linspace(0.0, 0.5 * np.pi, CELLS + 1)) ** 2
"""Shares of the second error between which critical values are interpolated: to 1e-5 of themselves."""


@dataclass(frozen=True)
class TwoErrors:
    """Critical and p values of a difference, by the degrees of freedom of its errors (infinite: known)."""

    first_df: float
    second_df: float

    def critical(self, share: ArrayLike, alpha: float) -> NDArray[np.float64]:
        """Return the size above which difference / error is significant at a two-sided level.

        ``share`` is s2^2 / (s1^2 + s2^2), the second error's share of the estimated variance.
        """
        return np.interp(np.asarray(share, np.float64), SHARES, self.table(checked_level(alpha)))

    def table(self, alpha: float) -> NDArray[np.float64]:
        """Return the critical values at `SHARES` (see ``located``)."""
        return _table(self.first_df, self.second_df, alpha)

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
            level = float(np.exp(log_level))
            found = _half_width(self.first_df, self.second_df, np.array(share), level, *self.rule(level))
            return float(np.log(found) - np.log(size))

        lowest, highest = np.log(1e-100), np.log(0.9999)
        if excess(lowest) <= 0.0 or excess(highest) >= 0.0:
            return 0.0 if excess(lowest) <= 0.0 else 1.0
        return float(np.exp(optimize.brentq(excess, lowest, highest, xtol=1e-10)))

    def rule(self, alpha: float) -> tuple[float, float]:
        """Return k and q (see the module) at a level."""
        return _rule(min(self.first_df, MANY), min(self.second_df, MANY), alpha)


def located(share: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return the positions of shares among `SHARES`: the index below, and the fraction to the next."""
    place = np.arcsin(np.sqrt(share)) * (CELLS / (0.5 * np.pi))
    lower = np.clip(place.astype(np.intp), 0, CELLS - 1)
    return lower, place - lower


@cache
def _table(first_df: float, second_df: float, alpha: float) -> NDArray[np.float64]:
    rule = TwoErrors(first_df, second_df).rule(alpha)
    return _half_width(first_df, second_df, SHARES, alpha, *rule)


def _half_width(
    first_df: float, second_df: float, share: NDArray[np.float64], alpha: float, scale: float, bend: float
) -> NDArray[np.float64]:
    """Return the largest accepted difference over its error, by the rule of k and q."""
    shared = np.where((share > 0.0) & (share < 1.0), scale, 1.0) * alpha
    first, second = stats.t.isf(0.5 * shared, first_df), stats.t.isf(0.5 * shared, second_df)
    one, other = np.sqrt(1.0 - share) * first, np.sqrt(share) * second
    larger, smaller = np.maximum(one, other), np.minimum(one, other)
    if bend < 1e-3:
        return np.asarray(larger)
    return np.asarray(larger * (1.0 + (smaller / larger) ** (1.0 / bend)) ** bend)


def _rule(first_df: float, second_df: float, alpha: float) -> tuple[float, float]:
    """Return k and q at a level, interpolated between those of `LEVELS` around it."""
    place = int(np.clip(np.searchsorted(LEVELS, alpha), 1, len(LEVELS) - 1))
    below, above = LEVELS[place - 1], LEVELS[place]
    weight = float(np.clip(np.log(alpha / below) / np.log(above / below), 0.0, 1.0))
    rules = np.array([_best_rule(first_df, second_df, level) for level in (below, above)])
    scale, bend = (1.0 - weight) * rules[0] + weight * rules[1]
    return float(scale), float(bend)


@cache
def _best_rule(first_df: float, second_df: float, alpha: float) -> tuple[float, float]:
    """Return k and q (see the module), by bisection in q."""
    best, least = (1.0, 0.5), np.inf
    for scale in SCALES if alpha < 1.0 else ():
        # a larger q widens the band: the best one deviates as much upwards as downwards
        low, high = 0, len(BENDS) - 1
        while low <= high:
            middle = (low + high) // 2
            level = false_alarms(first_df, second_df, alpha, scale, float(BENDS[middle])) / alpha
            above, below = float(level.max()) - 1.0, 1.0 - float(level.min())
            if above <= MOST - 1.0 + 1e-9 and max(above, below) < least:
                best, least = (scale, float(BENDS[middle])), max(above, below)
            low, high = (low, middle - 1) if above <= below else (middle + 1, high)
        if least <= STRAY:
            break
    return best


def false_alarms(
    first_df: float, second_df: float, alpha: float, scale: float, bend: float
) -> NDArray[np.float64]:
    """Return the probability of a false alarm at `RATIOS` shares of the second variance from 0 to 1.

    Given the share b of the second in the sum of the two chi-squares, which is Beta(df2 / 2, df1 / 2), the
    sum is independent of b and D over its root is Student's t on df1 + df2: the tail is known, and its mean
    over b is a Gauss-Jacobi quadrature.
    """
    first, second, weights = _quadrature(first_df, second_df)
    critical = _half_width(first_df, second_df, second / (first + second), alpha, scale, bend)
    df = first_df + second_df
    tails = 2.0 * special.stdtr(df, -critical * np.sqrt(df * (first + second)))
    return np.asarray(tails @ weights)


@cache
def _quadrature(first_df: float, second_df: float) -> tuple[NDArray[np.float64], ...]:
    """Return both estimated variances over the sum of the chi-squares at the nodes, and the weights."""
    true_share = np.sin(np.linspace(0.0, 0.5 * np.pi, RATIOS))[:, None] ** 2
    nodes, weights = special.roots_jacobi(NODES, 0.5 * first_df - 1.0, 0.5 * second_df - 1.0)
    part = 0.5 * (1.0 + nodes)
    first, second = (1.0 - true_share) * (1.0 - part) / first_df, true_share * part / second_df
    return first, second, weights / weights.sum()
