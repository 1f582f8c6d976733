"""Bayes factors between the base and every model with one mechanism, and with two.

The evidence of each is got by sequential Monte Carlo (`evidence`). The base has half of the prior; single
mechanisms and pairs have a quarter each, shared evenly (Scott and Berger 2010: so that many models make no
alarm). Beyond `ODDS` (Kass and Raftery 1995) it raises an alarm, or names.
"""

import numpy as np
from scipy.special import logsumexp

from experiments.evidence.trials.baselines.methods.contest import judged, prior_of_one
from experiments.evidence.trials.baselines.methods.model_evidence import log_evidence
from experiments.evidence.trials.baselines.protocol import ODDS, Answer, Problem


class BayesFactors:
    """Posterior probabilities of models."""

    name = "Bayes factors"
    source = "Kass and Raftery 1995; Del Moral, Doucet and Jasra 2006"
    level = f"Bayes factor {ODDS:g}"

    def __call__(self, problem: Problem) -> Answer:
        """Weigh all models."""
        rng = np.random.default_rng(problem.seed)
        logs = {names: log_evidence(problem.fitted(names), rng) for names in problem.models}
        plain = logs.pop(())
        share = prior_of_one(len(problem.emulator.space.names))
        joint = {names: value + np.log(share[len(names)]) for names, value in logs.items()}
        total = float(logsumexp(list(joint.values())))
        weights = {names: float(np.exp(value - total)) for names, value in joint.items()}
        return judged(problem, total - plain, float(np.log(ODDS)), weights, ODDS)
