"""The rules by which a mechanism is admitted, and the verdict that they give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discover.discovery import Interval, Verdict
from experiments.discover.fitting import Fitted
from experiments.discover.gap import GapTest
from experiments.discover.settings import Settings


@dataclass(frozen=True, eq=False)
class Assessment:
    """A candidate with everything that the rules look at.

    Attributes
    ----------
    fitted : Fitted
    gap : GapTest
        Of the data with the candidate in the model.
    gain : Interval or None
        Of the held-out log score over the base.
    explained : float
        Share of the base's excess that it removes.
    simulated : bool
        Whether fresh runs around its optimum stand behind it.
    resolvable : bool
        Whether all its mechanisms may be named.
    """

    fitted: Fitted
    gap: GapTest
    gain: Interval | None
    explained: float
    simulated: bool
    resolvable: bool

    @property
    def mechanisms(self) -> tuple[str, ...]:
        """Its mechanisms."""
        return self.fitted.mechanisms

    @property
    def ratios(self) -> np.ndarray:
        """Each size over its standard error."""
        return np.asarray(self.fitted.sizes / self.fitted.size_errors)


@dataclass(frozen=True)
class Decision:
    """A verdict with its reason.

    Attributes
    ----------
    verdict : Verdict
    named : tuple of str
    reason : str
    chosen : int or None
        Which of the assessments is the model to go on with.
    """

    verdict: Verdict
    named: tuple[str, ...]
    reason: str
    chosen: int | None


def explained_share(base: Fitted, fitted: Fitted) -> float:
    """Share of the base's excess of Q over its degrees of freedom that a model removes, at most 1."""
    excess = base.q - base.freedom
    if excess <= 0.0:
        return 0.0
    return float(np.clip(1.0 - max(fitted.q - fitted.freedom, 0.0) / excess, 0.0, 1.0))


def objections(assessment: Assessment, settings: Settings) -> list[str]:
    """Every rule that a candidate fails, as sentences, in the order of the rules."""
    least = settings.least_ratio if len(assessment.mechanisms) == 1 else settings.pair_ratio
    ratio = float(assessment.ratios.min())
    gap, gain = assessment.gap, assessment.gain
    found = []
    if not assessment.simulated:
        found.append("it was too far behind to be simulated again")
    if gap.p < settings.fit_level:
        found.append(f"the data still disagree with it (Q = {gap.q:.0f}, p = {gap.p:.2g})")
    if ratio < least:
        found.append(f"its size is {ratio:.1f} standard errors, less than {least:g}")
    if gain is None:
        found.append("no held-out condition was measured")
    elif gain.low <= 0.0:
        found.append(
            f"the held-out conditions gain {gain.value:.1f} ({gain.low:.1f} to {gain.high:.1f}), which may be"
            " nothing"
        )
    return found


def decide(assessments: Sequence[Assessment], settings: Settings) -> Decision:
    """Choose among candidates of equally many mechanisms.

    The one of the best score (a likelihood) is named if it passes every rule, is resolvable and no other
    comes within the tie margin. Whatever comes within the margin of one that passes makes a tie.

    Parameters
    ----------
    assessments : sequence of Assessment
    settings : Settings
    """
    if not assessments:
        return Decision(Verdict.UNKNOWN, (), "nothing in the library could explain the gap", None)
    order = sorted(range(len(assessments)), key=lambda index: assessments[index].fitted.score)
    best = assessments[order[0]]
    close = [i for i in order if assessments[i].fitted.score - best.fitted.score < settings.tie_margin]
    passing = [i for i in close if not objections(assessments[i], settings)]
    if passing and len(close) > 1:
        return _tied(assessments, close, passing[0])
    if passing and not best.resolvable:
        reason = (
            f"{_title(best)} explains the data, but they could not tell it from others: it may not be named"
        )
        return Decision(Verdict.UNKNOWN, (), reason, None)
    if passing:
        return _named(assessments, order[0], order[1:])
    failed = objections(best, settings)
    incomplete = _incomplete(best, len(close), failed, settings)
    if incomplete is not None:
        return Decision(Verdict.INCOMPLETE, best.mechanisms, incomplete, order[0])
    return Decision(
        Verdict.UNKNOWN,
        (),
        f"{_title(best)} comes closest, but {failed[0]}; nothing else in the library does",
        None,
    )


def _named(assessments: Sequence[Assessment], chosen: int, others: Sequence[int]) -> Decision:
    best = assessments[chosen]
    ratio = " and ".join(f"{value:.1f}" for value in best.ratios)
    reason = (
        f"{_title(best)} brings the model within the noise (p = {best.gap.p:.2f}), its size is {ratio}"
        " standard errors, it predicts the held-out conditions better"
    )
    if others:
        second = assessments[others[0]]
        behind = second.fitted.score - best.fitted.score
        reason += f", and the next, {_title(second)}, is {behind:.0f} behind in Q"
    return Decision(Verdict.NAMED, best.mechanisms, reason, chosen)


def _tied(assessments: Sequence[Assessment], close: Sequence[int], chosen: int) -> Decision:
    titles = ", ".join(_title(assessments[i]) for i in close)
    names = tuple(dict.fromkeys(name for i in close for name in assessments[i].mechanisms))
    common = [name for name in names if all(name in assessments[i].mechanisms for i in close)]
    if common:
        reason = f"{' and '.join(common)} is in every explanation that fits, beside one more: {titles}"
        return Decision(Verdict.INCOMPLETE, tuple(common), reason, chosen)
    margin = max(assessments[i].fitted.score for i in close) - min(assessments[i].fitted.score for i in close)
    return Decision(Verdict.TIE, names, f"{titles} explain the data alike, within {margin:.1f} of Q", chosen)


def _incomplete(best: Assessment, close: int, failed: Sequence[str], settings: Settings) -> str | None:
    """The reason to name a mechanism although something is left, or None."""
    only_the_fit = best.gap.p < settings.fit_level and len(failed) == 1 and best.resolvable
    if not only_the_fit or close > 1 or best.explained < settings.incomplete_share:
        return None
    return f"{_title(best)} explains {best.explained:.0%} of the excess beyond doubt, but {failed[0]}"


def _title(assessment: Assessment) -> str:
    return " with ".join(name.replace("_", " ") for name in assessment.mechanisms)
