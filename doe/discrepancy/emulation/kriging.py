"""Kriging: what a polynomial misses, as a smooth random function of the coded parameters.

The covariance is amplitude x exp(-|x - x'|^2 / 2) of parameters divided by their lengths (Rasmussen and
Williams 2006, chapter 2).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

LENGTH_RANGE = (0.3, 6.0)
"""Lengths that a fit may find, in coded units: shorter ones would follow the noise."""
START_LENGTH = 0.6
"""Start of the search for lengths: from longer ones it may end where nothing is smooth."""
AMPLITUDE_RANGE = (1e-3, 1e2)
"""Amplitudes that a fit may find, in units of the variance of the data."""


@dataclass(frozen=True, eq=False)
class Kriging:
    """A smooth function known at noisy points."""

    points: np.ndarray
    """(n, parameters)."""
    length: np.ndarray
    """(parameters,)."""
    amplitude: float
    """Variance of the function before the data."""
    weights: np.ndarray
    """Inverse covariance of the data times the data, (n,)."""
    inverse: np.ndarray
    """That inverse, (n, n)."""

    def mean(self, x: np.ndarray) -> np.ndarray:
        """Expected value at points (m, parameters), (m,)."""
        return np.asarray(self._covariance(x) @ self.weights)

    def variance(self, x: np.ndarray) -> np.ndarray:
        """Variance at points (m, parameters), (m,)."""
        known = self._covariance(x)
        explained = np.einsum("mi,ij,mj->m", known, self.inverse, known)
        return np.asarray(np.maximum(self.amplitude - explained, 0.0))

    @property
    def leave_one_out(self) -> np.ndarray:
        """Residual of each datum from the others (ibid., equation 5.12), (n,)."""
        return np.asarray(self.weights / np.diag(self.inverse))

    def _covariance(self, x: np.ndarray) -> np.ndarray:
        return self.amplitude * squared_exponential(x / self.length, self.points / self.length)


def squared_exponential(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """exp(-|a_i - b_j|^2 / 2) of scaled points (m, p) and (n, p), (m, n)."""
    squares = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2.0 * a @ b.T
    return np.asarray(np.exp(-0.5 * np.maximum(squares, 0.0)))


def krige(
    points: np.ndarray, values: np.ndarray, noise: np.ndarray, amplitude: float, length: np.ndarray
) -> Kriging:
    """Condition a function of known amplitude and lengths on data.

    Parameters
    ----------
    points : (n, parameters) array
    values, noise : (n,) array
        Data and the variances of their noise.
    amplitude : float
    length : (parameters,) array
    """
    scaled = points / length
    covariance = amplitude * squared_exponential(scaled, scaled) + np.diag(noise)
    inverse = cho_solve(cho_factor(covariance), np.eye(len(points)))
    return Kriging(points, length, amplitude, inverse @ values, inverse)


def fit_kriging(points: np.ndarray, values: np.ndarray, noise: np.ndarray) -> Kriging:
    """Find amplitude and lengths of largest marginal likelihood, then condition on the data.

    Parameters
    ----------
    points : (n, parameters) array
    values, noise : (n,) array
    """
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel

    scale = float(np.sqrt(np.mean(values**2)))
    kernel = ConstantKernel(0.5, AMPLITUDE_RANGE) * RBF(np.full(points.shape[1], START_LENGTH), LENGTH_RANGE)
    process = GaussianProcessRegressor(kernel, alpha=noise / scale**2)
    with warnings.catch_warnings():
        # An amplitude or a length at the end of its range is an answer, not a failure.
        warnings.simplefilter("ignore", ConvergenceWarning)
        process.fit(points, values / scale)
    constant, radial = process.kernel_.k1, process.kernel_.k2
    lengths = np.broadcast_to(np.asarray(radial.length_scale), points.shape[1])
    return krige(points, values, noise, float(constant.constant_value) * scale**2, np.array(lengths))
