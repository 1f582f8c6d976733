"""The gap: disagreement of a calibrated model with the data beyond the noise, and its place."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy import stats
from scipy.linalg import orth

from doe.discrepancy.contest.signatures import Signatures, projector, unshared
from doe.discrepancy.fitting.fitted_model import Stack
from doe.discrepancy.fitting.model_fit import Fitted, fit


class Question(StrEnum):
    """Question to the residuals of a model."""

    SIZE = "size"
    """Are they too large? Q."""
    FALL = "fall"
    """Do they point at one mechanism? The largest fall of Q that a positive size of one brings."""
    SCORES = "scores"
    """Do they lie where mechanisms act at all, either way? The sum of all squared scores."""
    COMMON = "common"
    """Are observables off alike in all conditions? The sum of squares of what they have in common."""


@dataclass(frozen=True)
class Answer:
    """Answer to one question to the residuals."""

    question: Question
    value: float
    limit: float
    """The statistic, and the point that the bootstrap exceeds at the level of the rules."""
    mechanism: str = ""
    """Mechanism of the fall; empty with the other questions."""


OF_THE_BASE = (Question.SIZE, Question.FALL, Question.SCORES)
"""Questions to a model to which a mechanism may be added. The last looks where mechanisms act in either
direction: an effect that the library lacks most likely acts there too."""

OF_A_CANDIDATE = (Question.SIZE, Question.COMMON)
"""Questions to a model that is to be believed. A missing effect moves an observable in all conditions, and an
emulator errs here and there (``trials/record/README.md``)."""


@dataclass(frozen=True, eq=False)
class GapTest:
    """Questions to the whitened residuals of a model, all at once."""

    q: float
    freedom: int
    """Sum of squares of what a refit leaves, and its degrees of freedom."""
    q_limit: float
    """Point that ``level`` of the bootstrap exceeds."""
    mechanisms: tuple[str, ...]
    scores: np.ndarray
    """z of the visible signature of each in the residuals, (mechanisms,)."""
    drop: float
    drop_limit: float
    """Largest fall of Q that a positive size of one mechanism brings, and its limit."""
    mechanism: str
    """Mechanism of that fall; empty without a library."""
    p: float
    """P value of the smallest p value of the questions asked, by the same bootstrap."""
    clearest: Answer
    """Answer to the question of that smallest p value; beyond its limit where there is a gap."""
    level: float

    @property
    def found(self) -> bool:
        """True if there is a gap."""
        return self.p < self.level

    @property
    def excess(self) -> float:
        """Part of Q that the noise does not account for."""
        return max(self.q - self.freedom, 0.0)


def find_gap(
    fitted: Fitted,
    seen: Signatures,
    level: float,
    draws: int,
    seed: int,
    questions: Sequence[Question] = OF_THE_BASE,
) -> GapTest:
    """Test a calibrated model by parametric bootstrap, each draw refitted (linearised at the optimum).

    The model is weighed on all conditions to be tested, those outside the calibration included: the sum of
    squares after a linear refit to all is that after the calibration plus that of the errors of its
    forecasts, each against its own uncertainty. ``seen`` has the signatures of the mechanisms that it lacks,
    ``level`` the probability of a false gap.
    """
    project = projector(fitted.sensitivities)
    noise = np.random.default_rng(seed).standard_normal((draws, len(project))) @ project
    left = project @ fitted.residuals
    common = _common_directions(fitted, project)
    seen = unshared(seen, fitted)
    directions = np.concatenate([seen.directions, seen.turned_directions.reshape(-1, len(project))])
    drawn, found = (_statistics(each, directions, len(seen.names), common) for each in (noise, left))
    limits = {of: float(np.quantile(values, 1.0 - level)) for of, values in drawn.items()}
    p_values = {of: _exceeded(drawn[of], float(found[of])) for of in questions}
    smallest = np.min([_own_p(drawn[of]) for of in questions], axis=0)
    scores = seen.directions @ left
    clearest = min(p_values, key=p_values.__getitem__)
    names = (*seen.names, *seen.turned_names)
    mechanism = names[int(np.argmax(directions @ left))] if names else ""
    return GapTest(
        q=float(found[Question.SIZE]),
        freedom=round(float(np.trace(project))),
        q_limit=limits[Question.SIZE],
        mechanisms=seen.names,
        scores=scores,
        drop=float(found[Question.FALL]),
        drop_limit=limits[Question.FALL],
        mechanism=mechanism,
        p=(1.0 + float(np.sum(smallest <= p_values[clearest]))) / (draws + 1.0),
        clearest=Answer(
            clearest,
            float(found[clearest]),
            limits[clearest],
            mechanism if clearest is Question.FALL else "",
        ),
        level=level,
    )


def _common_directions(fitted: Fitted, project: np.ndarray) -> np.ndarray:
    """Return a basis of deviations of an observable alike in all conditions, after a refit, (k, means).

    Alike means by as many standard deviations of its mean.
    """
    columns = np.concatenate([block.columns for block in fitted.stack.blocks])
    deviations = np.sqrt(np.diag(fitted.covariance))
    alike = (columns == np.unique(columns)[:, None]) * deviations
    return orth(project @ fitted.whitening @ alike.T).T


def _statistics(
    residuals: np.ndarray, signatures: np.ndarray, count: int, common: np.ndarray
) -> dict[Question, np.ndarray]:
    """Compute the statistic of each question for residuals (..., n).

    The first ``count`` signatures are of different mechanisms, the others of some of these from behind.
    """
    scores = residuals @ signatures.T
    return {
        Question.SIZE: (residuals**2).sum(axis=-1),
        Question.FALL: (np.maximum(scores, 0.0) ** 2).max(axis=-1, initial=0.0),
        Question.SCORES: (scores[..., :count] ** 2).sum(axis=-1),
        Question.COMMON: ((residuals @ common.T) ** 2).sum(axis=-1),
    }


def _exceeded(drawn: np.ndarray, value: float) -> float:
    return (1.0 + float(np.sum(drawn >= value))) / (len(drawn) + 1.0)


def _own_p(drawn: np.ndarray) -> np.ndarray:
    """Return the share of the draws that are at least as large as each."""
    return np.asarray((len(drawn) + 1.0 - stats.rankdata(drawn, method="min")) / len(drawn))


def holm(p_values: np.ndarray) -> np.ndarray:
    """Return p values adjusted for their number (Holm 1979), same shape (n,)."""
    order = np.argsort(p_values)
    adjusted = np.maximum.accumulate(p_values[order] * np.arange(len(order), 0, -1)).clip(max=1.0)
    out = np.empty_like(adjusted)
    out[order] = adjusted
    return out


def condition_fits(fitted: Fitted) -> list[Fitted]:
    """Calibrate a model to one training condition at a time, where that has more means than parameters."""
    enough = [block for block in fitted.stack.blocks if len(block.mean) > len(fitted.x)]
    return [fit(Stack(fitted.model, (block,)), fitted.x, count=2) for block in enough]


def drift_p(values: np.ndarray, errors: np.ndarray) -> float:
    """Return the p value of the hypothesis that values with independent errors are equal."""
    weights = errors**-2.0
    mean = np.sum(weights * values) / np.sum(weights)
    return float(stats.chi2.sf(np.sum(weights * (values - mean) ** 2), len(values) - 1))
