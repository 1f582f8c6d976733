"""Fits of response surfaces to the runs of a bank.

A misfit of few terms affects all observables alike, as if a parameter were another; so there are many terms,
and those with little evidence in all runs together are shrunk. Where leave-one-out shows that a polynomial
fails, the rest is kriged.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special, stats

from doe.discrepancy.emulation.condition_surfaces import Addition, Polynomial, Surfaces, added, polynomial
from doe.discrepancy.emulation.kriged_parts import Rest
from doe.discrepancy.emulation.run_noise import ALIKE, Noise, correlation_of, fit_growth, repeat_deviations
from doe.errors import RuleError
from doe.numerics.kriging import Covariance, fit_noisy_kriging

FAILURE_LEVEL = 0.005
"""Probability under noise alone of leave-one-out errors from which on a polynomial fails."""
LEAST_RATIO = 1e-6
"""Least mean square of residuals, in those of the noise."""
EM_STEPS = 100
FIRST_SCALE = 3.0
"""First standard deviation of a coefficient, in that of one run."""
SCALE_ROUNDS = 2
"""Rounds in which scales and noise are found, each from the other."""
LEAST_SCALE = 1e-3
"""Least standard deviation of a coefficient, in that of one run."""
LEAST_LONE = 3
"""Runs per term of a quadratic from which on a bank without repeats shows its noise."""
LEAST_SIZE = 0.05
"""Coded size below which the addition of a mechanism is not divided by its size."""


def repeats_of(theta: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return coded factors and independent deviations of repeats without a mechanism, at equal factors.

    Of a bank without repeats, it returns what runs differ by from the prediction of the others.

    Raises RuleError: too few finished runs for the noise or the polynomial of `fit_bases`.
    """
    points, groups = np.unique(theta, axis=0, return_inverse=True)
    rows, deviations = repeat_deviations(groups.reshape(-1), values)
    if not len(rows) and len(theta) > LEAST_LONE * polynomial(theta[:1], 2).shape[1]:
        rows, deviations = np.arange(len(theta)), lone_deviations(theta, values)
    if len(rows) <= values.shape[1] + 1 or len(points) <= polynomial(points, 2).shape[1]:
        rule = (
            "must have more points without a mechanism than polynomial terms, more repeats than observables"
        )
        raise RuleError("bank", rule, f"{len(points)} points, {len(rows)} repeats")
    return theta[rows], deviations


