"""Agreement of two sets of numbers for the same runs, with the noise of both removed."""

import math
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, stats

from doe.arguments import checked_level, checked_number, real_array
from doe.design.labels import same_labels
from doe.errors import DesignError

FloatArray = NDArray[np.float64]

DRAWS = 4_000
"""Drawn pairs behind the ceiling of the rank correlation: an end of its interval is known to 3 % of it."""

MANY_NOISES = 1e4
"""Mean square over the noise variance above which the noise is subtracted."""

CORRELATIONS = np.tanh(np.linspace(-4.0, 4.0, 65))
"""Correlations of normal pairs among which the interval of a rank correlation is found."""

SEED = 1
"""Seed of the draws: equal numbers give equal ceilings."""


@dataclass(frozen=True)
class Estimate:
    """A number and its interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Agreement:
    """Agreement of values with reference values, run by run; made by ``agreement``.

    The intervals hold for runs that are drawn from many others, each with its misfit (the true value less the
    true reference) and its noise, all of them normal.
    """

    response: FloatArray
    reference: FloatArray
    value_variance: FloatArray
    """Noise variance of each value: that of one replicate over the replicates averaged."""
    reference_variance: float
    """Variance of one reference value by noise."""
    settings: NDArray[np.int_]
    """Number of each run's setting: runs of one setting have one true value."""
    strata: NDArray[np.int_]
    confidence: float

    @property
    def runs(self) -> int:
        """Number of runs."""
        return len(self.response)

    @cached_property
    def rmse(self) -> Estimate:
        """Root mean square of the differences, the noise of both included.

        Over its expectation the sum of squares is chi-square with as many degrees of freedom as runs: the
        interval holds its level where the misfits scatter about zero, and at least that where they share a
        bias.
        """
        return self._misfit(0.0)

    @cached_property
    def rmse_without_noise(self) -> Estimate:
        """Root mean square of the differences of these runs without the noise of either side.

        The root of the mean square less the noise variances is too small: .85 of a misfit as large as the
        noise at 10 runs. The sum of squares over the noise variance is noncentral chi-square, and the
        estimate is the misfit whose median it is. The interval is that of ``rmse``, squared, less the noise
        variances; both are at least 0.
        """
        return self._misfit(float(self.value_variance.mean()) + self.reference_variance)

    @cached_property
    def bias(self) -> Estimate:
        """Mean difference, values less reference, with Student's interval by the spread within the strata."""
        difference = self._difference
        value, count = float(difference.mean()), len(np.unique(self.strata))
        df = self.runs - count
        if df < 1:
            return Estimate(value, -math.inf, math.inf)
        means = np.bincount(self.strata, difference) / np.bincount(self.strata)
        spread = float(((difference - means[self.strata]) ** 2).sum()) / df
        return self._student(value, math.sqrt(spread / self.runs), df)

    @cached_property
    def slope(self) -> Estimate:
        """Change of the values per change of the true reference.

        The least-squares slope over the reliability of the reference, (s^2 - noise variance) / s^2 with s^2
        the variance of the reference (Fuller, Measurement Error Models, 1987, section 1.1): noise of the
        reference flattens a plain slope. NaN where the reference varies no more than its noise. The interval
        holds the slopes b for which the sum of products less b times the true spread is within t standard
        errors of zero, with the plain error's square plus 2 (n - 1) (noise variance)^2 b^2; infinite where
        the data do not bound the slope.
        """
        return self._slope()

    @cached_property
    def spearman(self) -> Estimate:
        """Rank correlation with noise.

        The interval holds the rank correlations of normal pairs for which neither such a high nor such a low
        one is rarer than half of what the level leaves, from drawn pairs; with few runs it is conservative.
        """
        value = float(_spearman(self.response, self.reference))
        if not math.isfinite(value):
            return Estimate(value, math.nan, math.nan)
        return Estimate(value, *_rank_interval(value, self.runs, self._tail))

    @cached_property
    def spearman_ceiling(self) -> Estimate:
        """Rank correlation of a perfect model through the noise of both sides: mean and interval.

        The true values are the reference's means by setting, shrunk so that their spread is that of the
        reference less its noise; noise of both sides is then added to them repeatedly.
        """
        truth, rng = self._truth(), np.random.default_rng(SEED)
        shape = (DRAWS, self.runs)
        values = truth + np.sqrt(self.value_variance) * rng.standard_normal(shape)
        reference = truth + np.sqrt(self.reference_variance) * rng.standard_normal(shape)
        seen = _spearman(values, reference)
        known = seen[np.isfinite(seen)]
        if len(known) < 0.5 * len(seen):
            return Estimate(math.nan, math.nan, math.nan)
        low, high = np.quantile(known, [self._tail, 1.0 - self._tail])
        return Estimate(float(known.mean()), float(low), float(high))

    @cached_property
    def _difference(self) -> FloatArray:
        return self.response - self.reference

    @property
    def _tail(self) -> float:
        return 0.5 * (1.0 - self.confidence)

    def _misfit(self, noise: float) -> Estimate:
        """Return the root mean square difference without a noise variance."""
        total = float((self._difference**2).sum())
        low, high = total / stats.chi2.isf([self._tail, 1.0 - self._tail], self.runs) - noise
        value = _median_misfit(total, noise, self.runs)
        return Estimate(value, math.sqrt(max(low, 0.0)), math.sqrt(max(high, 0.0)))

    def _slope(self) -> Estimate:
        values, reference = _centred(self.response), _centred(self.reference)
        noise = (self.runs - 1) * self.reference_variance
        spread, products = float(reference @ reference), float(values @ reference)
        true_spread = spread - noise
        if not true_spread > 0.0:
            return Estimate(math.nan, math.nan, math.nan)
        slope, df = products / true_spread, self.runs - 2
        left = max(float(values @ values) - products**2 / spread, 0.0) / df
        t = float(stats.t.isf(self._tail, df))
        # (products - b true_spread)^2 <= t^2 (spread left + 2 noise variance noise b^2), a quadratic in b.
        a = true_spread**2 - 2.0 * t**2 * self.reference_variance * noise
        if not a > 0.0:
            return Estimate(slope, -math.inf, math.inf)
        middle = products * true_spread / a
        reach = math.sqrt(max(middle**2 - (products**2 - t**2 * spread * left) / a, 0.0))
        return Estimate(slope, min(middle - reach, slope), max(middle + reach, slope))

    def _student(self, value: float, error: float, df: int) -> Estimate:
        reach = float(stats.t.isf(self._tail, df)) * error
        return Estimate(value, value - reach, value + reach)

    def _truth(self) -> FloatArray:
        count = np.bincount(self.settings)
        means = (np.bincount(self.settings, self.reference) / np.maximum(count, 1))[self.settings]
        noise = float((self.reference_variance / count[self.settings]).mean())
        spread = float(means.var(ddof=1))
        share = max(1.0 - noise / spread, 0.0) if spread > 0.0 else 0.0
        return means.mean() + np.sqrt(share) * (means - means.mean())


