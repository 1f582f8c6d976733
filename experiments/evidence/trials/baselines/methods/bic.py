"""Schwarz's criterion for the base and every model with one mechanism, and with two.

BIC = -2 log L + k log n, n being the number of the means. Minus half of it approximates the logarithm of the
evidence; a difference of 6 is *strong* (Raftery 1995).
"""

import numpy as np
from scipy.special import logsumexp

from experiments.evidence.trials.baselines.methods.contest import judged
from experiments.evidence.trials.baselines.protocol import ODDS, Answer, Mechanisms, Problem

STRONG = 6.0
"""Difference that raises an alarm."""


class Bic:
    """Differences of BIC."""

    name = "BIC"
    source = "Schwarz 1978; Raftery 1995"
    level = f"difference of {STRONG:g}"

    def __call__(self, problem: Problem) -> Answer:
        """Compare all models."""
        values = {names: criterion(problem, names) for names in problem.models}
        plain = values.pop(())
        logs = {names: -0.5 * value for names, value in values.items()}
        total = logsumexp(list(logs.values()))
        weights = {names: float(np.exp(value - total)) for names, value in logs.items()}
        return judged(problem, plain - min(values.values()), STRONG, weights, ODDS)


def criterion(problem: Problem, mechanisms: Mechanisms) -> float:
    """BIC of a model, but for what all have alike."""
    fitted = problem.fitted(mechanisms)
    return fitted.score + len(fitted.x) * float(np.log(len(fitted.covariance)))
