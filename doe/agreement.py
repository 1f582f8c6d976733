"""Agreement of two sets of numbers for the same runs, with the noise of both taken out."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from doe.errors import DesignError

FloatArray = NDArray[np.float64]

RESAMPLES = 4_000
"""Bootstrap resamples: an end of a 95 % interval is then known to about 3 % of its width."""

SEED = 1
"""Of the resampling: the same numbers give the same intervals."""


@dataclass(frozen=True)
class Estimate:
    """A number and its interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Agreement:
    """How values follow reference values, run by run; made by ``agreement``.

    The intervals come from resampling the runs, within their strata, with replacement (percentiles; Efron and
    Tibshirani, An Introduction to the Bootstrap, 1993, chapter 13). Of few runs they are rough.
    """

    response: FloatArray
    reference: FloatArray
    value_variance: FloatArray
    """Variance of each value by noise: that of one replicate over the replicates averaged."""
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
        """Root mean square of the differences, the noise of both included."""
        return self._estimate(lambda rows: np.sqrt(self._mean_square(rows)))

    @cached_property
    def rmse_without_own_noise(self) -> Estimate:
        """Root of the mean square less the mean of the values' noise variances, at least 0."""
        return self._estimate(
            lambda rows: _root(self._mean_square(rows) - self.value_variance[rows].mean(axis=-1))
        )

    @cached_property
    def rmse_without_noise(self) -> Estimate:
        """Root of the mean square less the noise variances of values and reference, at least 0.

        Were there no noise but the misfit the same, the root mean square would be this.
        """
        return self._estimate(
            lambda rows: _root(
                self._mean_square(rows) - self.value_variance[rows].mean(axis=-1) - self.reference_variance
            )
        )

    @cached_property
    def bias(self) -> Estimate:
        """Mean difference, values less reference; noise does not move it."""
        return self._estimate(lambda rows: self._difference[rows].mean(axis=-1))

    @cached_property
    def slope(self) -> Estimate:
        """Change of the values per change of the true reference.

        The least-squares slope over the reliability of the reference, (s^2 - noise variance) / s^2 with s^2
        the variance of the reference (Fuller, Measurement Error Models, 1987, section 1.1): noise of the
        reference flattens a plain slope, noise of the values does not. NaN where the reference varies no more
        than its noise.
        """
        return self._estimate(self._slopes)

    @cached_property
    def spearman(self) -> Estimate:
        """Rank correlation, as it stands."""
        return self._estimate(lambda rows: _spearman(self.response[rows], self.reference[rows]))

    @cached_property
    def spearman_ceiling(self) -> Estimate:
        """Rank correlation that a perfect model would show through the noise of both: mean and interval.

        The true values are the reference's means by setting, drawn together so that their spread is that of
        the reference less its noise; noise of both sides is then added to them, again and again.
        """
        truth, rng = self._truth(), np.random.default_rng(SEED)
        shape = (RESAMPLES, self.runs)
        values = truth + np.sqrt(self.value_variance) * rng.standard_normal(shape)
        reference = truth + np.sqrt(self.reference_variance) * rng.standard_normal(shape)
        seen = _spearman(values, reference)
        return Estimate(float(seen.mean()), *self._percentiles(seen))

    @cached_property
    def _difference(self) -> FloatArray:
        return self.response - self.reference

    def _mean_square(self, rows: NDArray[np.int_]) -> FloatArray:
        return (self._difference[rows] ** 2).mean(axis=-1)

    def _slopes(self, rows: NDArray[np.int_]) -> FloatArray:
        values, reference = _centred(self.response[rows]), _centred(self.reference[rows])
        noise = (rows.shape[-1] - 1) * self.reference_variance
        true_spread = (reference**2).sum(axis=-1) - noise
        products = (values * reference).sum(axis=-1)
        return np.where(true_spread > 0.0, products / np.where(true_spread > 0.0, true_spread, 1.0), np.nan)

    def _truth(self) -> FloatArray:
        count = np.bincount(self.settings)
        means = (np.bincount(self.settings, self.reference) / np.maximum(count, 1))[self.settings]
        noise = float((self.reference_variance / count[self.settings]).mean())
        spread = float(means.var(ddof=1))
        share = max(1.0 - noise / spread, 0.0) if spread > 0.0 else 0.0
        return means.mean() + np.sqrt(share) * (means - means.mean())

    @cached_property
    def _resamples(self) -> NDArray[np.int_]:
        """Rows of every resample, shape (resamples, runs): each stratum keeps its number of runs."""
        rng = np.random.default_rng(SEED)
        places = [np.flatnonzero(self.strata == stratum) for stratum in np.unique(self.strata)]
        picks = [(rng.random((RESAMPLES, len(rows))) * len(rows)).astype(int) for rows in places]
        return np.hstack([rows[pick] for rows, pick in zip(places, picks, strict=True)])

    def _estimate(self, statistic: Callable[[NDArray[np.int_]], FloatArray]) -> Estimate:
        value = float(statistic(np.arange(self.runs)))
        return Estimate(value, *self._percentiles(statistic(self._resamples)))

    def _percentiles(self, samples: FloatArray) -> tuple[float, float]:
        known = samples[np.isfinite(samples)]
        if len(known) < len(samples) / 2:
            return float("nan"), float("nan")
        tail = 50.0 * (1.0 - self.confidence)
        low, high = np.percentile(known, [tail, 100.0 - tail])
        return float(low), float(high)


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
    value_variance : float or array-like, shape (runs,)
        Noise variance of each value; of a mean of n replicates that of one, over n.
    reference_variance : float
        Noise variance of one reference value.
    settings : array-like, shape (runs,), optional
        Labels: runs of one setting have one true value. By default every run has a setting of its own.
    strata : array-like, shape (runs,), optional
        Labels: the resampling behind the intervals keeps the number of runs of each, such as a table.
    confidence : float

    Raises
    ------
    DesignError
        Fewer than 3 runs, arrays of different lengths, numbers that are not finite, negative variances.
    """
    first, second = np.asarray(values, np.float64), np.asarray(reference, np.float64)
    if first.ndim != 1 or first.shape != second.shape or len(first) < 3:
        raise DesignError(
            f"agreement needs values and reference of the same 3 or more runs, received shapes {first.shape} "
            f"and {second.shape}"
        )
    if not (np.isfinite(first).all() and np.isfinite(second).all()):
        raise DesignError("agreement needs finite values and reference: leave out the runs that lack one")
    variance = np.broadcast_to(np.asarray(value_variance, np.float64), first.shape)
    if not ((variance >= 0.0).all() and 0.0 <= reference_variance < np.inf):
        raise DesignError(
            f"noise variances must be 0 or more, received {value_variance!r}, {reference_variance}"
        )
    if not 0.0 < confidence < 1.0:
        raise DesignError(f"confidence lies between 0 and 1, received {confidence}")
    runs = len(first)
    return Agreement(
        first,
        second,
        variance,
        float(reference_variance),
        np.arange(runs) if settings is None else _numbers(settings, runs, "settings"),
        np.zeros(runs, int) if strata is None else _numbers(strata, runs, "strata"),
        confidence,
    )


def _numbers(labels: ArrayLike, runs: int, name: str) -> NDArray[np.int_]:
    """Return for every label the number of its kind."""
    given = np.asarray(labels)
    if given.shape != (runs,):
        raise DesignError(f"{name} must be a label for each of {runs} runs, received shape {given.shape}")
    return np.unique(given, return_inverse=True)[1]


def _root(mean_square: FloatArray) -> FloatArray:
    return np.sqrt(np.maximum(mean_square, 0.0))


def _centred(values: FloatArray) -> FloatArray:
    return values - values.mean(axis=-1, keepdims=True)


def _spearman(a: FloatArray, b: FloatArray) -> FloatArray:
    """Rank correlation along the last axis; NaN where either side is constant."""
    first, second = (_centred(stats.rankdata(values, axis=-1)) for values in (a, b))
    size = np.sqrt((first**2).sum(axis=-1) * (second**2).sum(axis=-1))
    return np.where(size > 0.0, (first * second).sum(axis=-1) / np.where(size > 0.0, size, 1.0), np.nan)
