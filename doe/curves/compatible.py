"""Settings that data are compatible with, drawn from a likelihood by importance and Metropolis sampling."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp
from scipy.stats import qmc

Array = NDArray[np.float64]

FIRST_POINTS = 4096
"""Points that the search begins with; a power of two."""

ROUNDS, POINTS = 6, 1000
"""Rounds of sampling about the settings found, and points of each."""

WIDER = 1.5
"""Each round samples this many times as wide as the settings found scatter."""

MOVES = 90
"""Metropolis steps of each point after the rounds; they repair what importance sampling leaves at a border.
"""

LEAST_WEIGHED = 100.0
"""Points that must count in a round: until they do, the likelihood is flattened."""

NARROWEST = 3e-3
"""Least standard deviation of a round, in coded units."""


class Compatible(NamedTuple):
    """Settings that data are compatible with."""

    likely: Array
    """Settings of equal weight, shape (POINTS, settings)."""
    best: Array
    """Setting of the highest likelihood among all that were tried, shape (settings,)."""


def even_points(count: int, rng: np.random.Generator) -> Array:
    """Return Sobol points of the design's box, shape (FIRST_POINTS, count)."""
    return 2.0 * qmc.Sobol(count, rng=rng).random_base2(FIRST_POINTS.bit_length() - 1) - 1.0


def compatible_points(
    log_likelihood: Callable[[Array], Array], first: Array, rng: np.random.Generator
) -> Compatible:
    """Draw settings from a likelihood within the design's box.

    Parameters
    ----------
    log_likelihood
        Function of coded settings, shape (points, settings); minus infinity outside -1 to +1.
    first
        Points to begin with, even over the box.

    References
    ----------
    O. Cappe, A. Guillin, J. M. Marin and C. P. Robert, J. Comput. Graph. Stat. 13 (2004) 907-929.
    """
    points, logs, proposal = first, log_likelihood(first), np.zeros(len(first))
    for _ in range(ROUNDS):
        weights = _flattened(logs - proposal)
        center = weights @ points
        spread = np.cov(points.T, aweights=weights, ddof=0).reshape(len(center), -1)
        factor = np.linalg.cholesky(WIDER**2 * spread + NARROWEST**2 * np.eye(len(center)))
        normal = rng.normal(size=(POINTS, len(center)))
        points, proposal = center + normal @ factor.T, -0.5 * (normal**2).sum(axis=1)
        logs = log_likelihood(points)
    chosen = rng.choice(len(points), size=POINTS, p=_flattened(logs - proposal))
    return _moved(log_likelihood, points[chosen], logs[chosen], rng)


def _moved(
    log_likelihood: Callable[[Array], Array], points: Array, logs: Array, rng: np.random.Generator
) -> Compatible:
    """Move points by Metropolis steps as wide as they scatter, and finer ones in turn."""
    best, highest = points[int(np.argmax(logs))], float(logs.max())
    count = points.shape[1]
    for number in range(MOVES):
        spread = np.cov(points.T).reshape(count, -1) + NARROWEST**2 * np.eye(count)
        factor = np.linalg.cholesky(spread) * 2.38 / np.sqrt(count) * (1.0, 0.4, 0.15)[number % 3]
        tried = points + rng.normal(size=points.shape) @ factor.T
        found = log_likelihood(tried)
        taken = np.log(rng.uniform(size=len(tried))) < found - logs
        points, logs = np.where(taken[:, None], tried, points), np.where(taken, found, logs)
        if logs.max() > highest:
            best, highest = points[int(np.argmax(logs))], float(logs.max())
    return Compatible(points, best)


def _flattened(logs: Array) -> Array:
    """Return weights of points, from the likelihood to the largest power at which enough of them count."""
    for power in 0.5 ** np.arange(30):
        weights = np.exp(power * logs - logsumexp(power * logs))
        if 1.0 / np.sum(weights**2) >= LEAST_WEIGHED:
            break
    return np.asarray(weights)
