"""Response surfaces of one condition: the base model over the factors, and the addition of each mechanism.

The base is a full cubic of the factors. A mechanism of coded size g adds g times a full quadratic of g and
the factors, nothing at g = 0. The misfit of a polynomial may be kriged. `surface_fits` fits them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache
from itertools import combinations_with_replacement

import numpy as np

from doe.discrepancy.emulation.run_noise import Noise
from doe.numerics.kriging import Kriging

FEW = 64
"""Largest number of points whose terms are remembered."""


@cache
def _products(size: int, degree: int) -> np.ndarray:
    """Return the numbers of 1 (0) and the factors in each product of a degree, (products, degree)."""
    return np.array([*combinations_with_replacement(range(1 + size), degree)], dtype=int)


def polynomial(theta: np.ndarray, degree: int) -> np.ndarray:
    """Return the terms of a full polynomial: products of 1 and factors, lower degrees first, (n, terms).

    Terms of few points are remembered, as all conditions and observables use them; they cannot be written to.
    """
    if len(theta) > FEW:
        return _terms(theta, degree)
    return _remembered_terms(theta.astype(np.float64, copy=False).tobytes(), theta.shape, degree)


def _terms(theta: np.ndarray, degree: int) -> np.ndarray:
    one, numbers = np.ones((len(theta), 1 + theta.shape[1])), _products(theta.shape[1], degree)
    one[:, 1:] = theta
    return np.asarray(one.take(numbers.T, axis=1).prod(axis=1))


@lru_cache(maxsize=64)
def _remembered_terms(points: bytes, shape: tuple[int, int], degree: int) -> np.ndarray:
    terms = _terms(np.frombuffer(points).reshape(shape), degree)
    terms.flags.writeable = False
    return terms


def added(theta: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return the terms of a mechanism's addition: its size times a full quadratic of size and factors."""
    return np.asarray(size[:, None] * polynomial(np.concatenate([size[:, None], theta], axis=1), 2))


def all_terms(x: np.ndarray, factors: int) -> np.ndarray:
    """Return the terms of the base, then of every mechanism, at coded parameters (n, parameters)."""
    theta = x[:, :factors]
    return np.concatenate([polynomial(theta, 3), *(added(theta, size) for size in x[:, factors:].T)], axis=1)


@dataclass(frozen=True, eq=False)
class Polynomial:
    """A least squares fit of all observables."""

    coefficients: np.ndarray
    """(terms, observables)."""
    misfit: np.ndarray
    """Variance beyond the noise and the kriging, (observables,)."""
    kriging: Mapping[int, Kriging]
    """Kriged misfit by number of the observable, where the polynomial fails."""

    def missed(self, x: np.ndarray) -> np.ndarray:
        """Return the kriged part at coded parameters, (n, observables)."""
        out = np.zeros((len(x), len(self.misfit)))
        for column, kriging in self.kriging.items():
            out[:, column] = kriging.mean(x)
        return out

    def misfit_variance(self, x: np.ndarray) -> np.ndarray:
        """Return the variance of the misfit at one row of coded parameters, (observables,)."""
        out = self.misfit.copy()
        for column, kriging in self.kriging.items():
            out[column] = kriging.variance(x[None])[0]
        return out

    def silenced(self, silent: np.ndarray) -> Polynomial:
        """Return the same without the observables that symmetry forbids."""
        kriging = {column: one for column, one in self.kriging.items() if not silent[column]}
        return Polynomial(self.coefficients * ~silent, self.misfit * ~silent, kriging)


@dataclass(frozen=True, eq=False)
class Addition:
    """A mechanism's addition to the base, with the relation of its error to that of the base."""

    polynomial: Polynomial
    base_terms: np.ndarray
    """Minus the matrix from errors of the base's coefficients to those of the addition, (terms, base terms).
    """
    gram_inverse: np.ndarray
    """(terms, terms)."""
    chance: np.ndarray
    """Covariance of the coefficients due to the noise of the runs, in variances of one run, (terms, terms):
    that of their error, ``gram_inverse``, less the part that shrinking them leaves open."""
    growth: np.ndarray
    """Logarithm of the variance of one run at the largest size over that without the mechanism,
    (observables,)."""
    variance: np.ndarray
    """Variance of one run, mean over the mechanism's runs, (observables,)."""
    correlation: np.ndarray
    """Correlation of one run at the largest size, (observables, observables)."""
    silent: np.ndarray
    """True where symmetry forbids an effect, (observables,)."""

    def predict(self, theta: np.ndarray, size: np.ndarray) -> np.ndarray:
        """Predict the addition at coded factors (n, factors) and sizes (n,), (n, observables)."""
        values = added(theta, size) @ self.polynomial.coefficients
        if self.polynomial.kriging:
            values += size[:, None] * self.polynomial.missed(np.column_stack([theta, size]))
        return np.asarray(values)

    @cached_property
    def covariance(self) -> np.ndarray:
        """Covariance of one run where an effect is allowed, mean over its runs."""
        sd = np.sqrt(self.variance) * ~self.silent
        return np.asarray(sd[:, None] * self.correlation * sd)


