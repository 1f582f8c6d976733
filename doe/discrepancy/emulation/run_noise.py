"""Scatter of runs from seed to seed: a covariance over the factors, from repeated runs.

Variances vary over the factors: each observable's is the exponential of a plane. The repeats determine how
alike planes and correlations of the conditions are, since a single condition has few repeats.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

SLOPE_SD = 0.7
"""Prior standard deviation of the slopes of a log-variance over half a range: a factor of two either way."""
FIRST_APART = 0.3
"""Standard deviation of a condition's coefficient about the common one, before the repeats are used."""
LEAST_APART = 0.01
"""Least such standard deviation."""
CORRELATION_SHRINKAGE = 0.02
"""Share of the identity in a correlation matrix, which keeps nearly equal observables apart."""
ALIKE = 100.0
"""Weight of the correlation of all conditions in that of one, in repeats: a bank of 160 repeats per condition
showed differences of about the error of 100 repeats."""
NEWTON_STEPS = 30
CONVERGED = 1e-6
"""Longest last step of a converged fit, in the logarithm of a variance."""
EM_STEPS = 30


@dataclass(frozen=True, eq=False)
class Noise:
    """Covariance of one run as a function of the coded factors."""

    coefficients: np.ndarray
    """Coefficients of the log-variances, (1 + factors, observables)."""
    spread: np.ndarray
    """Covariance of their errors, the same for all observables, (1 + factors, 1 + factors)."""
    correlation: np.ndarray
    """(observables, observables)."""
    degrees_of_freedom: int
    """Number of independent deviations behind the variances."""
    correlation_freedom: float
    """Number of deviations behind the correlation."""

    def variance(self, theta: np.ndarray) -> np.ndarray:
        """Return the variance of one run at coded factors within their ranges, (..., observables).

        It is the mean over its uncertainty: weights are its inverse, and the inverse of an estimate from n
        squares is n / (n - 2) times too large. A logarithm of variance v = 2 / n makes that exp(v).
        """
        planes = _planes(np.minimum(np.maximum(theta, -1.0), 1.0))  # faster than clip for one point
        open_ = ((planes @ self.spread) * planes).sum(axis=-1, keepdims=True)
        return np.asarray(np.exp(planes @ self.coefficients + open_))

    def covariance(self, theta: np.ndarray) -> np.ndarray:
        """Return the covariance of one run at one point, (observables, observables)."""
        sd = np.sqrt(self.variance(theta))
        return np.asarray(sd[:, None] * self.correlation * sd)

    def inverse_bias(self, count: int) -> float:
        """Return the factor that makes the inverse covariance of ``count`` observables unbiased (Wishart).

        The bias due to the variances is taken out.
        """
        freedom = self.correlation_freedom
        return max(freedom - 2.0, 1.0) / max(freedom - count - 1.0, 1.0)


def fit_noises(repeats: Sequence[tuple[np.ndarray, np.ndarray]], floor: np.ndarray) -> list[Noise]:
    """Fit the covariances of some conditions together.

    Each condition has coded factors (n, factors) and deviations (n, observables) with the covariance of one
    run. A plane is the common one plus the condition's own difference; all observables together determine the
    size of the differences. Two dozen repeats alone leave a variance open by a factor of 1.5. ``floor`` is
    the resolution of the observables, as a standard deviation. Fisher scoring maximises the penalised gamma
    likelihood of the squared deviations; expectation and maximisation find the penalties.
    """
    planes = [_planes(theta) for theta, _ in repeats]
    maps = _maps(len(repeats), planes[0].shape[1])
    terms = np.concatenate([own @ onto for own, onto in zip(planes, maps, strict=True)])
    squares = np.concatenate([deviations for _, deviations in repeats]) ** 2 + floor**2
    coefficients, spread = _fit_planes(terms, squares, planes[0].shape[1])
    noises = []
    for own, onto, (_, deviations) in zip(planes, maps, repeats, strict=True):
        plane = onto @ coefficients
        standard = deviations / np.exp(0.5 * own @ plane)
        correlation = correlation_of(standard, np.ones(len(standard)))
        count = len(deviations)
        noises.append(Noise(plane, onto @ spread @ onto.T, correlation, count, float(count)))
    return shared_correlations(noises)


