"""A classifier of models: gradient boosting over the bank's signatures in the residuals of the base.

Means are drawn from the base, every mechanism and every pair as for `sbi`. The base is fitted to each draw;
the scores of what it leaves along the signature of each mechanism, its sum of squares and its factors are
what the trees see. Their probabilities raise the alarm and name as Bayes factors do, and the named model is
checked as theirs is. The trees of a bank and library serve all its trials.
"""

from collections.abc import Hashable
from typing import Any

import numpy as np

from doe.discrepancy.contest.signatures import signatures
from doe.discrepancy.fitting.model_fit import Fitted, minimise, weigh
from experiments.evidence.trials.baselines.methods.contest import by_posterior
from experiments.evidence.trials.baselines.methods.inference import drawn_means
from experiments.evidence.trials.baselines.protocol import ODDS, Answer, Mechanisms, Problem

ITERATIONS, LEAVES, RATE, STEPS = 120, 8, 0.1, 8
"""Rounds of boosting, leaves of a tree, its rate of learning, and steps of the fit of the base to a draw."""


class Boosting:
    """Probabilities of models by boosted trees."""

    name = "boosted trees"
    source = "Friedman 2001; Ke et al. 2017 (`scikit-learn`)"
    level = f"odds of {ODDS:g}"

    def __init__(self) -> None:
        self._learned: dict[Hashable, tuple[Any, Fitted, tuple[Mechanisms, ...]]] = {}

    def __call__(self, problem: Problem) -> Answer:
        """Look at the scores of the measured means."""
        if problem.key not in self._learned:
            self._learned[problem.key] = _learn(problem)
        trees, reference, models = self._learned[problem.key]
        found = np.zeros(len(models))
        found[trees.classes_] = trees.predict_proba(features(reference, problem.stack(()).target[None]))[0]
        return by_posterior(problem, models, found)


def _learn(problem: Problem) -> tuple[Any, Fitted, tuple[Mechanisms, ...]]:
    from sklearn.ensemble import HistGradientBoostingClassifier

    stack = problem.stack(())
    reference = weigh(stack, np.zeros(len(stack.model.lower)))
    drawn = drawn_means(problem, np.random.default_rng(problem.seed))
    trees = HistGradientBoostingClassifier(
        max_iter=ITERATIONS, max_leaf_nodes=LEAVES, learning_rate=RATE, random_state=problem.seed
    )
    return trees.fit(features(reference, drawn.means), drawn.model), reference, drawn.models


def features(reference: Fitted, means: np.ndarray) -> np.ndarray:
    """Scores along signatures, sums of squares and factors of the base, fitted to means (n, means)."""
    stack, seen = reference.stack, signatures(reference)
    starts, model = np.repeat(reference.x[None], len(means), axis=0), stack.model
    x, q = minimise(stack, reference.whitening, means, starts, model.lower, model.upper, STEPS)
    left = (means - stack.predict(x)) @ reference.whitening.T
    directions = np.concatenate([seen.directions, seen.turned_directions.reshape(-1, left.shape[1])])
    return np.column_stack([left @ directions.T, np.log(q), x])
