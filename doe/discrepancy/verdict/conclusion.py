"""The rules by which a mechanism is admitted, and the verdict that they give."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from doe.discrepancy.contest.gap import Answer, GapTest, Question
from doe.discrepancy.contest.rivals import certain, is_open, lag, parting
from doe.discrepancy.fitting.model_fit import Fitted, Interval
from doe.discrepancy.problem.settings import Settings
from doe.discrepancy.verdict.before_after import BeforeAfter
from doe.discrepancy.verdict.discovery import Verdict

WORSE = 4.0
"""Rise of the held-out Q of fresh runs with which a name is withdrawn: two standard deviations, squared."""

LIKELIHOOD = "minus twice the log-likelihood, held-out conditions included"
"""Name of a score, in reasons."""


@dataclass(frozen=True, eq=False)
class Assessment:
    """A candidate with everything that the rules look at."""

    fitted: Fitted
    gap: GapTest
    """Of all conditions with the candidate in the model, those held out by forecast."""
    gain: Interval | None
    """Of the held-out log score over the base."""
    explained: float
    """Share of the base's excess that it removes."""
    simulated: bool
    """True if fresh runs around its optimum stand behind it."""
    declared: bool
    """True if all its mechanisms may be named by what was declared."""
    whole: Fitted
    """The same, weighed on all conditions."""
    apart: Mapping[str, float] = field(default_factory=dict)
    """By other mechanism, how far in Q it was shown to be from a single one of its size."""

    @property
    def mechanisms(self) -> tuple[str, ...]:
        """Its mechanisms."""
        return self.fitted.mechanisms

    @property
    def score(self) -> float:
        """Minus twice the log-likelihood of all data, the held-out ones by forecast; up to a constant."""
        return self.fitted.score - (0.0 if self.gain is None else 2.0 * self.gain.value)

    @property
    def ratios(self) -> np.ndarray:
        """Each size over the standard error that it would have if there were none."""
        return self.fitted.ratios


@dataclass(frozen=True)
class Conclusion:
    """A verdict with its reason."""

    verdict: Verdict
    named: tuple[str, ...]
    reason: str
    chosen: int | None
    """Number of the assessment whose model to go on with."""


def explained_share(base: GapTest, with_it: GapTest) -> float:
    """Share of the base's excess of Q over its degrees of freedom that a model removes, at most 1."""
    if base.excess <= 0.0:
        return 0.0
    return max(1.0 - with_it.excess / base.excess, 0.0)


def objections(assessment: Assessment, settings: Settings) -> list[str]:
    """Every rule that a candidate fails, as sentences, in the order of the rules."""
    least = settings.least_ratio if len(assessment.mechanisms) == 1 else settings.pair_ratio
    ratio = float(assessment.ratios.min())
    gap, gain = assessment.gap, assessment.gain
    found = []
    if not assessment.simulated:
        found.append("it was too far behind to be simulated again")
    if gap.p < settings.fit_level:
        found.append(f"the data still disagree with it ({_answer(gap.clearest)}, p = {gap.p:.2g})")
    if ratio < least:
        found.append(f"its size is {ratio:.1f} standard errors, less than {least:g}")
    if gain is None:
        found.append("no held-out condition was measured")
    elif gain.value <= 0.0:
        found.append(f"it predicts the held-out conditions no better (log score {gain.value:+.1f})")
    return found


def conclude(assessments: Sequence[Assessment], settings: Settings) -> Conclusion:
    """Choose among candidates of equally many mechanisms.

    The one of the best score is named if it passes every rule, may be named, and no other is so close behind
    that it stays open which of them it is. Single mechanisms so close are a tie if one of them passes. Of two
    such pairs neither is named: where two pairs fit, so may what the library does not have.

    Parameters
    ----------
    assessments : sequence of Assessment
    settings : Settings
    """
    if not assessments:
        return Conclusion(Verdict.UNKNOWN, (), "nothing in the library could explain the gap", None)
    order = sorted(range(len(assessments)), key=lambda index: assessments[index].score)
    best = assessments[order[0]]
    margin = settings.tie_margin
    sure = certain(best.whole)
    # rivals that fit were run: of the others an emulator says little, and whatever is measured is within that
    known = [certain(one.whole) - sure if one.simulated else math.inf for one in assessments]
    by = [lag(one.score - best.score, at, margin) for one, at in zip(assessments, known, strict=True)]
    close = [i for i in order if _is_close(assessments[i], best, by[i], margin)]
    passing = [i for i in close if not objections(assessments[i], settings)]
    failed = objections(best, settings)
    titles = ", ".join(_title(assessments[i]) for i in close)
    if passing and len(close) > 1:
        if len(best.mechanisms) > 1:
            return Conclusion(Verdict.UNKNOWN, (), open_pairs([assessments[i] for i in close]), None)
        names = tuple(assessments[i].mechanisms[0] for i in close)
        most = max(by[i] for i in close)
        reason = (
            f"{titles} explain the data alike: at most {most:.1f} apart as ties are judged, in {LIKELIHOOD}"
        )
        return Conclusion(Verdict.TIE, names, reason, passing[0])
    if passing and best.declared:
        return _named(assessments, order[0], order[1:])
    if passing:
        failed = ["it was declared that such data cannot tell it from others"]
    return Conclusion(Verdict.UNKNOWN, (), f"{_title(best)} comes closest, but {failed[0]}", None)


