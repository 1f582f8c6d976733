"""Response surfaces of one condition: the base model's over the factors, and what each mechanism adds.

The base is a full quadratic of the factors. A mechanism of coded size g adds g (a + b g + c . theta),
nothing at g = 0. Both are least squares fits; where leave-one-out shows that the polynomial fails, the rest
is kriged.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from scipy import stats

from experiments.discover.kriging import Kriging, fit_kriging
from experiments.discover.noise import Noise, fit_growth, fit_noise, repeat_deviations
from experiments.errors import InputError

FAILURE_LEVEL = 0.005
"""A polynomial fails if leave-one-out errors as large as its own have this probability under noise alone."""
MISFIT_LEVEL = 0.05
"""Errors of a larger probability are noise: a variance of the misfit would be chance."""
BETTER = 0.97
"""Kriging is kept where it lowers the mean square of what is left out to less than this."""
EM_STEPS = 100
LEAST_SCALE = 1e-3
"""Least standard deviation of a coefficient, in that of one run: smaller ones are nothing."""
LEAST_SIZE = 0.05
"""Runs of smaller coded sizes say too little of what a mechanism adds to be divided by their size."""


def quadratic(theta: np.ndarray) -> np.ndarray:
    """Terms of a full quadratic: 1, factors, squares and products, (n, terms)."""
    pairs = combinations_with_replacement(range(theta.shape[1]), 2)
    products = [theta[:, i] * theta[:, j] for i, j in pairs]
    return np.column_stack([np.ones(len(theta)), theta, *products])


def added(theta: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Terms of what a mechanism adds: g, g^2 and g times each factor, (n, terms)."""
    return np.column_stack([size, size**2, size[:, None] * theta])


def all_terms(x: np.ndarray, factors: int) -> np.ndarray:
    """Terms of the base, then of every mechanism, at coded parameters (n, parameters), (n, terms)."""
    theta = x[:, :factors]
    return np.concatenate([quadratic(theta), *(added(theta, size) for size in x[:, factors:].T)], axis=1)


@dataclass(frozen=True, eq=False)
class Polynomial:
    """A least squares fit of all observables.

    Attributes
    ----------
    coefficients : (terms, observables) array
    pseudo_inverse : (terms, runs) array
    misfit : (observables,) array
        Variance of what neither the noise nor the kriging accounts for.
    kriging : dict of Kriging
        By number of the observable: what the polynomial misses, where it fails.
    """

    coefficients: np.ndarray
    pseudo_inverse: np.ndarray
    misfit: np.ndarray
    kriging: Mapping[int, Kriging]

    def missed(self, x: np.ndarray) -> np.ndarray:
        """Kriged part at coded parameters, (n, observables)."""
        out = np.zeros((len(x), len(self.misfit)))
        for column, kriging in self.kriging.items():
            out[:, column] = kriging.mean(x)
        return out

    def misfit_variance(self, x: np.ndarray) -> np.ndarray:
        """Variance of what is missed at one row of coded parameters, (observables,)."""
        out = self.misfit.copy()
        for column, kriging in self.kriging.items():
            out[column] = kriging.variance(x[None])[0]
        return out


@dataclass(frozen=True, eq=False)
class Addition:
    """What a mechanism adds, with how its error hangs on that of the base.

    Attributes
    ----------
    polynomial : Polynomial
    base_terms : (terms, base terms) array
        Errors of the base's coefficients come through as minus this matrix times them.
    gram_inverse : (terms, terms) array
    growth : (observables,) array
        Logarithm of the variance of one run at the largest size over that without the mechanism.
    variance : (observables,) array
        Of one run, mean over the mechanism's runs.
    """

    polynomial: Polynomial
    base_terms: np.ndarray
    gram_inverse: np.ndarray
    growth: np.ndarray
    variance: np.ndarray