def lone_deviations(theta: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return deviations of runs without repeats, with the variance of one run's noise, (n, observables).

    A quadratic and a smooth function, with a noise of largest likelihood, predict each run from the others;
    what it differs by is as large as the noise where its expected error is taken out.
    """
    terms = polynomial(theta, 2)
    missed = values - terms @ np.linalg.lstsq(terms, values, rcond=None)[0]
    fits = [fit_noisy_kriging(theta, column) for column in missed.T]
    return np.column_stack([np.sqrt(noise) * process.standard for process, noise in fits])


@dataclass(frozen=True, eq=False)
class _Shrunk:
    """Least squares fit with coefficients shrunk towards zero."""

    gram_inverse: np.ndarray
    """Covariance of the coefficients, in variances of one run, (terms, terms)."""
    inverse: np.ndarray
    """(terms, runs)."""
    coefficients: np.ndarray
    """(terms, observables)."""
    residual: np.ndarray
    """(runs, observables)."""
    leverage: np.ndarray
    """(runs, 1)."""

    @classmethod
    def of(cls, terms: np.ndarray, response: np.ndarray, scales: np.ndarray) -> _Shrunk:
        """Fit with known standard deviations of the coefficients, in those of one run; infinite: free."""
        gram_inverse = np.linalg.inv(terms.T @ terms + np.diag(1.0 / scales**2))
        inverse = gram_inverse @ terms.T
        coefficients = inverse @ response
        leverage = np.einsum("ij,ji->i", terms, inverse)[:, None]
        return cls(gram_inverse, inverse, coefficients, response - terms @ coefficients, leverage)

    @property
    def chance(self) -> np.ndarray:
        """Covariance of the coefficients due to noise alone, in variances of one run, (terms, terms)."""
        return self.inverse @ self.inverse.T


@dataclass(frozen=True, eq=False)
class BaseRuns:
    """Runs without a mechanism in one condition, repeats averaged."""

    theta: np.ndarray
    """Coded factors of each distinct point, (n, factors)."""
    repeats: np.ndarray
    """Runs of each point, (n,)."""
    means: np.ndarray
    """Means of the repeats, (n, observables)."""
    noise: Noise
    """Noise of one run."""
    kriged: Mapping[int, Covariance] | None = None
    """Covariances of the columns that an earlier fit kriged; None: search for them."""

    @classmethod
    def of(
        cls,
        theta: np.ndarray,
        values: np.ndarray,
        noise: Noise,
        kriged: Mapping[int, Covariance] | None = None,
    ) -> BaseRuns:
        """Average the repeats among runs (n, factors), (n, observables)."""
        points, groups, repeats = np.unique(theta, axis=0, return_inverse=True, return_counts=True)
        sums = np.zeros((len(points), values.shape[1]))
        np.add.at(sums, groups.reshape(-1), values)
        return cls(points, repeats, sums / repeats[:, None], noise, kriged)

    @property
    def terms(self) -> np.ndarray:
        """Terms of the base, each row times the root of its number of runs."""
        return np.asarray(np.sqrt(self.repeats)[:, None] * polynomial(self.theta, 3))

    @property
    def response(self) -> np.ndarray:
        """Means times the same root, with the noise of one run, (n, observables)."""
        return np.asarray(np.sqrt(self.repeats)[:, None] * self.means)


def fit_bases(conditions: Sequence[BaseRuns]) -> list[Surfaces]:
    """Fit the emulators of all conditions without mechanisms.

    The terms of third order are shrunk as those of the mechanisms are (`fit_additions`).
    """
    free = polynomial(conditions[0].theta, 2).shape[1]
    grams, moments = [], []
    for runs in conditions:
        linear, higher = runs.terms[:, :free], runs.terms[:, free:]
        left = higher - linear @ (np.linalg.pinv(linear) @ higher)
        grams.append(left.T @ left)
        moments.append(left.T @ runs.response / np.sqrt(runs.noise.variance(runs.theta).mean(axis=0)))
    scales = np.append(np.full(free, np.inf), likeliest_scales(grams, moments))
    fits = [_BaseFit.of(runs, scales) for runs in conditions]
    misfits = shared_misfits(
        np.array([fit.ratio for fit in fits]),
        np.array([fit.freedom for fit in fits])[:, None],
        np.array([runs.noise.degrees_of_freedom for runs in conditions])[:, None],
    )
    return [fit.surfaces(misfit) for fit, misfit in zip(fits, misfits, strict=True)]


def shared_misfits(ratio: np.ndarray, freedom: np.ndarray, degrees: np.ndarray) -> np.ndarray:
    """Return variances of polynomial misfits, in those of one run, from all conditions and observables.

    ``ratio`` holds mean squares of residuals over those of repeats, (conditions, observables). A misfit as
    large as the noise of a mean is invisible in one observable of one condition, yet not negligible.
    Logarithms of the ratios, less their mean under noise alone, scatter by that of F and about the common
    mean by the differences of misfits; each is shrunk to that mean by its noise (Smyth 2004,
    doi:10.2202/1544-6115.1027, for variances of many genes).
    """
    halves = 0.5 * freedom, 0.5 * degrees
    expected = (special.digamma(halves[0]) - np.log(halves[0])) - (
        special.digamma(halves[1]) - np.log(halves[1])
    )
    chance = special.polygamma(1, halves[0]) + special.polygamma(1, halves[1])
    found = np.log(np.maximum(ratio, LEAST_RATIO)) - expected
    mean = found.mean()
    true = max(np.mean((found - mean) ** 2 - chance), 0.0)
    return np.asarray(np.expm1(mean + true / (true + chance) * (found - mean)).clip(min=0.0))


@dataclass(frozen=True, eq=False)
class _BaseFit:
    """Least squares of the runs without a mechanism in one condition."""

    runs: BaseRuns
    fitted: _Shrunk
    noise: np.ndarray
    """Variances of one run at the points, (n, observables)."""

    @classmethod
    def of(cls, runs: BaseRuns, scales: np.ndarray) -> _BaseFit:
        """Fit with known standard deviations of the coefficients, in those of one run; infinite: free."""
        return cls(runs, _Shrunk.of(runs.terms, runs.response, scales), runs.noise.variance(runs.theta))

    @property
    def freedom(self) -> float:
        """Degrees of freedom of the residuals."""
        return float(len(self.noise) - self.fitted.leverage.sum())

    @property
    def ratio(self) -> np.ndarray:
        """Mean squares of the residuals over those of the noise, (observables,)."""
        excess = self.fitted.residual**2 / (1.0 - self.fitted.leverage)
        return np.asarray(excess.mean(axis=0) / self.noise.mean(axis=0))

    def surfaces(self, misfit: np.ndarray) -> Surfaces:
        """Return the emulator for misfits in variances of one run; a smooth misfit is kriged."""
        runs, repeats = self.runs, self.runs.repeats[:, None]
        missed, scatter = self.fitted.residual / np.sqrt(repeats), self.noise / repeats
        fails = self.ratio > stats.f.isf(FAILURE_LEVEL, self.freedom, runs.noise.degrees_of_freedom)
        rest = Rest(runs.theta, missed, scatter, np.ones_like(missed))
        kriging = rest.kriged(fails, runs.kriged)
        base = Polynomial(
            self.fitted.coefficients, misfit * self.noise.mean(axis=0) / repeats.mean(), kriging
        )
        fitted, silent = self.fitted, np.zeros(len(misfit), dtype=bool)
        return Surfaces(base, fitted.gram_inverse, fitted.chance, runs.noise, {}, silent)


@dataclass(frozen=True, eq=False)
class AddedRuns:
    """Runs with one mechanism in one condition."""

    base: Surfaces
    """Surfaces of the condition without the mechanism."""
    theta: np.ndarray
    """Coded factors, (n, factors)."""
    size: np.ndarray
    """Coded sizes, (n,)."""
    values: np.ndarray
    """(n, observables)."""
    kriged: Mapping[int, Covariance] | None = None
    """Covariances of the columns that an earlier fit kriged; None: search for them."""

    @property
    def terms(self) -> np.ndarray:
        """Terms of the mechanism's addition, (n, terms)."""
        return added(self.theta, self.size)

    @property
    def difference(self) -> np.ndarray:
        """Addition of the mechanism, with noise, (n, observables)."""
        return np.asarray(self.values - self.base.predict(self.theta, ()))

    @property
    def noise(self) -> np.ndarray:
        """Variances of one run without the mechanism, (n, observables)."""
        return self.base.noise.variance(self.theta)


def fit_additions(conditions: Sequence[AddedRuns]) -> list[Addition]:
    """Fit the addition of one mechanism in every condition.

    All conditions and observables together determine the sizes of its coefficients, in standard deviations of
    one run (`likeliest_scales`); each is shrunk to zero by its noise.
    """
    grams = [runs.terms.T @ runs.terms for runs in conditions]
    scales = np.full(len(grams[0]), FIRST_SCALE)
    for _ in range(SCALE_ROUNDS):
        variances = [_addition_variance(runs, scales) for runs in conditions]
        moments = [
            runs.terms.T @ runs.difference / np.sqrt(variance)
            for runs, variance in zip(conditions, variances, strict=True)
        ]
        scales = likeliest_scales(grams, moments)
    return _with_correlations(conditions, [_fit_addition(runs, scales) for runs in conditions])


def _with_correlations(conditions: Sequence[AddedRuns], additions: Sequence[Addition]) -> list[Addition]:
    """Replace the correlation of runs with a mechanism by one estimated from all conditions.

    Runs count by their sizes, and the correlation without the mechanism as `ALIKE` runs.
    """
    standard = [
        (runs.difference - one.predict(runs.theta, runs.size))
        / np.sqrt(runs.noise * np.exp(runs.size[:, None] * one.growth))
        for runs, one in zip(conditions, additions, strict=True)
    ]
    sizes = np.concatenate([runs.size for runs in conditions])
    seen, worth = correlation_of(np.concatenate(standard), sizes), sizes.sum() ** 2 / (sizes**2).sum()
    return [
        replace(one, correlation=(ALIKE * one.correlation + worth * seen) / (ALIKE + worth))
        for one in additions
    ]


def _growth(runs: AddedRuns, fitted: _Shrunk) -> np.ndarray:
    """Return the growth of the scatter under a mechanism; residuals are noise unless they are smooth."""
    return fit_growth(runs.size, fitted.residual**2 / (1.0 - fitted.leverage) / runs.noise)


def _mean_variance(runs: AddedRuns, growth: np.ndarray) -> np.ndarray:
    return np.asarray((runs.noise * np.exp(runs.size[:, None] * growth)).mean(axis=0))


def _addition_variance(runs: AddedRuns, scales: np.ndarray) -> np.ndarray:
    fitted = _Shrunk.of(runs.terms, runs.difference, scales)
    return _mean_variance(runs, _growth(runs, fitted))


def _fit_addition(runs: AddedRuns, scales: np.ndarray) -> Addition:
    theta, size, noise = runs.theta, runs.size, runs.noise
    fitted = _Shrunk.of(runs.terms, runs.difference, scales)
    growth = _growth(runs, fitted)
    left_out = fitted.residual / (1.0 - fitted.leverage)
    freedom, kept = len(size) - fitted.leverage.sum(), size >= LEAST_SIZE
    suspect = (left_out**2 * (1.0 - fitted.leverage) / noise).mean(axis=0) > stats.f.isf(
        FAILURE_LEVEL, freedom, runs.base.noise.degrees_of_freedom
    )
    its_size = size[kept, None]
    scatter = noise[kept] * np.exp(its_size * growth) / its_size**2
    points = np.column_stack([theta, size])[kept]
    rest = Rest(points, fitted.residual[kept] / its_size, scatter, 1.0 / scatter)
    kriging = rest.kriged(suspect, runs.kriged)
    for column, smooth in kriging.items():
        alone = smooth.leave_one_out * size[kept]
        growth[column] = fit_growth(size[kept], (alone**2 / noise[kept, column])[:, None])[0]
    return Addition(
        Polynomial(fitted.coefficients, np.zeros(len(growth)), kriging),
        fitted.inverse @ polynomial(theta, 3),
        fitted.gram_inverse,
        fitted.chance,
        growth,
        _mean_variance(runs, growth),
        runs.base.noise.correlation,
        np.zeros(len(growth), dtype=bool),
    )


def likeliest_scales(grams: Sequence[np.ndarray], moments: Sequence[np.ndarray]) -> np.ndarray:
    """Return standard deviations of coefficients of largest likelihood, (terms,), given data y.

    Data scatter about X times the coefficients with variance one, coefficients about zero with the squares of
    the scales (Efron and Morris 1973); expectation and maximisation find these from X'X and X'y of each
    condition.
    """
    squares = np.ones(len(grams[0]))
    for _ in range(EM_STEPS):
        total = np.zeros_like(squares)
        for gram, moment in zip(grams, moments, strict=True):
            covariance = np.linalg.inv(gram + np.diag(1.0 / squares))
            mean = covariance @ moment
            total += np.mean(mean**2, axis=1) + np.diag(covariance)
        squares = np.maximum(total / len(grams), LEAST_SCALE**2)
    return np.sqrt(squares)