def conclude_with_two(
    of_one: Conclusion, singles: Sequence[Assessment], pairs: Sequence[Assessment], settings: Settings
) -> tuple[Conclusion, list[Assessment]]:
    """Conclude again once pairs were tried.

    Where a single mechanism was chosen, a pair that passes every rule must be ahead of it by as much as tells
    two models apart.

    Parameters
    ----------
    of_one : Conclusion
        Among the single mechanisms.
    singles, pairs : sequence of Assessment
    settings : Settings

    Returns
    -------
    conclusion : Conclusion
    assessments : list of Assessment
        All that the conclusion counts among.
    """
    if of_one.chosen is not None:
        passing = [one.score for one in pairs if not objections(one, settings)]
        if singles[of_one.chosen].score - min(passing, default=math.inf) <= settings.tie_margin:
            return of_one, [*singles, *pairs]
    if not pairs:
        return of_one, [*singles]
    of_two = conclude(pairs, settings)
    if of_two.chosen is not None:
        return of_two, [*pairs, *singles]
    ordered = closest_first([*singles, *pairs], settings)
    if of_one.chosen is not None:
        return of_two, ordered
    return _unexplained(ordered[0], of_one, of_two, settings), ordered


def closest_first(assessments: Sequence[Assessment], settings: Settings) -> list[Assessment]:
    """Sort models none of which explains the gap: those with fresh runs first, each by their score.

    Of a pair the second effect must bring as much as tells two models apart: some always brings a little.
    """
    margin = settings.tie_margin
    return sorted(assessments, key=lambda one: (not one.simulated, one.score + margin * len(one.mechanisms)))


def _unexplained(
    closest: Assessment, of_one: Conclusion, of_two: Conclusion, settings: Settings
) -> Conclusion:
    """Conclude that nothing explains the gap, by what is held against the closest single model or pair."""
    failed = objections(closest, settings)
    if failed:
        return Conclusion(Verdict.UNKNOWN, (), f"{_title(closest)} comes closest, but {failed[0]}", None)
    return of_two if len(closest.mechanisms) > 1 else of_one


def _is_close(one: Assessment, best: Assessment, behind: float, margin: float) -> bool:
    apart = best.apart.get(one.mechanisms[0], math.inf)
    return one is best or is_open(behind, apart, margin, parting(one.whole, best.whole))


def withdrawn(conclusion: Conclusion, compared: Sequence[BeforeAfter]) -> Conclusion:
    """Withdraw a name or a tie with which fresh runs predict held-out conditions worse than the base's do.

    Of the 203 right names of the sixth blind trials the fresh runs of none came out worse by more than 3.1;
    with the one tie where nothing was hidden, by 14.
    """
    for one in compared:
        if one.held_out and (worse := one.after.value - one.before.value) > WORSE:
            reason = (
                f"fresh runs with {', '.join(map(_spaced, conclusion.named))} predict the held-out conditions"
                f" worse than those of the base: Q rises by {worse:.1f}"
            )
            return Conclusion(Verdict.UNKNOWN, (), reason, None)
    return conclusion


def _named(assessments: Sequence[Assessment], chosen: int, others: Sequence[int]) -> Conclusion:
    best = assessments[chosen]
    ratio = " and ".join(f"{value:.1f}" for value in best.ratios)
    reason = (
        f"{_title(best)} brings the model within the noise (p = {best.gap.p:.2f}), its size is {ratio}"
        " standard errors, it predicts the held-out conditions better"
    )
    if others:
        second = assessments[others[0]]
        behind = second.score - best.score
        reason += f", and the next, {_title(second)}, is {behind:.0f} behind in {LIKELIHOOD}"
    return Conclusion(Verdict.NAMED, best.mechanisms, reason, chosen)


def _answer(answer: Answer) -> str:
    statistic = {
        Question.SIZE: "Q =",
        Question.FALL: f"{_spaced(answer.mechanism)} would lower Q by",
        Question.SCORES: "the squared scores sum to",
        Question.COMMON: "what is off alike in all conditions has a sum of squares of",
    }[answer.question]
    return f"{statistic} {answer.value:.1f}, limit {answer.limit:.1f}"


def open_pairs(close: Sequence[Assessment]) -> str:
    """Say which pairs are open, and what is in all of them.

    In the fourteenth blind trials six pairs that were hidden came out so, and nothing else; what the open
    ones share was hidden in five.
    """
    shared = set.intersection(*(set(one.mechanisms) for one in close))
    text = f"no one pair stands out: {', '.join(map(_title, close))}"
    return text + "".join(f"; {_spaced(name)} is in all of them" for name in sorted(shared))


def _title(assessment: Assessment) -> str:
    return " with ".join(_spaced(name) for name in assessment.mechanisms)


def _spaced(name: str) -> str:
    return name.replace("_", " ")