def agreement(
    values: ArrayLike,
    reference: ArrayLike,
    value_variance: ArrayLike = 0.0,
    reference_variance: float = 0.0,
    settings: ArrayLike | None = None,
    strata: ArrayLike | None = None,
    confidence: float = 0.95,
) -> Agreement:
    """Compare values with reference values of the same runs.

    Parameters
    ----------
    values, reference : array-like, shape (runs,)
        Series are matched by their labels, others by position; so are the arguments below.
    value_variance : float or array-like, shape (runs,)
        Noise variance of each value; for a mean of n replicates that of one, over n.
    reference_variance : float
        Noise variance of one reference value.
    settings : array-like, shape (runs,), optional
        Labels: runs of one setting have one true value. Default: every run has a setting of its own.
    strata : array-like, shape (runs,), optional
        Labels, such as the table of a run: the interval of the bias takes the spread within each.

    Raises
    ------
    DesignError
        Fewer than 3 runs, arrays of different lengths, labels that differ, numbers that are not finite,
        negative variances.
    """
    names = ("values", "reference", "value_variance", "settings", "strata")
    values, reference, value_variance, settings, strata = same_labels(
        names, (values, reference, value_variance, settings, strata)
    )
    first, second = real_array("values", values), real_array("reference", reference)
    if first.ndim != 1 or first.shape != second.shape or len(first) < 3:
        raise DesignError(
            f"values and reference must be of the same 3 or more runs, got shapes {first.shape} and "
            f"{second.shape}"
        )
    if not (np.isfinite(first).all() and np.isfinite(second).all()):
        raise DesignError("values and reference must be finite: leave out the runs that lack one")
    own = real_array("value_variance", value_variance)
    if own.shape not in ((), (1,), first.shape):
        raise DesignError(f"value_variance must be one number or one per run, got shape {own.shape}")
    variance = np.broadcast_to(own, first.shape)
    if not ((variance >= 0.0) & np.isfinite(variance)).all():
        raise DesignError(f"noise variances must be 0 or more, got {value_variance!r}")
    noise = checked_number(
        "reference_variance: noise variances must be 0 or more: it", reference_variance, least=0.0
    )
    checked_level(confidence, "confidence")
    runs = len(first)
    return Agreement(
        first,
        second,
        variance,
        noise,
        np.arange(runs) if settings is None else _numbers(settings, runs, "settings"),
        np.zeros(runs, int) if strata is None else _numbers(strata, runs, "strata"),
        float(confidence),
    )


