"""Rules by which a mechanism is accepted, and the verdict from them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from doe.discrepancy.contest.gap import Answer, GapTest, Question
from doe.discrepancy.contest.rivals import certain, lag, needed, parting
from doe.discrepancy.fitting.model_fit import Fitted, Interval
from doe.discrepancy.problem.settings import Settings
from doe.discrepancy.verdict.before_after import BeforeAfter
from doe.discrepancy.verdict.discovery import Verdict
from doe.discrepancy.verdict.next_experiment import Rival

WORSE = 2.0
"""Standard deviations of the difference of two Qs beyond which fresh runs withdraw a name
(``trials/record/README.md``)."""

MANY = 1e6
"""Largest ratio of likelihoods that is stated."""


@dataclass(frozen=True, eq=False)
class Assessment:
    """A candidate with all inputs of the rules."""

    fitted: Fitted
    gap: GapTest
    """Gap of all conditions with the candidate in the model, the held-out ones by forecast."""
    gain: Interval | None
    """Gain of the held-out log score over the base."""
    explained: float
    """Removed share of the base's excess."""
    simulated: bool
    """True if it has fresh runs around its optimum."""
    declared: bool
    """True if the declaration allows all its mechanisms as names."""
    whole: Fitted
    """The same fit, weighed on all conditions."""
    apart: Mapping[str, float] = field(default_factory=dict)
    """Distance in Q by other mechanism, from a single one of its size."""

    @property
    def mechanisms(self) -> tuple[str, ...]:
        """Mechanisms of the candidate."""
        return self.fitted.mechanisms

    @property
    def score(self) -> float:
        """Minus twice the log-likelihood of all data, the held-out ones by forecast; up to a constant."""
        return self.fitted.score - (0.0 if self.gain is None else 2.0 * self.gain.value)

    @property
    def ratios(self) -> np.ndarray:
        """Sizes over the standard errors that absent mechanisms would have."""
        return self.fitted.ratios


@dataclass(frozen=True)
class Conclusion:
    """A verdict with its reason."""

    verdict: Verdict
    named: tuple[str, ...]
    reason: str
    chosen: int | None
    """Number of the assessment whose model the analysis continues with."""


def explained_share(base: GapTest, with_it: GapTest) -> float:
    """Return the share of the base's excess of Q that a model removes, at most 1."""
    if base.excess <= 0.0:
        return 0.0
    return max(1.0 - with_it.excess / base.excess, 0.0)


def objections(assessment: Assessment, settings: Settings) -> list[str]:
    """Return every rule that a candidate fails, as sentences, in the order of the rules."""
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

    The one of the best score is named if it passes every rule, may be named, and no other is so close that it
    is open which of them is right. Close single mechanisms are a tie if one of them passes. Close pairs are
    not named: where two pairs fit, a mechanism outside the library may fit, too.
    """
    if not assessments:
        return Conclusion(Verdict.UNKNOWN, (), "nothing in the library could explain the gap", None)
    order = sorted(range(len(assessments)), key=lambda index: assessments[index].score)
    best = assessments[order[0]]
    margin = settings.tie_margin
    rivals = [rival(one, best, margin) for one in assessments]
    close = [i for i in order if assessments[i] is best or rivals[i].behind < rivals[i].needed]
    passing = [i for i in close if not objections(assessments[i], settings)]
    failed = objections(best, settings)
    titles = ", ".join(_title(assessments[i]) for i in close)
    if passing and len(close) > 1:
        if len(best.mechanisms) > 1:
            return Conclusion(Verdict.UNKNOWN, (), open_pairs([assessments[i] for i in close]), None)
        names = tuple(assessments[i].mechanisms[0] for i in close)
        reason = f"{titles} explain the data alike: noise and errors of the predictions hide which is right"
        return Conclusion(Verdict.TIE, names, reason, passing[0])
    if passing and best.declared:
        return _named(assessments, order[0], order[1:])
    if passing:
        failed = ["by declaration such data cannot distinguish it from others"]
    return Conclusion(Verdict.UNKNOWN, (), f"{_title(best)} comes closest, but {failed[0]}", None)


def conclude_with_two(
    of_one: Conclusion, singles: Sequence[Assessment], pairs: Sequence[Assessment], settings: Settings
) -> tuple[Conclusion, list[Assessment]]:
    """Conclude again with pairs; return the conclusion, and the assessments that it counts among.

    Where a single mechanism was chosen, a pair that passes every rule must be ahead of it by the distance
    that distinguishes two models.
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
    """Sort models that do not explain the gap: those with fresh runs first, each by their score.

    The second effect of a pair must gain the distance that distinguishes two models: any effect gains a
    little.
    """
    margin = settings.tie_margin
    return sorted(assessments, key=lambda one: (not one.simulated, one.score + margin * len(one.mechanisms)))


