"""Corrections of the emulator by fresh runs: updated coefficients, and a smooth rest.

The emulator is the mean of the functions that its bank allows, and its stated error their covariance. Fresh
runs narrow them down as more runs of the bank would; they also show a smooth function that the polynomials
lack.
"""

from dataclasses import dataclass

import numpy as np

from doe.discrepancy.emulation.condition_surfaces import all_terms
from doe.numerics.kriging import squared_exponential


@dataclass(frozen=True, eq=False)
class Prior:
    """Knowledge of the emulator's error in one condition before fresh runs."""

    factors: int
    """Number of factors; the other parameters are sizes."""
    coefficients: np.ndarray
    """Covariances of the errors of the coefficients, (observables, terms, terms)."""
    chance: np.ndarray
    """Covariances of the coefficients' errors due to the noise of the bank, (observables, terms, terms)."""
    amplitude: np.ndarray
    """Variances of the smooth function, (observables,)."""
    length: np.ndarray
    """Lengths of the smooth function, in coded units, (parameters,)."""

    def covariance(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Return the covariance of errors between two sets of coded points, (observables, m, n)."""
        terms = all_terms(a, self.factors), all_terms(b, self.factors)
        smooth = squared_exponential(a / self.length, b / self.length)
        return np.asarray(terms[0] @ self.coefficients @ terms[1].T + self.amplitude[:, None, None] * smooth)


@dataclass(frozen=True, eq=False)
class Correction:
    """The emulator's error in one condition, given fresh runs around an optimum."""

    prior: Prior
    points: np.ndarray
    """Coded points of the runs, (n, parameters)."""
    coefficients: np.ndarray
    """Additions to the emulator's coefficients, (terms, observables)."""
    weights: np.ndarray
    """Weights of the smooth function, (n, observables)."""
    inverse: np.ndarray
    """Inverse covariances of the runs, (observables, n, n)."""
    correlation: np.ndarray
    """Correlation of errors, (observables, observables)."""
    noise: np.ndarray
    """Variances of the noise of the runs' means, (n, observables)."""
    noise_ratio: np.ndarray
    """Standard deviations of one run around the optimum over those of the emulator, (observables,)."""

    def mean(self, x: np.ndarray) -> np.ndarray:
        """Return the addition to the emulator, (n, observables)."""
        smooth = squared_exponential(x / self.prior.length, self.points / self.prior.length)
        return np.asarray(all_terms(x, self.prior.factors) @ self.coefficients + smooth @ self.weights)

    def gain(self, x: np.ndarray) -> np.ndarray:
        """Return the change of the addition at coded points per miss at each run, (observables, m, n)."""
        return np.asarray(self.prior.covariance(x, self.points) @ self.inverse)

    def error(self, x: np.ndarray) -> np.ndarray:
        """Return the covariance of the corrected prediction's error at one row of coded parameters."""
        known = self.prior.covariance(self.points, x[None])
        left = self.prior.covariance(x[None], x[None]) - self.gain(x[None]) @ known
        sd = np.sqrt(np.maximum(left[:, 0, 0], 0.0))
        return np.asarray(sd[:, None] * self.correlation * sd)

    def chance(self, x: np.ndarray) -> np.ndarray:
        """Return covariances of corrected predictions due to the noise of all runs, (observables, n, n).

        The noise of the bank is included; x is coded (n, parameters).
        """
        prior, gain = self.prior, self.gain(x)
        of_bank = all_terms(x, prior.factors) - gain @ all_terms(self.points, prior.factors)
        of_runs = gain * self.noise.T[:, None, :]
        return np.asarray(
            of_bank @ prior.chance @ np.swapaxes(of_bank, 1, 2) + of_runs @ np.swapaxes(gain, 1, 2)
        )


def condition_on(
    prior: Prior,
    points: np.ndarray,
    missed: np.ndarray,
    noise: np.ndarray,
    correlation: np.ndarray,
    noise_ratio: np.ndarray,
) -> Correction:
    """Update a prior by missed means (n, observables) at coded points, with the noise of each."""
    covariance = prior.covariance(points, points) + noise.T[:, :, None] * np.eye(len(points))
    inverse = np.linalg.inv(covariance)
    weights = np.einsum("jmn,nj->mj", inverse, missed)
    terms = all_terms(points, prior.factors)
    coefficients = np.einsum("jst,mt,mj->sj", prior.coefficients, terms, weights)
    smooth = prior.amplitude * weights
    return Correction(prior, points, coefficients, smooth, inverse, correlation, noise, noise_ratio)


def log_likelihood(prior: Prior, points: np.ndarray, missed: np.ndarray, noise: np.ndarray) -> float:
    """Return the log-likelihood of the misses of all observables, but for a constant."""
    covariance = prior.covariance(points, points) + noise.T[:, :, None] * np.eye(len(points))
    triangle = np.linalg.cholesky(covariance)
    white = np.linalg.solve(triangle, missed.T[:, :, None])
    return -float(np.sum(np.log(np.einsum("jnn->jn", triangle))) + 0.5 * np.sum(white**2))