def _numbers(labels: ArrayLike, runs: int, name: str) -> NDArray[np.int_]:
    """Return the number of every label's kind."""
    given = np.asarray(labels, dtype=object)
    if given.shape != (runs,):
        raise DesignError(f"{name} must be a label for each of {runs} runs, got shape {given.shape}")
    if pd.isna(given).any():
        raise DesignError(
            f"{name} must be a label for each run: that of run {int(pd.isna(given).argmax()) + 1} is missing"
        )
    return pd.factorize(given)[0]


def _median_misfit(total: float, noise: float, runs: int) -> float:
    """Return the root mean square misfit for which a sum of squares is the median."""
    if not noise > 0.0:
        return math.sqrt(total / runs)
    found = total / noise
    if found <= stats.chi2.ppf(0.5, runs):
        return 0.0
    if found > MANY_NOISES * runs:  # the median's excess over the mean is then beyond rounding
        return math.sqrt(total / runs - noise)
    shift = optimize.brentq(lambda size: stats.ncx2.cdf(found, runs, size) - 0.5, 1e-12, found, xtol=1e-9)
    return math.sqrt(float(shift) * noise / runs)


def _rank_interval(value: float, runs: int, tail: float) -> tuple[float, float]:
    """Return the rank correlations of populations that do not contradict the one found."""
    drawn = _rank_correlations(runs)
    rounding = 1e-9
    above = np.array([1.0 - np.searchsorted(row, value - rounding) / row.size for row in drawn])
    below = np.array([np.searchsorted(row, value + rounding, side="right") / row.size for row in drawn])
    ranks = 6.0 / math.pi * np.arcsin(0.5 * CORRELATIONS)
    # both are monotonic in the correlation but for the draws; their ends are those of +-1
    low = -1.0 if above[0] > tail else float(np.interp(tail, np.maximum.accumulate(above), ranks))
    high = 1.0 if below[-1] > tail else float(np.interp(-tail, np.maximum.accumulate(-below), ranks))
    return min(low, value), max(high, value)


@cache
def _rank_correlations(runs: int) -> list[FloatArray]:
    """Return drawn rank correlations of normal pairs of each of `CORRELATIONS`, ascending."""
    first, second = np.random.default_rng(SEED).standard_normal(
        (2, max(200, min(DRAWS, 400_000 // runs)), runs)
    )
    ranks = _centred(first.argsort(axis=1).argsort(axis=1).astype(np.float64))
    size = (runs**3 - runs) / 12.0
    drawn = []
    for correlation in CORRELATIONS:
        mixed = correlation * first + math.sqrt(1.0 - correlation**2) * second
        drawn.append(np.sort((ranks * mixed.argsort(axis=1).argsort(axis=1)).sum(axis=1) / size))
    return drawn


def _centred(values: FloatArray) -> FloatArray:
    return values - values.mean(axis=-1, keepdims=True)


def _spearman(a: FloatArray, b: FloatArray) -> FloatArray:
    """Rank correlation along the last axis; NaN where either side is constant."""
    first, second = (_centred(stats.rankdata(values, axis=-1)) for values in (a, b))
    size = np.sqrt((first**2).sum(axis=-1) * (second**2).sum(axis=-1))
    return np.where(size > 0.0, (first * second).sum(axis=-1) / np.where(size > 0.0, size, 1.0), np.nan)