@dataclass(frozen=True, eq=False)
class Surfaces:
    """The emulator of one condition."""

    base: Polynomial
    gram_inverse: np.ndarray
    chance: np.ndarray
    """Matrices of the base's fit, as in an `Addition`, (terms, terms)."""
    noise: Noise
    """Noise of one run near the base."""
    additions: Mapping[str, Addition]
    """Additions by mechanism."""
    silent: np.ndarray
    """True where symmetry leaves the base noise only, (observables,)."""

    def predict(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Return expected observables at coded parameters (n, factors + mechanisms), (n, observables).

        Mechanisms add up.
        """
        theta = x[:, : x.shape[1] - len(mechanisms)]
        values = polynomial(theta, 3) @ self.base.coefficients + self.base.missed(theta)
        for name, size in zip(mechanisms, x[:, theta.shape[1] :].T, strict=True):
            values = values + self.additions[name].predict(theta, size)
        return np.asarray(values)

    def noise_covariance(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Return the covariance of one run at one row of coded parameters, (observables, observables)."""
        theta = x[: len(x) - len(mechanisms)]
        growth = np.zeros(len(self.base.misfit))
        for name, size in zip(mechanisms, x[len(theta) :], strict=True):
            growth = growth + size * self.additions[name].growth
        sd = np.exp(0.5 * growth) * np.sqrt(self.noise.variance(theta))
        return np.asarray(sd[:, None] * self.correlation(x, mechanisms) * sd)

    def correlation(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Return the correlation of one run at one row of coded parameters, (observables, observables).

        A mechanism's own counts by its share of the largest size.
        """
        sizes = x[len(x) - len(mechanisms) :]
        whole = max(float(sizes.sum()), 1.0)
        out = (1.0 - sizes.sum() / whole) * self.noise.correlation
        for name, size in zip(mechanisms, sizes, strict=True):
            out = out + size / whole * self.additions[name].correlation
        return np.asarray(out)

    def error(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Return the covariance of the prediction's error at one row of coded parameters."""
        theta = x[: len(x) - len(mechanisms)]
        base, own = polynomial(theta[None], 3)[0], np.diag(self.misfit_variance(x, mechanisms))
        for name, size in zip(mechanisms, x[len(theta) :], strict=True):
            part = self.additions[name]
            terms = added(theta[None], np.array([size]))[0]
            base = base - terms @ part.base_terms
            own += (terms @ part.gram_inverse @ terms) * part.covariance
        return np.asarray((base @ self.gram_inverse @ base) * self._base_noise(theta) + own)

    def shared_error(self, x: np.ndarray, mechanisms: tuple[str, ...], name: str, size: float) -> np.ndarray:
        """Return the covariance of errors of another mechanism's addition and of measured less predicted.

        Both contain the error of the base: the addition was fitted to runs less the base. x (parameters,) is
        coded, of the mechanisms in the prediction; ``name`` and its coded ``size`` are the other one's.
        """
        theta = x[: len(x) - len(mechanisms)]
        through = added(theta[None], np.array([size]))[0] @ self.additions[name].base_terms
        return np.asarray(
            (through @ self.gram_inverse @ self._base_terms(x, mechanisms)) * self._base_noise(theta)
        )

    def _base_terms(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Return the terms by which errors of the base's coefficients enter a prediction, (terms,)."""
        theta = x[: len(x) - len(mechanisms)]
        terms = polynomial(theta[None], 3)[0]
        for name, size in zip(mechanisms, x[len(theta) :], strict=True):
            terms = terms - added(theta[None], np.array([size]))[0] @ self.additions[name].base_terms
        return np.asarray(terms)

    def _base_noise(self, theta: np.ndarray) -> np.ndarray:
        """Return the covariance of one run where the base is more than noise, (observables, observables)."""
        return np.asarray(self.noise.covariance(theta) * np.outer(~self.silent, ~self.silent))

    def coefficient_errors(self, theta: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Return covariances of errors of all coefficients, with the noise at some factors.

        Shape (observables, terms, terms), with the terms of `all_terms`.
        """
        own = [self.additions[name].gram_inverse for name in mechanisms]
        return self._of_coefficients(theta, mechanisms, self.gram_inverse, own)

    def coefficient_chance(self, theta: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Return covariances of all coefficients due to noise (`coefficient_errors`)."""
        own = [self.additions[name].chance for name in mechanisms]
        return self._of_coefficients(theta, mechanisms, self.chance, own)

    def _of_coefficients(
        self, theta: np.ndarray, mechanisms: tuple[str, ...], base: np.ndarray, own: Sequence[np.ndarray]
    ) -> np.ndarray:
        """Return covariances of all coefficients from those of the base and of each mechanism's own."""
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
        """Return True where a model with some mechanisms is more than noise, (observables,)."""
        return ~np.logical_and.reduce([self.silent, *(self.additions[name].silent for name in mechanisms)])

    def misfit_variance(self, x: np.ndarray, mechanisms: tuple[str, ...]) -> np.ndarray:
        """Return the variance beyond all coefficients at one row of coded parameters, (observables,)."""
        theta = x[: len(x) - len(mechanisms)]
        misfit = self.base.misfit_variance(theta)
        for name, size in zip(mechanisms, x[len(theta) :], strict=True):
            at = np.append(theta, size)
            misfit = misfit + size**2 * self.additions[name].polynomial.misfit_variance(at)
        return np.asarray(misfit)


def symmetric_base(base: Surfaces, odd: np.ndarray) -> Surfaces:
    """Remove from a base the observables that a mirror turns over, (observables,).

    Their scatter is that of its runs; a mirror turns over their correlation with the others, so it is zero.
    """
    noise = replace(base.noise, correlation=_parted(base.noise.correlation, odd))
    return replace(base, base=base.base.silenced(odd), noise=noise, silent=odd)


def symmetric_addition(addition: Addition, odd: np.ndarray, silent: np.ndarray) -> Addition:
    """Remove from a mechanism the observables that symmetry forbids; nothing from a directed one."""
    polynomial = addition.polynomial.silenced(silent)
    correlation = _parted(addition.correlation, odd) if silent.any() else addition.correlation
    return replace(addition, polynomial=polynomial, correlation=correlation, silent=silent)


def _parted(correlation: np.ndarray, odd: np.ndarray) -> np.ndarray:
    return np.where(odd[:, None] == odd, correlation, 0.0)
