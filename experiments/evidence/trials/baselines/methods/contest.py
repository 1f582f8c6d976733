"""Answers from the weights of models, for methods that compare them.

Such a comparison says which model is best, and not that it is good. So the best is also checked by the sum
of squares of its residuals, as the authors of both criteria ask (Gelman, Meng and Stern 1996; Burnham and
Anderson 2002): a model that fails is not named, and what is missing is said to be unknown.
"""

from collections.abc import Mapping, Sequence
from math import comb

import numpy as np
from scipy import stats

from experiments.evidence.trials.baselines.protocol import ODDS, Answer, Mechanisms, Problem

FIT_LEVEL = 0.05
"""Probability that a true model fails the check."""


def surprise(q: float, freedom: int) -> float:
    """Minus the decimal logarithm of the p value of a sum of squares; its asymptote where that underflows."""
    log_p = float(stats.chi2.logsf(q, freedom))
    return (-log_p if np.isfinite(log_p) else 0.5 * q) / float(np.log(10.0))


def prior_of_one(count: int) -> dict[int, float]:
    """Probability of one model of a number of mechanisms from the library, if any is right.

    Single ones have half, pairs half, shared evenly (Scott and Berger 2010).
    """
    return {1: 0.5 / count, 2: 0.5 / max(comb(count, 2), 1)}


def by_posterior(problem: Problem, models: Sequence[Mechanisms], found: np.ndarray) -> Answer:
    """Answer from probabilities of models, the base first."""
    plain, others = float(found[0]), found[1:].clip(1e-12)
    weights = dict(zip(models[1:], (others / others.sum()).tolist(), strict=True))
    score = float(np.log(others.sum()) - np.log(max(plain, 1e-12)))
    return judged(problem, score, float(np.log(ODDS)), weights, ODDS)


def judged(
    problem: Problem, score: float, limit: float, weights: Mapping[Mechanisms, float], odds: float
) -> Answer:
    """Name every mechanism that has such odds to be in the model (Barbieri and Berger 2004).

    Where none has, single mechanisms that share them are a tie.
    """
    best = problem.fitted(max(weights, key=weights.__getitem__))
    against = surprise(best.q, best.freedom)
    alarm, fails = bool(score > limit), against > -np.log10(FIT_LEVEL)
    named, tied = _names(weights, odds / (1.0 + odds)) if alarm and not fails else ((), False)
    return Answer(score, alarm, named, tied, unknown=alarm and fails, outside=against)


def _names(weights: Mapping[Mechanisms, float], least: float) -> tuple[Mechanisms, bool]:
    """Mechanisms of at least such a probability, or single ones that share it, and whether they are a tie."""
    everyone = sorted({name for names in weights for name in names})
    included = {name: sum(w for names, w in weights.items() if name in names) for name in everyone}
    sure = tuple(name for name in everyone if included[name] >= least)
    if sure:
        return sure, False
    ranked = sorted(weights, key=lambda names: -weights[names])
    close = ranked[: int(np.searchsorted(np.cumsum([weights[names] for names in ranked]), least)) + 1]
    if all(len(names) == 1 for names in close):
        return tuple(sorted(name for names in close for name in names)), True
    return (), False
