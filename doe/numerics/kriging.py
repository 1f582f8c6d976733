"""Kriging: a smooth random function of the coded parameters, known at noisy points.

The covariance is amplitude x exp(-|x - x'|^2 / 2), with the parameters divided by their lengths (Rasmussen
and Williams 2006, chapter 2).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.linalg.lapack import dpotri
from scipy.optimize import minimize

LENGTH_RANGE = (0.3, 6.0)
"""Lengths that a fit may find, in coded units: shorter ones would follow the noise."""
START_AMPLITUDE, START_LENGTH = 0.5, 0.6
"""Start of the search: from longer lengths it may end where nothing is smooth."""
AMPLITUDE_RANGE = (1e-3, 1e2)
"""Amplitudes that a fit may find, in units of the variance of the data."""
NOISY_RANGES = (1e-2, 1e2), (0.4, 8.0), (1e-4, 2.0)
"""Amplitudes, lengths and variances of the noise that a fit with unknown noise may find."""
NOISY_STARTS = (0.7, 1.0, 0.2), (10.0, 2.0, 0.02)
"""Amplitude, length and noise that it starts from, the noise large or small: the likelihood has two humps."""
MOST_SEARCHED = 500
"""Points on which a fit searches, drawn from more: a step of the search costs their number's third power."""


@dataclass(frozen=True, eq=False)
class Covariance:
    """Covariance of a smooth function before the data."""

    amplitude: float
    """Variance of the function."""
    length: np.ndarray
    """Length of each parameter, in coded units, (parameters,)."""

    def __call__(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Covariance between points (m, parameters) and (n, parameters), (m, n)."""
        return np.asarray(self.amplitude * squared_exponential(a / self.length, b / self.length))


@dataclass(frozen=True, eq=False)
class Kriging:
    """A smooth function known at noisy points."""

    points: np.ndarray
    """(n, parameters)."""
    covariance: Covariance
    weights: np.ndarray
    """Inverse covariance of the data times the data, (n,)."""
    inverse: np.ndarray
    """Inverse covariance of the data, (n, n)."""

    def mean(self, x: np.ndarray) -> np.ndarray:
        """Return the expected value at points (m, parameters), (m,)."""
        return np.asarray(self.covariance(x, self.points) @ self.weights)

    def variance(self, x: np.ndarray) -> np.ndarray:
        """Return the variance at points (m, parameters), (m,)."""
        known = self.covariance(x, self.points)
        explained = ((known @ self.inverse) * known).sum(axis=1)
        return np.asarray(np.maximum(self.covariance.amplitude - explained, 0.0))

    @property
    def leave_one_out(self) -> np.ndarray:
        """Residual of each datum from the others (ibid., equation 5.12), (n,)."""
        return np.asarray(self.weights / np.diag(self.inverse))

    @property
    def standard(self) -> np.ndarray:
        """The same over the standard deviation that is expected of it (ibid., equation 5.12), (n,)."""
        return np.asarray(self.weights / np.sqrt(np.diag(self.inverse)))


def squared_exponential(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return exp(-|a_i - b_j|^2 / 2) of scaled points (m, p) and (n, p), (m, n)."""
    squares = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2.0 * a @ b.T
    return np.asarray(np.exp(-0.5 * np.maximum(squares, 0.0)))


def krige(points: np.ndarray, values: np.ndarray, noise: np.ndarray, covariance: Covariance) -> Kriging:
    """Condition a function of known covariance on data (n,) with known variances of their noise (n,)."""
    of_data = covariance(points, points) + np.diag(noise)
    inverse = cho_solve(cho_factor(of_data), np.eye(len(points)))
    return Kriging(points, covariance, inverse @ values, inverse)


def fit_kriging(points: np.ndarray, values: np.ndarray, noise: np.ndarray) -> Kriging:
    """Find amplitude and lengths of largest marginal likelihood, for known noise variances (n,).

    At most `MOST_SEARCHED` points are searched, drawn from more; the function is known at all of them.
    """
    scale = float(np.sqrt(np.mean(values**2)))
    start = np.log([START_AMPLITUDE, *[START_LENGTH] * points.shape[1]])
    bounds = np.log([AMPLITUDE_RANGE, *[LENGTH_RANGE] * points.shape[1]])
    few = _searched(len(points))
    data = (points[few], values[few] / scale, noise[few] / scale**2)
    found = np.exp(minimize(_loss, start, data, method="L-BFGS-B", jac=True, bounds=bounds).x)
    return krige(points, values, noise, Covariance(float(found[0]) * scale**2, found[1:]))


def fit_noisy_kriging(points: np.ndarray, values: np.ndarray) -> tuple[Kriging, float]:
    """Find amplitude, lengths and one noise variance of largest likelihood; return that variance as well.

    At most `MOST_SEARCHED` points are searched, drawn from more; the function is known at all of them.
    """
    scale, size = float(np.sqrt(np.mean(values**2))) or 1.0, points.shape[1]
    amplitudes, lengths, noises = NOISY_RANGES
    bounds = np.log([amplitudes, *[lengths] * size, noises])
    starts = (np.log([amplitude, *[length] * size, noise]) for amplitude, length, noise in NOISY_STARTS)
    few = _searched(len(points))
    data = (points[few], values[few] / scale, None)
    fits = [minimize(_loss, start, data, method="L-BFGS-B", jac=True, bounds=bounds) for start in starts]
    found = np.exp(min(fits, key=lambda one: float(one.fun)).x)
    noise = float(found[-1]) * scale**2
    covariance = Covariance(float(found[0]) * scale**2, found[1:-1])
    return krige(points, values, np.full(len(points), noise), covariance), noise


def _searched(count: int) -> slice | np.ndarray:
    """Return the points on which a fit searches."""
    if count <= MOST_SEARCHED:
        return slice(None)
    return np.random.default_rng(0).choice(count, MOST_SEARCHED, replace=False)


def _loss(
    logarithms: np.ndarray, points: np.ndarray, values: np.ndarray, noise: np.ndarray | None
) -> tuple[float, np.ndarray]:
    """Compute minus the log marginal likelihood but for a constant, and its slopes (ibid., equation 5.9).

    The slope by a length is a sum over all pairs of runs, of their squared distance times a weight: row sums
    of the weights replace a matrix of distances. Logarithms are those of the amplitude, of each length and,
    where ``noise`` is None, of its variance.
    """
    size = points.shape[1]
    amplitude, scaled = np.exp(logarithms[0]), points / np.exp(logarithms[1 : 1 + size])
    variances = np.full(len(points), np.exp(logarithms[-1])) if noise is None else noise
    smooth = amplitude * squared_exponential(scaled, scaled)
    factor = cho_factor(smooth + np.diag(variances), lower=True, overwrite_a=True, check_finite=False)
    weights = cho_solve(factor, values, check_finite=False)
    inverse, _ = dpotri(factor[0], lower=1)  # its lower triangle: each pair of runs once
    pull = np.tril(smooth * (np.outer(weights, weights) - inverse))
    pull[np.diag_indices_from(pull)] *= 0.5
    of_each = pull.sum(axis=0) + pull.sum(axis=1)
    by_length = of_each @ scaled**2 - 2.0 * (scaled * (pull @ scaled)).sum(axis=0)
    by_noise = [] if noise is not None else [0.5 * variances[0] * (weights @ weights - np.trace(inverse))]
    loss = 0.5 * values @ weights + np.log(np.diag(factor[0])).sum()
    return float(loss), -np.concatenate([[pull.sum()], by_length, by_noise])
