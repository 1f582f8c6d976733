"""Rivals: cases in which it is open which of two models is right.

The noise of the measured means is in the residuals of both models and moves both Qs alike. The error of each
prediction is in the residuals of that model alone: two emulators of one truth err independently, and their Qs
differ although the models do not.
"""

import math

import numpy as np
from scipy import stats
from scipy.special import expit

from doe.discrepancy.contest.signatures import projector
from doe.discrepancy.fitting.model_fit import Fitted

CHANCE = 1.645
"""Standard deviations that a normal number passes upwards in one case of twenty."""
LEAST_CHANCE = 1e-9
"""Variance of a lag below which nothing is left to chance."""


def is_open(behind: float, apart: float, margin: float, parting: float = 0.0) -> bool:
    """Return True if it is open which of two models is right, given how far one is behind in Q (`needed`)."""
    return behind < needed(apart, margin, parting)


def needed(apart: float, margin: float, parting: float = 0.0) -> float:
    """Compute how far a model must be behind in Q so that the other is right.

    Of models d standard deviations apart (``apart`` = d^2; infinite for several mechanisms) the wrong one is
    behind by d^2 +- 2 d. Two that look the same, with d^2 below the margin, are distinguished where chance
    does so in at most one case of twenty. The right one is behind by -d^2 +- (4 d^2 + parting^2)^.5; where
    that passes the margin in more than one case of twenty, the margin grows accordingly.
    """
    alike = margin + 2.0 * CHANCE * margin**0.5
    least = alike if apart < margin else margin
    if math.isfinite(apart):
        least = max(least, CHANCE * (4.0 * apart + parting**2) ** 0.5 - apart)
    return least


def settling(behind: float, gain: float, needed: float, parting: float) -> float:
    """Compute the probability that further data settle which of two models is right.

    If both were equally likely before, the odds are exp(behind / 2) for the best one. Data in which the two
    are d standard deviations further apart (``gain`` = d^2) bring the right one ahead by
    d^2 +- (4 d^2 + parting^2)^.5: the next search has fresh runs of its own.
    """
    right, sd = expit(behind / 2.0), max(4.0 * gain + parting**2, LEAST_CHANCE) ** 0.5
    of_best, of_other = stats.norm.cdf((gain - needed + np.array([behind, -behind])) / sd)
    return float(right * of_best + (1.0 - right) * of_other)


def lag(score: float, sure: float, margin: float) -> float:
    """Return the distance of a model behind the best in minus twice the log-likelihood.

    The likelihood of a model is low where its predictions are uncertain, as before it has been run enough,
    and that of the best gains by every run of it: that describes the knowledge of a model, not the data. It
    counts for half a tie at most: a named model is ahead without it, too. ``sure`` is the difference of
    `certain`.
    """
    return min(score, sure + margin / 2.0)


def certain(fitted: Fitted) -> float:
    """Compute minus twice the log-likelihood, refitted, as if its predictions were certain.

    That is Q with the logarithm of the determinant of the noise alone. Q without it favours mechanisms under
    which the observations scatter more.
    """
    q = float(np.sum((projector(fitted.sensitivities) @ fitted.residuals) ** 2))
    return q + float(np.linalg.slogdet(_shared(fitted))[1])


def parting(one: Fitted, other: Fitted) -> float:
    """Return the standard deviation of the difference of the Qs of two refitted models, if both are right.

    With residuals u + e, u common to both and e of covariance E each model's own, Q is r' G r, and of normal
    residuals cov(r' G r, s' H s) = 2 tr(G cov(r, s) H cov(s, r)). Both are weighed on the same means. It is 0
    if nothing is open of either prediction.
    """
    metrics, variance = [], 0.0
    for fitted in (one, other):
        project = projector(fitted.sensitivities)
        metrics.append((fitted.whitening.T @ project @ fitted.whitening) @ _shared(fitted))
        variance += 2.0 * float(np.trace(project))
    variance -= 4.0 * float(np.sum(metrics[0] * metrics[1].T))
    return max(variance, 0.0) ** 0.5


def _shared(fitted: Fitted) -> np.ndarray:
    """Return the covariance of the residuals without the error of the prediction, (means, means)."""
    return np.asarray(fitted.covariance - fitted.stack.open_error(fitted.x))
