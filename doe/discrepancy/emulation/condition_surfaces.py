"""Response surfaces of one condition: the base model's over the factors, and what each mechanism adds.

The base is a full cubic of the factors. A mechanism of coded size g adds g times a full quadratic of g
and the factors, nothing at g = 0. What a polynomial misses may be kriged. `surface_fits` fits them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations_with_replacement

import numpy as np

from doe.discrepancy.emulation.run_noise import Noise
from doe.numerics.kriging import Kriging


@cache
def _products(size: int, degree: int) -> np.ndarray:
    """Numbers of the factors in each product of a degree, (degree, products)."""
    return np.array([*combinations_with_replacement(range(size), degree)], dtype=int).reshape(-1, degree).T


def quadratic(theta: np.ndarray) -> np.ndarray:
    """Terms of a full quadratic: 1, factors, squares and products, (n, terms)."""
    i, j = _products(theta.shape[1], 2)
    return np.concatenate([np.ones((len(theta), 1)), theta, theta[:, i] * theta[:, j]], axis=1)


def cubic(theta: np.ndarray) -> np.ndarray:
    """Terms of a full cubic: those of the quadratic, then products of three factors, (n, terms)."""
    i, j, k = _products(theta.shape[1], 3)
    return np.concatenate([quadratic(theta), theta[:, i] * theta[:, j] * theta[:, k]], axis=1)


def added(theta: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Terms of what a mechanism adds: its size times a full quadratic of size and factors, (n, terms)."""
    return np.asarray(size[:, None] * quadratic(np.concatenate([size[:, None], theta], axis=1)))


def all_terms(x: np.ndarray, factors: int) -> np.ndarray:
    """Terms of the base, then of every mechanism, at coded parameters (n, parameters), (n, terms)."""
    theta = x[:, :factors]
    return np.concatenate([cubic(theta), *(added(theta, size) for size in x[:, factors:].T)], axis=1)


@dataclass(frozen=True, eq=False)
class Polynomial:
    """A least squares fit of all observables."""

    coefficients: np.ndarray
    """(terms, observables)."""
    misfit: np.ndarray
    """Variance of what neither the noise nor the kriging accounts for, (observables,)."""
    kriging: Mapping[int, Kriging]
    """By number of the observable: what the polynomial misses, where it fails."""

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

    def silenced(self, silent: np.ndarray) -> Polynomial:
        """Return the same without what symmetry forbids."""
        kriging = {column: one for column, one in self.kriging.items() if not silent[column]}
        return Polynomial(self.coefficients * ~silent, self.misfit * ~silent, kriging)