def _unexplained(
    closest: Assessment, of_one: Conclusion, of_two: Conclusion, settings: Settings
) -> Conclusion:
    """Conclude that nothing explains the gap, by the objections to the closest single model or pair."""
    failed = objections(closest, settings)
    if failed:
        return Conclusion(Verdict.UNKNOWN, (), f"{_title(closest)} comes closest, but {failed[0]}", None)
    return of_two if len(closest.mechanisms) > 1 else of_one


def rival(one: Assessment, best: Assessment, margin: float) -> Rival:
    """Compare an assessment with the best one."""
    # rivals that fit were run; the emulator's error at the others is large
    sure = certain(one.whole) - certain(best.whole) if one.simulated else math.inf
    apart = best.apart.get(one.mechanisms[0], math.inf)
    chance = parting(one.whole, best.whole)
    return Rival(one.whole, lag(one.score - best.score, sure, margin), needed(apart, margin, chance), chance)


def withdrawn(conclusion: Conclusion, compared: Sequence[BeforeAfter]) -> Conclusion:
    """Withdraw a name or a tie whose fresh runs predict held-out conditions worse than the base's do.

    The noise of the measured means is in both Qs, that of the fresh runs in one each. Of two models that are
    equally good the scores of a mean, of as many replicates as runs, correlate by 1/2: their squares differ
    with a variance of 2 + 2 - 4 (1/2)^2 = 3.
    """
    for one in compared:
        limit = WORSE * math.sqrt(3.0 * one.degrees_of_freedom)
        if one.held_out and (worse := one.after.value - one.before.value) > limit:
            reason = (
                f"fresh runs with {', '.join(map(_spaced, conclusion.named))} predict the held-out conditions"
                f" worse than those of the base: Q rises by {worse:.1f}, limit {limit:.1f}"
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
        odds = math.exp(min((second.score - best.score) / 2.0, math.log(2.0 * MANY)))
        times = f"{odds:,.0f}" if odds < MANY else "over a million"
        reason += f", and the data are {times} times as likely with it as with the next, {_title(second)}"
    return Conclusion(Verdict.NAMED, best.mechanisms, reason, chosen)


def _answer(answer: Answer) -> str:
    statistic = {
        Question.SIZE: "Q =",
        Question.FALL: f"{_spaced(answer.mechanism)} would lower Q by",
        Question.SCORES: "the squared scores sum to",
        Question.COMMON: "all conditions deviate alike, with a sum of squares of",
    }[answer.question]
    return f"{statistic} {answer.value:.1f}, limit {answer.limit:.1f}"


def open_pairs(close: Sequence[Assessment]) -> str:
    """Describe the open pairs, and the mechanisms in all of them (``trials/record/fourteenth``)."""
    shared = set.intersection(*(set(one.mechanisms) for one in close))
    text = f"no one pair stands out: {', '.join(map(_title, close))}"
    return text + "".join(f"; {_spaced(name)} is in all of them" for name in sorted(shared))


def _title(assessment: Assessment) -> str:
    return " with ".join(_spaced(name) for name in assessment.mechanisms)


def _spaced(name: str) -> str:
    return name.replace("_", " ")