def _planes(theta: np.ndarray) -> np.ndarray:
    """Return the terms of a plane at coded factors (..., factors), (..., 1 + factors)."""
    terms = np.ones((*theta.shape[:-1], 1 + theta.shape[-1]))
    terms[..., 1:] = theta
    return terms


def _maps(conditions: int, size: int) -> list[np.ndarray]:
    """Return the map from all coefficients, common ones first, to the plane of each condition."""
    if conditions == 1:
        return [np.eye(size)]
    own = np.eye(conditions * size).reshape(conditions, size, conditions * size)
    return [np.concatenate([np.eye(size), one], axis=1) for one in own]


def _fit_planes(terms: np.ndarray, squares: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return coefficients (terms, observables) of log-variances and the covariance of their errors.

    The first ``size`` are those of the common plane, the others differences of conditions.
    """
    coefficients = np.zeros((terms.shape[1], squares.shape[1]))
    coefficients[0] = np.log(squares.mean(axis=0))
    shared = np.append(0.0, np.full(size - 1, SLOPE_SD**-2))
    apart = np.full(size, FIRST_APART**2)
    for _ in range(EM_STEPS):
        penalty = np.diag(np.concatenate([shared, *[1.0 / apart] * (terms.shape[1] // size - 1)]))
        spread = np.linalg.inv(0.5 * terms.T @ terms + penalty)
        for _ in range(NEWTON_STEPS):
            surplus = squares / np.exp(terms @ coefficients) - 1.0
            step = np.clip(spread @ (0.5 * terms.T @ surplus - penalty @ coefficients), -1.0, 1.0)
            coefficients = coefficients + step
            if np.abs(step).max() < CONVERGED:
                break
        moments = (coefficients**2).mean(axis=1) + np.diag(spread)
        own = moments[size:].reshape(-1, size)
        if not len(own):
            break
        apart = np.maximum(own.mean(axis=0), LEAST_APART**2)
    return coefficients, spread


def correlation_of(standard: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the correlation of standardised deviations (n, observables), (observables, observables)."""
    size = standard.shape[1]
    moments = (weights[:, None] * standard).T @ standard / weights.sum() + 1e-9 * np.eye(size)
    scale = np.sqrt(np.diag(moments))
    correlation = moments / (scale[:, None] * scale)
    return np.asarray((1.0 - CORRELATION_SHRINKAGE) * correlation + CORRELATION_SHRINKAGE * np.eye(size))


def shared_correlations(noises: Sequence[Noise]) -> list[Noise]:
    """Draw the correlation of each condition towards the mean of all.

    It is the mean of a Wishart posterior whose prior has the weight of `ALIKE` repeats.
    """
    counts = np.array([noise.degrees_of_freedom for noise in noises], dtype=float)
    mean = np.average([noise.correlation for noise in noises], axis=0, weights=counts)
    out = []
    for noise, count in zip(noises, counts, strict=True):
        share = ALIKE / (ALIKE + count) if len(noises) > 1 else 0.0
        # conditions differ, and their mean has an error
        variance = (1.0 - share) / count + share**2 / counts.sum()
        correlation = share * mean + (1.0 - share) * noise.correlation
        out.append(replace(noise, correlation=correlation, correlation_freedom=1.0 / variance))
    return out


def fit_growth(size: np.ndarray, ratios: np.ndarray) -> np.ndarray:
    """Fit exp(growth x size) to ratios (n, observables) of squared deviations to the variance at size 0.

    It is the maximum of the gamma likelihood, with the prior of a slope, by Fisher scoring, (observables,).
    """
    growth = np.zeros(ratios.shape[1])
    information = 0.5 * np.sum(size**2) + SLOPE_SD**-2
    for _ in range(NEWTON_STEPS):
        surplus = ratios / np.exp(size[:, None] * growth) - 1.0
        step = (0.5 * size @ surplus - growth * SLOPE_SD**-2) / information
        growth = growth + np.clip(step, -1.0, 1.0)
    return np.asarray(growth)


def repeat_deviations(groups: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return independent deviations of repeated runs, each with the covariance of one run.

    A group of r repeats gives r - 1 (Helmert's contrasts). Runs of the same group number are repeats. The
    first array is a run of the group of each deviation, (m,), the second the deviations, (m, observables).
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
