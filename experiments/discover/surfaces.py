"""Response surfaces of one condition: the base model's over the factors, and what each mechanism adds.

The base is a full quadratic of the factors. A mechanism of coded size g adds g (a + b g + c . theta),
nothing at g = 0. Both are least squares fits; where leave-one-out shows that the polynomial fails, the rest
is kriged.
"""

from __future__ import annotations

from collections.abc import Mapping
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
        return self._error(theta, quadratic(theta[None])[0], x[len(theta) :], mechanisms)

    def added_error(self, theta: np.ndarray, size: float, mechanism: str) -> np.ndarray:
        """Covariance of the error of what a mechanism adds, (observables, observables)."""
        nothing = np.zeros(self.base.coefficients.shape[0])
        return self._error(theta, nothing, np.array([size]), (mechanism,))

    def _error(
        self, theta: np.ndarray, base: np.ndarray, sizes: np.ndarray, mechanisms: tuple[str, ...]
    ) -> np.ndarray:
        misfit = self.base.misfit_variance(theta) * base.any()
        own = np.zeros(len(misfit))
        for name, size in zip(mechanisms, sizes, strict=True):
            part = self.additions[name]
            terms = added(theta[None], np.array([size]))[0]
            base = base - part.base_terms.T @ terms
            own += (terms @ part.gram_inverse @ terms) * part.variance
            misfit = misfit + size**2 * part.polynomial.misfit_variance(np.append(theta, size))
        shared = (base @ self.gram_inverse @ base) * self.noise.covariance(theta)
        sd = np.sqrt(own)
        return np.asarray(shared + sd[:, None] * self.noise.correlation * sd + np.diag(misfit))


def fit_surfaces(
    theta: np.ndarray,
    values: np.ndarray,
    runs: Mapping[str, tuple[np.ndarray, np.ndarray, np.ndarray]],
    floor: np.ndarray,
) -> Surfaces:
    """Fit the emulator of one condition.

    Parameters
    ----------
    theta, values : (n, factors), (n, observables) array
        Runs without a mechanism; repeats have equal factors.
    runs : dict of (theta, size, values)
        Runs with each mechanism.
    floor : (observables,) array
        Standard deviation that each observable's resolution leaves at the least.

    Raises
    ------
    InputError
        With too few finished runs for the polynomials or the noise.
    """
    points, groups, repeats = np.unique(theta, axis=0, return_inverse=True, return_counts=True)
    rows, deviations = repeat_deviations(groups.reshape(-1), values)
    if len(rows) <= values.shape[1] + 1 or len(points) <= quadratic(points).shape[1]:
        rule = "needs more points without a mechanism than polynomial terms, and repeats than observables"
        raise InputError(rule, f"{len(points)} points, {len(rows)} repeats", "bank")
    noise = fit_noise(theta[rows], deviations, floor)
    sums = np.zeros((len(points), values.shape[1]))
    np.add.at(sums, groups.reshape(-1), values)
    variance = noise.variance(points) / repeats[:, None]
    terms = quadratic(points)
    base = _fit_polynomial(terms, points, sums / repeats[:, None], variance, len(rows))
    # Every point weighs the same, whatever its repeats; the mean of r runs has 1 / r of the variance.
    gram_inverse = (base.pseudo_inverse / repeats) @ base.pseudo_inverse.T
    part = Surfaces(base, gram_inverse, noise, {})
    return Surfaces(
        base, gram_inverse, noise, {name: _fit_addition(part, *run) for name, run in runs.items()}
    )


def _fit_addition(base: Surfaces, theta: np.ndarray, size: np.ndarray, values: np.ndarray) -> Addition:
    terms, points = added(theta, size), np.column_stack([theta, size])
    difference = values - base.predict(theta, ())
    noise = base.noise.variance(theta)
    inverse = np.linalg.pinv(terms)
    coefficients = inverse @ difference
    leverage = np.einsum("ij,ji->i", terms, inverse)[:, None]
    left_out = (difference - terms @ coefficients) / (1.0 - leverage)
    # A heap with a mechanism scatters more: an excess of the residuals is noise unless it is smooth.
    growth = fit_growth(size, left_out**2 * (1.0 - leverage) / noise)
    freedom, kept = len(size) - terms.shape[1], size >= LEAST_SIZE
    suspect = (left_out**2 * (1.0 - leverage) / noise).mean(axis=0) > stats.f.isf(
        FAILURE_LEVEL, freedom, base.noise.degrees_of_freedom
    )
    kriging = {}
    for column in np.flatnonzero(suspect):
        scatter = noise[:, column] * np.exp(size * growth[column])
        missed = (difference - terms @ coefficients)[kept, column] / size[kept]
        fitted = fit_kriging(points[kept], missed, scatter[kept] / size[kept] ** 2)
        alone = fitted.leave_one_out * size[kept]
        if np.mean(alone**2 / scatter[kept]) < BETTER * np.mean(left_out[kept, column] ** 2 / scatter[kept]):
            kriging[int(column)] = fitted
            growth[column] = fit_growth(size[kept], (alone**2 / noise[kept, column])[:, None])[0]
    return Addition(
        Polynomial(coefficients, inverse, np.zeros(len(growth)), kriging),
        inverse @ quadratic(theta),
        inverse @ inverse.T,
        growth,
        (noise * np.exp(size[:, None] * growth)).mean(axis=0),
    )


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