@dataclass(frozen=True, eq=False)
class Addition:
    """A mechanism's addition to the base, with how its error hangs on that of the base."""

    polynomial: Polynomial
    base_terms: np.ndarray
    """Errors of the base's coefficients come through as minus this matrix times them, (terms, base terms)."""
    gram_inverse: np.ndarray
    """(terms, terms)."""
    chance: np.ndarray
    """Covariance that the noise of the runs gives the coefficients, in variances of one run: that of their
    error, ``gram_inverse``, less what drawing them towards nothing leaves open, (terms, terms)."""
    growth: np.ndarray
    """Logarithm of the variance of one run at the largest size over that without the mechanism,
    (observables,)."""
    variance: np.ndarray
    """Of one run, mean over the mechanism's runs, (observables,)."""
    correlation: np.ndarray
    """Of one run at the largest size, (observables, observables)."""
    silent: np.ndarray
    """True where symmetry forbids that it acts, (observables,)."""

    def predict(self, theta: np.ndarray, size: np.ndarray) -> np.ndarray:
        """Predict what is added at coded factors (n, factors) and sizes (n,), (n, observables)."""
        values = added(theta, size) @ self.polynomial.coefficients
        if self.polynomial.kriging:
            values += size[:, None] * self.polynomial.missed(np.column_stack([theta, size]))
        return np.asarray(values)

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of one run where it may act, mean over its runs, (observables, observables)."""
        sd = np.sqrt(self.variance) * ~self.silent
        return np.asarray(sd[:, None] * self.correlation * sd)


@dataclass(frozen=True, eq=False)
class Surfaces:
    """The emulator of one condition."""

    base: Polynomial
    gram_inverse: np.ndarray
    chance: np.ndarray
    """Of the base's fit, as of an `Addition`, (terms, terms)."""
    noise: Noise
    """Of one run near the base."""
    additions: Mapping[str, Addition]
    """By mechanism."""
    silent: np.ndarray
    """True where symmetry forbids that the base is anything but noise, (observables,)."""

    def predict(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Expected observables at coded parameters (n, factors + mechanisms), (n, observables).

        Mechanisms add up.
        """
        theta = x[:, : x.shape[1] - len(mechanisms)]
        values = cubic(theta) @ self.base.coefficients + self.base.missed(theta)
        for name, size in zip(mechanisms, x[:, theta.shape[1] :].T, strict=True):
            values = values + self.additions[name].predict(theta, size)
        return np.asarray(values)

    def noise_covariance(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Covariance of one run at one row of coded parameters, (observables, observables)."""
        theta = x[: len(x) - len(mechanisms)]
        growth = np.zeros(len(self.base.misfit))
        for name, size in zip(mechanisms, x[len(theta) :], strict=True):
            growth = growth + size * self.additions[name].growth
        sd = np.exp(0.5 * growth) * np.sqrt(self.noise.variance(theta))
        return np.asarray(sd[:, None] * self.correlation(x, mechanisms) * sd)

    def correlation(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Correlation of one run at one row of coded parameters, (observables, observables).

        A mechanism's own counts as much as its size is of the largest.
        """
        sizes = x[len(x) - len(mechanisms) :]
        whole = max(float(sizes.sum()), 1.0)
        out = (1.0 - sizes.sum() / whole) * self.noise.correlation
        for name, size in zip(mechanisms, sizes, strict=True):
            out = out + size / whole * self.additions[name].correlation
        return np.asarray(out)

    def error(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Covariance of the prediction's error at one row of coded parameters, (observables, observables)."""
        theta = x[: len(x) - len(mechanisms)]
        base, own = self._base_terms(x, mechanisms), np.diag(self.misfit_variance(x, mechanisms))
        for name, size in zip(mechanisms, x[len(theta) :], strict=True):
            part = self.additions[name]
            terms = added(theta[None], np.array([size]))[0]
            own += (terms @ part.gram_inverse @ terms) * part.covariance
        return np.asarray((base @ self.gram_inverse @ base) * self._base_noise(theta) + own)

    def shared_error(self, x: np.ndarray, mechanisms: tuple[str, ...], name: str, size: float) -> np.ndarray:
        """Covariance of errors of what another mechanism adds and of measured less predicted.

        Both have the base's in them: the one as it was fitted to runs less the base.

        Parameters
        ----------
        x : (parameters,) array
            Coded, of the mechanisms that are in the prediction.
        mechanisms : tuple of str
        name : str
            The other one.
        size : float
            Its coded size.

        Returns
        -------
        (observables, observables) array
        """
        theta = x[: len(x) - len(mechanisms)]
        through = added(theta[None], np.array([size]))[0] @ self.additions[name].base_terms
        return np.asarray(
            (through @ self.gram_inverse @ self._base_terms(x, mechanisms)) * self._base_noise(theta)
        )

    def _base_terms(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Terms by which errors of the base's coefficients come into a prediction, (terms,)."""
        theta = x[: len(x) - len(mechanisms)]
        terms = cubic(theta[None])[0]
        for name, size in zip(mechanisms, x[len(theta) :], strict=True):
            terms = terms - added(theta[None], np.array([size]))[0] @ self.additions[name].base_terms
        return np.asarray(terms)

    def _base_noise(self, theta: np.ndarray) -> np.ndarray:
        """Covariance of one run where the base is more than noise, (observables, observables)."""
        return np.asarray(self.noise.covariance(theta) * np.outer(~self.silent, ~self.silent))

    def coefficient_errors(self, theta: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Covariances of errors of all coefficients, of noise as at some factors (observables, terms, terms).

        Terms are those of `all_terms`.
        """
        own = [self.additions[name].gram_inverse for name in mechanisms]
        return self._of_coefficients(theta, mechanisms, self.gram_inverse, own)

    def coefficient_chance(self, theta: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Covariances that noise gives all coefficients, as `coefficient_errors` has them of their errors."""
        own = [self.additions[name].chance for name in mechanisms]
        return self._of_coefficients(theta, mechanisms, self.chance, own)

    def _of_coefficients(
        self, theta: np.ndarray, mechanisms: tuple[str, ...], base: np.ndarray, own: Sequence[np.ndarray]
    ) -> np.ndarray:
        """Covariances of all coefficients, of those of the base and of each mechanism's own."""
        parts = [self.additions[name] for name in mechanisms]
        shared = np.concatenate([np.eye(len(base)), *(-part.base_terms for part in parts)])
        variance = (self.noise.variance(theta) * ~self.silent)[:, None, None]
        whole = variance * (shared @ base @ shared.T)
        end = len(base)
        for part, of_part in zip(parts, own, strict=True):
            start, end = end, end + len(of_part)
            scale = part.variance * ~part.silent
            whole[:, start:end, start:end] += scale[:, None, None] * of_part
        return np.asarray(whole)

    def moved(self, mechanisms: tuple[str, ...]) -> np.ndarray:
        """True where a model with some mechanisms is more than noise, (observables,)."""
        return ~np.logical_and.reduce([self.silent, *(self.additions[name].silent for name in mechanisms)])

    def misfit_variance(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Variance of what no coefficient follows at one row of coded parameters, (observables,)."""
        theta = x[: len(x) - len(mechanisms)]
        misfit = self.base.misfit_variance(theta)
        for name, size in zip(mechanisms, x[len(theta) :], strict=True):
            at = np.append(theta, size)
            misfit = misfit + size**2 * self.additions[name].polynomial.misfit_variance(at)
        return np.asarray(misfit)
