"""Calibration with a discrepancy that is a Gaussian process, after Kennedy and O'Hagan.

The measured means are y = f(theta) + delta + error. Of an observable, delta is a Gaussian process over the
conditions: of standard deviation sigma, in those of one run, and of correlation rho between any two
conditions, which are no points on a line (the exchangeable covariance of Qian, Wu and Wu 2008). Two models
are weighed by their evidence, sigma = 0 and sigma free; a Bayes factor beyond `ODDS` raises the alarm. It
says that something is missing and names nothing.

Factors are uniform in their ranges with the variance that this has, taken as normal; sigma is uniform in its
logarithm over what data of this kind can show and what would be gross (Brynjarsdottir and O'Hagan 2014 ask
for such a prior: without one, factors and discrepancy cannot be separated), rho over three values.
"""

from itertools import product

import numpy as np
from scipy.special import logsumexp

from doe.discrepancy.fitting.fitted_model import Stack
from doe.discrepancy.fitting.model_fit import Fitted, minimise, whiten
from experiments.evidence.trials.baselines.protocol import ODDS, Answer, Problem

SIGMAS = tuple(2.0 ** np.arange(-3.0, 3.1, 0.5))
CORRELATIONS = (0.0, 0.5, 0.9)
PRIOR_VARIANCE = 1.0 / 3.0
"""Variance of a coded factor, uniform from -1 to 1."""


class Discrepancy:
    """Bayes factor of a discrepancy against none."""

    name = "discrepancy"
    source = "Kennedy and O'Hagan 2001; Brynjarsdottir and O'Hagan 2014"
    level = f"Bayes factor {ODDS:g}"

    def __call__(self, problem: Problem) -> Answer:
        """Weigh both models."""
        factor = log_bayes_factor(problem.fitted())
        return Answer(score=factor, alarm=factor > float(np.log(ODDS)))


def log_bayes_factor(base: Fitted) -> float:
    """Logarithm of the Bayes factor of the base with a discrepancy against the base alone."""
    stack = base.stack
    kernels = [
        sigma**2 * discrepancy_covariance(stack, base.x, rho) for sigma, rho in product(SIGMAS, CORRELATIONS)
    ]
    plain = log_evidence(stack, base.x, base.covariance)
    first = [log_evidence(stack, base.x, base.covariance + kernel) for kernel in kernels]
    # with a discrepancy other values of the factors fit: the model is linear about those
    likeliest = base.covariance + kernels[int(np.argmax(first))]
    bounds = stack.model.lower, stack.model.upper
    x, _ = minimise(stack, whiten(likeliest), stack.target, base.x[None], *bounds)
    second = [log_evidence(stack, x[0], base.covariance + kernel) for kernel in kernels]
    return float(logsumexp(np.maximum(first, second)) - np.log(len(kernels)) - plain)


def log_evidence(stack: Stack, x: np.ndarray, covariance: np.ndarray) -> float:
    """Logarithm of the evidence of the means, the model being linear about some coded factors.

    y - f(x) + J x is normal of mean 0 and covariance C + J V J', V being the prior's.
    """
    slopes = stack.jacobian(x[None])[0]
    left = stack.target - stack.predict(x[None])[0] + slopes @ x
    whitening = whiten(covariance + PRIOR_VARIANCE * slopes @ slopes.T)
    white = whitening @ left
    return float(
        np.log(np.diag(whitening)).sum() - 0.5 * white @ white - 0.5 * len(left) * np.log(2.0 * np.pi)
    )


def discrepancy_covariance(stack: Stack, x: np.ndarray, rho: float) -> np.ndarray:
    """Covariance of the discrepancies of all means, in units of sigma squared, (means, means)."""
    columns = np.concatenate([block.columns for block in stack.blocks])
    conditions = np.repeat(np.arange(len(stack.blocks)), [len(block.columns) for block in stack.blocks])
    runs = (np.diag(stack.model.run_covariance(x, block.condition))[block.columns] for block in stack.blocks)
    sd = np.sqrt(np.concatenate(list(runs)))
    alike = np.where(conditions[:, None] == conditions, 1.0, rho)
    return np.asarray((columns[:, None] == columns) * alike * np.outer(sd, sd))
