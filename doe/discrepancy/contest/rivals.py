"""Rivals: when it stays open which of two models is right.

The noise of the measured means is in the residuals of both, and moves both Qs alike. What the bank and fresh
runs leave open of a prediction is in the residuals of that model alone: two emulators of one truth err each
by itself, and their Qs part though nothing parts the models.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import stats

from doe.discrepancy.contest.signatures import projector
from doe.discrepancy.fitting.model_fit import Fitted

CHANCE = 1.645
"""Standard deviations that a normal number passes upwards in one case of twenty."""


def is_open(behind: float, apart: float, margin: float, parting: float = 0.0) -> bool:
    """Say if it stays open which of two models is right, one of which is so much behind.

    Of models d standard deviations apart the wrong one is behind by d^2 +- 2 d. Two that should look the
    same, their d^2 being below the margin, are told apart where chance does so in one case of twenty at most.
    The right one is behind by -d^2 +- (4 d^2 + parting^2)^.5. Where that passes the margin in more cases than
    one of twenty, as it does if little is known of the predictions, it takes so much more to tell them apart.

    Parameters
    ----------
    behind : float
        In Q, held-out conditions included.
    apart : float
        d^2 as it was shown; infinite where the two are of several mechanisms.
    margin : float
    parting : float
        Of the two (`parting`).
    """
    needed = _margin_of_alike(margin) if apart < margin else margin
    if math.isfinite(apart):
        needed = max(needed, CHANCE * (4.0 * apart + parting**2) ** 0.5 - apart)
    return behind < needed


def _margin_of_alike(margin: float) -> float:
    return margin + 2.0 * CHANCE * margin**0.5


def telling_apart(margin: float, power: float) -> float:
    """Compute the Q between two models at which they are told apart with so much power (`is_open`).

    The wrong one is behind by d^2 +- 2 d, which passes the margin of models that look the same.
    """
    z = float(stats.norm.ppf(power))
    return float((z + (z**2 + _margin_of_alike(margin)) ** 0.5) ** 2)


def lag(score: float, sure: float, margin: float) -> float:
    """Distance of a model behind the best in minus twice the log-likelihood.

    The likelihood of a model suffers where its predictions are uncertain, as they are before it has been run
    enough, and that of the best gains by every run of it: that says how much is known of a model, and
    nothing of the data. It counts for half a tie at most: a model that is named is ahead without it, too.

    Parameters
    ----------
    score, sure : float
        Differences to the best of minus twice the log-likelihood, and of `certain`.
    margin : float
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
    """Standard deviation of the difference of the Qs of two refitted models, if both predict the truth.

    With residuals u + e, u being common to both and e of covariance E each model's own, Q is r' G r, and of
    normal residuals cov(r' G r, s' H s) = 2 tr(G cov(r, s) H cov(s, r)).

    Parameters
    ----------
    one, other : Fitted
        Weighed on the same means.

    Returns
    -------
    float
        0 if nothing is open of either prediction.
    """
    metrics, variance = [], 0.0
    for fitted in (one, other):
        project = projector(fitted.sensitivities)
        metrics.append((fitted.whitening.T @ project @ fitted.whitening) @ _shared(fitted))
        variance += 2.0 * float(np.trace(project))
    variance -= 4.0 * float(np.sum(metrics[0] * metrics[1].T))
    return max(variance, 0.0) ** 0.5


def _shared(fitted: Fitted) -> np.ndarray:
    """Covariance of the residuals but for what is open of the prediction, (means, means)."""
    return np.asarray(fitted.covariance - fitted.stack.open_error(fitted.x))
