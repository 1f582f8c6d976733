"""The scatter of runs from seed to seed: a covariance over the factors, from repeated runs.

Variances vary over the factors, so each observable's is
the exponential of a plane; correlations are taken as the same over the factors, and as alike between
conditions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

SLOPE_SD = 0.7
"""Prior standard deviation of the slopes of a log-variance over half a range: a factor of two either way."""
CORRELATION_SHRINKAGE = 0.02
"""Share of the identity in a correlation matrix, which keeps nearly equal observables apart."""
ALIKE = 100.0
"""Repeats that the correlation of all conditions is worth in that of one. In a bank of 160 repeats a
condition correlations differed between conditions by about what 100 repeats leave open."""
NEWTON_STEPS = 30


@dataclass(frozen=True, eq=False)
class Noise:
    """Covariance of one run as a function of the coded factors."""

    coefficients: np.ndarray
    """Of the log-variances, (1 + factors, observables)."""
    correlation: np.ndarray
    """(observables, observables)."""
    degrees_of_freedom: int
    """Number of independent deviations that the variances come from."""
    correlation_freedom: float
    """Number of those that the correlation is worth."""

    def variance(self, theta: np.ndarray) -> np.ndarray:
        """Variance of one run, (..., observables), at coded factors (..., factors) kept to their ranges."""
        inside = np.clip(theta, -1.0, 1.0)
        return np.asarray(np.exp(self.coefficients[0] + inside @ self.coefficients[1:]))

    def covariance(self, theta: np.ndarray) -> np.ndarray:
        """Covariance of one run at one point, (observables, observables)."""
        sd = np.sqrt(self.variance(theta))
        return np.asarray(sd[:, None] * self.correlation * sd)

    def inverse_bias(self, count: int) -> float:
        """Factor that makes the inverse of the covariance of so many observables unbiased (Wishart)."""
        return self.correlation_freedom / max(self.correlation_freedom - count - 1.0, 1.0)


def fit_noise(theta: np.ndarray, deviations: np.ndarray, floor: np.ndarray) -> Noise:
    """Fit a covariance to independent deviations of mean zero.

    Parameters
    ----------
    theta : (n, factors) array
        Coded factors of each deviation.
    deviations : (n, observables) array
        Each with the covariance of one run.
    floor : (observables,) array
        Least standard deviations: what an observable can resolve.

    Returns
    -------
    Noise
        Maximum of the penalised gamma likelihood of the squared deviations, by Fisher scoring.
    """
    squares = deviations**2 + floor**2
    planes = np.column_stack([np.ones(len(theta)), theta])
    penalty = np.diag([0.0, *np.full(theta.shape[1], SLOPE_SD**-2)])
    information = 0.5 * planes.T @ planes + penalty
    coefficients = np.zeros((planes.shape[1], squares.shape[1]))
    coefficients[0] = np.log(squares.mean(axis=0))
    for _ in range(NEWTON_STEPS):
        gradient = 0.5 * planes.T @ (squares / np.exp(planes @ coefficients) - 1.0) - penalty @ coefficients
        coefficients = coefficients + np.clip(np.linalg.solve(information, gradient), -1.0, 1.0)
    standard = deviations / np.exp(0.5 * planes @ coefficients)
    correlation = correlation_of(standard, np.ones(len(standard)))
    return Noise(coefficients, correlation, len(deviations), float(len(deviations)))


def correlation_of(standard: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Correlation of deviations (n, observables) in standard deviations, (observables, observables)."""
    size = standard.shape[1]
    moments = (weights[:, None] * standard).T @ standard / weights.sum() + 1e-9 * np.eye(size)
    scale = np.sqrt(np.diag(moments))
    correlation = moments / (scale[:, None] * scale)
    return np.asarray((1.0 - CORRELATION_SHRINKAGE) * correlation + CORRELATION_SHRINKAGE * np.eye(size))


def shared_correlations(noises: Sequence[Noise]) -> list[Noise]:
    """Let conditions learn from one another how observables hang together.

    The correlation of each is drawn towards the mean of all: the mean of a Wishart posterior whose prior is
    worth `ALIKE` repeats.
    """
    counts = np.array([noise.degrees_of_freedom for noise in noises], dtype=float)
    mean = np.average([noise.correlation for noise in noises], axis=0, weights=counts)
    out = []
    for noise, count in zip(noises, counts, strict=True):
        share = ALIKE / (ALIKE + count) if len(noises) > 1 else 0.0
        # Neither are all conditions alike, nor is their mean known without error.
        variance = (1.0 - share) / count + share**2 / counts.sum()
        correlation = share * mean + (1.0 - share) * noise.correlation
        out.append(replace(noise, correlation=correlation, correlation_freedom=1.0 / variance))
    return out


def fit_growth(size: np.ndarray, ratios: np.ndarray) -> np.ndarray:
    """Fit exp(growth x size) to the mean of squared deviations over the variance that they have at size 0.

    Parameters
    ----------
    size : (n,) array
        Coded sizes.
    ratios : (n, observables) array

    Returns
    -------
    (observables,) array
        Maximum of the gamma likelihood, with the prior of a slope, by Fisher scoring.
    """
    growth = np.zeros(ratios.shape[1])
    information = 0.5 * np.sum(size**2) + SLOPE_SD**-2
    for _ in range(NEWTON_STEPS):
        surplus = ratios / np.exp(size[:, None] * growth) - 1.0
        step = (0.5 * size @ surplus - growth * SLOPE_SD**-2) / information
        growth = growth + np.clip(step, -1.0, 1.0)
    return np.asarray(growth)


def repeat_deviations(groups: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Deviations of repeated runs from their means, independent and of the covariance of one run.

    A group of r repeats gives r - 1 (Helmert's contrasts).

    Parameters
    ----------
    groups : (n,) array
        Runs of the same number are repeats.
    values : (n, observables) array

    Returns
    -------
    rows : (m,) int array
        A run of the group of each deviation.
    deviations : (m, observables) array
    """
    order = np.argsort(groups, kind="stable")
    rows, deviations = [], []
    start = 0
    for index in range(1, len(order) + 1):
        if index == len(order) or groups[order[index]] != groups[order[start]]:
            members = order[start:index]
            for r in range(1, len(members)):
                rows.append(members[r])
                contrast = values[members[r]] - values[members[:r]].mean(axis=0)
                deviations.append(contrast * np.sqrt(r / (r + 1.0)))
            start = index
    return np.array(rows, dtype=int), np.array(deviations).reshape(len(rows), values.shape[1])
