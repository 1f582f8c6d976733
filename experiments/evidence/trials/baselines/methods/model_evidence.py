"""The evidence of a model by sequential Monte Carlo, on the emulator's likelihood.

Particles go from the prior to the posterior through powers of the likelihood (Del Moral, Doucet and Jasra
2006), each power as much larger as halves their effective number. The covariance of the means is first that
of the optimum; a last step weighs some particles by the likelihood whose covariance changes with the
parameters.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq
from scipy.special import logsumexp

from doe.discrepancy.fitting.model_fit import Fitted, weigh

PARTICLES = 256
MOVES = 4
"""Steps of a random walk a power."""
EXACT = 16
"""Particles that are weighed by the exact covariance."""

LogLikelihood = Callable[[np.ndarray], np.ndarray]


def log_evidence(fitted: Fitted, rng: np.random.Generator) -> float:
    """Logarithm of the evidence of a model, its coded parameters uniform in their ranges.

    A direction may be either of two sides, which share the prior.
    """
    stack, whitening = fitted.stack, fitted.whitening
    constant = float(np.log(np.diag(whitening)).sum()) - 0.5 * len(stack.target) * np.log(2.0 * np.pi)

    def frozen(x: np.ndarray) -> np.ndarray:
        white = (stack.target - stack.predict(x)) @ whitening.T
        return np.asarray(constant - 0.5 * (white**2).sum(axis=1))

    total, particles = smc(frozen, stack.model.lower, stack.model.upper, rng)
    some = particles[rng.permutation(len(particles))[:EXACT]]
    exact = np.array([-0.5 * weigh(stack, x).score for x in some]) - 0.5 * len(stack.target) * np.log(
        2.0 * np.pi
    )
    total += float(logsumexp(exact - frozen(some)) - np.log(len(some)))
    return total - (np.log(2.0) if stack.model.is_directed else 0.0)


def smc(
    log_likelihood: LogLikelihood, lower: np.ndarray, upper: np.ndarray, rng: np.random.Generator
) -> tuple[float, np.ndarray]:
    """Logarithm of the evidence under a uniform prior between bounds, and particles of the posterior."""
    x = rng.uniform(lower, upper, (PARTICLES, len(lower)))
    value = log_likelihood(x)
    power, total = 0.0, 0.0
    while power < 1.0:
        step = _step(value, 1.0 - power)
        weights = step * value
        total += float(logsumexp(weights) - np.log(len(x)))
        share = np.exp(weights - logsumexp(weights))
        chosen = _resampled(share, rng)
        x, value, power = x[chosen], value[chosen], power + step
        x, value = _moved(x, value, power, log_likelihood, lower, upper, rng)
    return total, x


def _step(value: np.ndarray, most: float) -> float:
    """Largest step of the power that leaves half of the particles effective."""

    def spare(step: float) -> float:
        logs = step * value
        return float(np.exp(2.0 * logsumexp(logs) - logsumexp(2.0 * logs))) - len(value) / 2.0

    return most if spare(most) >= 0.0 else float(brentq(spare, 0.0, most, xtol=1e-12))


def _resampled(share: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Draw particles systematically."""
    ends = np.cumsum(share)
    ends[-1] = 1.0
    return np.searchsorted(ends, (np.arange(len(share)) + rng.uniform()) / len(share))


def _moved(
    x: np.ndarray,
    value: np.ndarray,
    power: float,
    log_likelihood: LogLikelihood,
    lower: np.ndarray,
    upper: np.ndarray,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Move particles by Metropolis' rule, in steps of their own spread (Roberts, Gelman and Gilks 1997)."""
    size = x.shape[1]
    covariance = np.cov(x.T).reshape(size, size) + 1e-12 * np.eye(size)
    triangle = np.linalg.cholesky(covariance) * 2.38 / np.sqrt(size)
    for scale in np.geomspace(1.0, 0.25, MOVES):
        tried = x + scale * rng.standard_normal(x.shape) @ triangle.T
        inside = ((tried >= lower) & (tried <= upper)).all(axis=1)
        new = np.where(inside, log_likelihood(np.clip(tried, lower, upper)), -np.inf)
        accepted = np.log(rng.uniform(size=len(x))) < power * (new - value)
        x = np.where(accepted[:, None], tried, x)
        value = np.where(accepted, new, value)
    return x, value
