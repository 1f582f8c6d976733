"""The lasso over signatures of mechanisms in the residuals of the calibrated base.

Residuals are whitened and freed of what a refit of the factors takes up, and so are the signatures: a sparse
linear model of noise 1, whose coefficients are the sizes, none negative. The penalty is that of the least
BIC (Zou, Hastie and Tibshirani 2007). Selected coefficients are tested debiased (Zhang and Zhang 2014;
Javanmard and Montanari 2014): with fewer columns than rows that is least squares on all columns. Holm's
correction keeps the level over all mechanisms.
"""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from doe.discrepancy.contest.gap import holm
from doe.discrepancy.contest.signatures import LEAST_LENGTH, Signatures, projector, signatures
from experiments.evidence.trials.baselines.methods.contest import FIT_LEVEL, surprise
from experiments.evidence.trials.baselines.protocol import LEVEL, Answer, Problem


@dataclass(frozen=True, eq=False)
class Selection:
    """A sparse model of residuals."""

    chosen: np.ndarray
    """True where the lasso selects, (columns,)."""
    p_values: np.ndarray
    """Debiased, one-sided, after Holm, (columns,)."""
    left: float
    """Sum of squares that the selected columns leave, refitted."""


class Lasso:
    """Selected mechanisms whose debiased sizes are not zero."""

    name = "lasso"
    source = "Zou, Hastie and Tibshirani 2007; Javanmard and Montanari 2014"
    level = f"{100 * LEVEL:g} % (Holm)"

    def __call__(self, problem: Problem) -> Answer:
        """Select signatures."""
        base = problem.fitted()
        names, columns = facing(signatures(base), base.residuals)
        project = projector(base.sensitivities)
        found = selected(columns.T, project @ base.residuals)
        taken = found.chosen & (found.p_values < LEVEL)
        freedom = max(round(float(np.trace(project))) - int(found.chosen.sum()), 1)
        against = surprise(found.left, freedom)
        alarm, fails = bool(taken.any()), against > -np.log10(FIT_LEVEL)
        return Answer(
            score=-float(np.log10(max(found.p_values.min(initial=1.0), 1e-300))),
            alarm=alarm,
            named=tuple(sorted(names[taken])) if alarm and not fails else (),
            unknown=alarm and fails,
            outside=against,
        )


def facing(seen: Signatures, residuals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Names (columns,) of what is visible, and visible signatures, (columns, means).

    Of a mechanism with a direction that from the side which the residuals agree with more.
    """
    columns = seen.visible.copy()
    for name, turned in zip(seen.turned_names, seen.turned, strict=True):
        row = seen.names.index(name)
        if turned @ residuals > columns[row] @ residuals:
            columns[row] = turned
    there = np.linalg.norm(columns, axis=1) > LEAST_LENGTH
    return np.array(seen.names)[there], columns[there]


def selected(columns: np.ndarray, residuals: np.ndarray) -> Selection:
    """Select columns (means, columns) of residuals (means,) of variance 1."""
    from sklearn.linear_model import LassoLarsIC

    if not columns.shape[1]:
        return Selection(np.zeros(0, dtype=bool), np.zeros(0), float(residuals @ residuals))
    unit = columns / np.linalg.norm(columns, axis=0)
    lasso = LassoLarsIC(criterion="bic", fit_intercept=False, positive=True, noise_variance=1.0)
    chosen = np.asarray(lasso.fit(unit, residuals).coef_ > 0.0)
    inverse = np.linalg.pinv(unit)
    z = inverse @ residuals / np.linalg.norm(inverse, axis=1)
    left = residuals - unit[:, chosen] @ np.linalg.pinv(unit[:, chosen]) @ residuals
    return Selection(chosen, holm(stats.norm.sf(z)), float(left @ left))