@dataclass(frozen=True, eq=False)
class Surfaces:
    """The emulator of one condition.

    Attributes
    ----------
    base : Polynomial
    gram_inverse : (terms, terms) array
        Of the base's fit.
    noise : Noise
        Of one run near the base.
    additions : dict of Addition
        By mechanism.
    """

    base: Polynomial
    gram_inverse: np.ndarray
    noise: Noise
    additions: Mapping[str, Addition]

    def predict(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Expected observables at coded parameters (n, factors + mechanisms), (n, observables).

        Mechanisms add up.
        """
        theta = x[:, : x.shape[1] - len(mechanisms)]
        values = quadratic(theta) @ self.base.coefficients + self.base.missed(theta)
        for name, size in zip(mechanisms, x[:, theta.shape[1] :].T, strict=True):
            part = self.additions[name].polynomial
            values = values + added(theta, size) @ part.coefficients
            if part.kriging:
                values += size[:, None] * part.missed(np.column_stack([theta, size]))
        return np.asarray(values)

    def noise_covariance(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Covariance of one run at one row of coded parameters, (observables, observables)."""
        theta = x[: len(x) - len(mechanisms)]
        growth = np.zeros(len(self.base.misfit))
        for name, size in zip(mechanisms, x[len(theta) :], strict=True):
            growth = growth + size * self.additions[name].growth
        sd = np.exp(0.5 * growth)
        return np.asarray(sd[:, None] * self.noise.covariance(theta) * sd)

    def error(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Covariance of the prediction's error at one row of coded parameters, (observables, observables)."""
        theta = x[: len(x) - len(mechanisms)]
        base, own = quadratic(theta[None])[0], np.zeros(len(self.base.misfit))
        for name, size in zip(mechanisms, x[len(theta) :], strict=True):
            part = self.additions[name]
            terms = added(theta[None], np.array([size]))[0]
            base = base - part.base_terms.T @ terms
            own += (terms @ part.gram_inverse @ terms) * part.variance
        sd = np.sqrt(own)
        shared = (base @ self.gram_inverse @ base) * self.noise.covariance(theta)
        scatter = shared + sd[:, None] * self.noise.correlation * sd
        return np.asarray(scatter + np.diag(self.misfit_variance(x, mechanisms)))

    def coefficient_errors(self, theta: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Covariances of errors of all coefficients, of noise as at some factors (observables, terms, terms).

        Terms are those of `all_terms`.
        """
        parts = [self.additions[name] for name in mechanisms]
        shared = np.concatenate([np.eye(len(self.gram_inverse)), *(-part.base_terms for part in parts)])
        variance = self.noise.variance(theta)[:, None, None]
        errors = variance * (shared @ self.gram_inverse @ shared.T)
        end = len(self.gram_inverse)
        for part in parts:
            start, end = end, end + len(part.gram_inverse)
            errors[:, start:end, start:end] += part.variance[:, None, None] * part.gram_inverse
        return np.asarray(errors)

    def misfit_variance(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Variance of what no coefficient follows at one row of coded parameters, (observables,)."""
        theta = x[: len(x) - len(mechanisms)]
        misfit = self.base.misfit_variance(theta)
        for name, size in zip(mechanisms, x[len(theta) :], strict=True):
            at = np.append(theta, size)
            misfit = misfit + size**2 * self.additions[name].polynomial.misfit_variance(at)
        return np.asarray(misfit)


def repeats_noise(theta: np.ndarray, values: np.ndarray, floor: np.ndarray) -> Noise:
    """Fit the noise to repeated runs without a mechanism.

    Parameters
    ----------
    theta, values : (n, factors), (n, observables) array
        Repeats have equal factors.
    floor : (observables,) array
        Standard deviation that each observable's resolution leaves at the least.

    Raises
    ------
    InputError
        With too few finished runs for the noise or the polynomial of `fit_base`.
    """
    points, groups = np.unique(theta, axis=0, return_inverse=True)
    rows, deviations = repeat_deviations(groups.reshape(-1), values)
    if len(rows) <= values.shape[1] + 1 or len(points) <= quadratic(points).shape[1]:
        rule = "needs more points without a mechanism than polynomial terms, and repeats than observables"
        raise InputError(rule, f"{len(points)} points, {len(rows)} repeats", "bank")
    return fit_noise(theta[rows], deviations, floor)


def fit_base(theta: np.ndarray, values: np.ndarray, noise: Noise) -> Surfaces:
    """Fit the emulator of one condition without mechanisms.

    Parameters
    ----------
    theta, values : (n, factors), (n, observables) array
        Runs without a mechanism; repeats have equal factors.
    noise : Noise
        Of one of them.
    """
    points, groups, repeats = np.unique(theta, axis=0, return_inverse=True, return_counts=True)
    sums = np.zeros((len(points), values.shape[1]))
    np.add.at(sums, groups.reshape(-1), values)
    variance = noise.variance(points) / repeats[:, None]
    means = sums / repeats[:, None]
    base = _fit_polynomial(quadratic(points), points, means, variance, noise.degrees_of_freedom)
    # Every point weighs the same, whatever its repeats; the mean of r runs has 1 / r of the variance.
    gram_inverse = (base.pseudo_inverse / repeats) @ base.pseudo_inverse.T
    return Surfaces(base, gram_inverse, noise, {})


@dataclass(frozen=True, eq=False)
class AddedRuns:
    """Runs with one mechanism in one condition.

    Attributes
    ----------
    base : Surfaces
        Of the condition.
    theta : (n, factors) array
    size : (n,) array
        Coded.
    values : (n, observables) array
    """

    base: Surfaces
    theta: np.ndarray
    size: np.ndarray
    values: np.ndarray

    @property
    def terms(self) -> np.ndarray:
        """Terms of what the mechanism adds, (n, terms)."""
        return added(self.theta, self.size)

    @property
    def difference(self) -> np.ndarray:
        """What it added, with noise, (n, observables)."""
        return np.asarray(self.values - self.base.predict(self.theta, ()))

    @property
    def noise(self) -> np.ndarray:
        """Variances of one run without the mechanism, (n, observables)."""
        return self.base.noise.variance(self.theta)


def fit_additions(conditions: Sequence[AddedRuns]) -> list[Addition]:
    """Fit what one mechanism adds in every condition.

    How large its coefficients are, in standard deviations of one run, all conditions and observables say
    together (`likeliest_scales`); each is as much nearer to nothing as its noise makes it.
    """
    grams, estimates = [], []
    for runs in conditions:
        inverse = np.linalg.pinv(runs.terms)
        coefficients = inverse @ runs.difference
        growth = _growth(runs, runs.difference - runs.terms @ coefficients, runs.terms @ inverse)
        grams.append(runs.terms.T @ runs.terms)
        estimates.append(coefficients / np.sqrt(_mean_variance(runs, growth)))
    scales = likeliest_scales(grams, estimates)
    return [_fit_addition(runs, scales) for runs in conditions]


def _growth(runs: AddedRuns, residual: np.ndarray, hat: np.ndarray) -> np.ndarray:
    """A heap with a mechanism scatters more: an excess of the residuals is noise unless it is smooth."""
    return fit_growth(runs.size, residual**2 / (1.0 - np.diag(hat))[:, None] / runs.noise)


def _mean_variance(runs: AddedRuns, growth: np.ndarray) -> np.ndarray:
    return np.asarray((runs.noise * np.exp(runs.size[:, None] * growth)).mean(axis=0))


def _fit_addition(runs: AddedRuns, scales: np.ndarray) -> Addition:
    theta, size, terms, noise = runs.theta, runs.size, runs.terms, runs.noise
    points = np.column_stack([theta, size])
    gram_inverse = np.linalg.inv(terms.T @ terms + np.diag(1.0 / scales**2))
    inverse = gram_inverse @ terms.T
    coefficients = inverse @ runs.difference
    residual, hat = runs.difference - terms @ coefficients, terms @ inverse
    growth = _growth(runs, residual, hat)
    leverage = np.diag(hat)[:, None]
    left_out = residual / (1.0 - leverage)
    freedom, kept = len(size) - terms.shape[1], size >= LEAST_SIZE
    suspect = (left_out**2 * (1.0 - leverage) / noise).mean(axis=0) > stats.f.isf(
        FAILURE_LEVEL, freedom, runs.base.noise.degrees_of_freedom
    )
    kriging = {}
    for column in np.flatnonzero(suspect):
        scatter = noise[:, column] * np.exp(size * growth[column])
        missed = residual[kept, column] / size[kept]
        fitted = fit_kriging(points[kept], missed, scatter[kept] / size[kept] ** 2)
        alone = fitted.leave_one_out * size[kept]
        if np.mean(alone**2 / scatter[kept]) < BETTER * np.mean(left_out[kept, column] ** 2 / scatter[kept]):
            kriging[int(column)] = fitted
            growth[column] = fit_growth(size[kept], (alone**2 / noise[kept, column])[:, None])[0]
    return Addition(
        Polynomial(coefficients, inverse, np.zeros(len(growth)), kriging),
        inverse @ quadratic(theta),
        gram_inverse,
        growth,
        _mean_variance(runs, growth),
    )


def likeliest_scales(grams: Sequence[np.ndarray], estimates: Sequence[np.ndarray]) -> np.ndarray:
    """Standard deviations of coefficients of largest likelihood, given their estimates.

    Estimates b scatter about coefficients with the covariance of the inverse of X'X, coefficients about
    nothing with the squares of the scales (Efron and Morris 1973), which expectation and maximisation find.

    Parameters
    ----------
    grams : sequence of (terms, terms) array
        X'X of each condition.
    estimates : sequence of (terms, observables) array
        In standard deviations of one run.

    Returns
    -------
    (terms,) array
    """
    squares = np.mean([np.mean(estimate**2, axis=1) for estimate in estimates], axis=0)
    for _ in range(EM_STEPS):
        total = np.zeros_like(squares)
        for gram, estimate in zip(grams, estimates, strict=True):
            covariance = np.linalg.inv(gram + np.diag(1.0 / squares))
            mean = covariance @ gram @ estimate
            total += np.mean(mean**2, axis=1) + np.diag(covariance)
        squares = np.maximum(total / len(grams), LEAST_SCALE**2)
    return np.sqrt(squares)


def _fit_polynomial(
    terms: np.ndarray, points: np.ndarray, values: np.ndarray, noise: np.ndarray, noise_df: int
) -> Polynomial:
    """Least squares and leave-one-out; what is smooth in the rest is kriged where they fail."""
    inverse = np.linalg.pinv(terms)
    coefficients = inverse @ values
    residual = values - terms @ coefficients
    leverage = np.einsum("ij,ji->i", terms, inverse)[:, None]
    excess = residual**2 / (1.0 - leverage)
    freedom = len(terms) - terms.shape[1]
    ratio = excess.mean(axis=0) / noise.mean(axis=0)
    beyond = ratio > stats.f.isf(MISFIT_LEVEL, freedom, noise_df)
    misfit = np.where(beyond, excess.mean(axis=0) - noise.mean(axis=0), 0.0)
    kriging = {}
    for column in np.flatnonzero(ratio > stats.f.isf(FAILURE_LEVEL, freedom, noise_df)):
        fitted = fit_kriging(points, residual[:, column], noise[:, column])
        left_out = residual[:, column] / (1.0 - leverage[:, 0])
        if np.mean(fitted.leave_one_out**2) < BETTER * np.mean(left_out**2):
            kriging[int(column)] = fitted
    return Polynomial(coefficients, inverse, misfit, kriging)
