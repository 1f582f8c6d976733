"""The verdict of a discovery in words: headline, sentence, and what would change it."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from doe.discrepancy import (
    Answer,
    BeforeAfter,
    Candidate,
    Discovery,
    Fit,
    Interval,
    Power,
    Question,
    Settings,
    Verdict,
)
from experiments.report.discovery.disagreement import (
    heading_phrase,
    leaning,
    measure_again,
    misses,
    open_question,
    slip_decides,
    slip_sentences,
    standing_out,
    with_and_without,
)
from experiments.report.discovery.terms import GAP, Terms, percent, spaced
from experiments.report.kit.numbers import capital, enumeration, fixed, p_clause, trimmed
from experiments.report.kit.sentences import say

SETTLED = (Verdict.NONE, Verdict.NAMED)
"""Verdicts that leave no question open."""

DRIFTS = 1e-3
"""P value of a drift below which a verdict that nothing is missing says a word about it."""

ALL = 0.995
"""Share of the excess that rounds to all: of a model that is refused nonetheless, what is left says more."""

BOTH = " + "
"""Sign between the two effects of one model in the next experiment."""

SURE = 0.99
"""Largest chance that is stated."""

SHOWN_RIVALS = 2
"""Refused mechanisms that are reported with their objection."""


def headline(found: Discovery, terms: Terms) -> str:
    """Say the verdict in a few words."""
    named = terms.titles(found.named)
    if slip_decides(found):
        return open_question(found, "verdict.open") or "A likely slip in the data"
    return {
        Verdict.NONE: "Nothing is missing that these data could show",
        Verdict.NAMED: f"Missing: {named}",
        Verdict.TIE: f"A tie: {terms.titles(found.named, 'or')}",
        Verdict.UNKNOWN: "Something is missing, and no effect of the library is sure to be it",
        Verdict.NOT_IDENTIFIABLE: "These data cannot tell",
    }[found.verdict]


def verdict_sentence(found: Discovery, terms: Terms) -> str:
    """Say what was found, with its numbers, in one sentence or two."""
    slips = [*slip_sentences(found), with_and_without(found, terms)] if found.slips else []
    if found.without_slips is not None and slip_decides(found):
        rest = found.without_slips
        return " ".join([*slips, say("verdict.slips_first", verdict=_found(rest, terms))])
    return " ".join([_found(found, terms), *slips])


def _found(found: Discovery, terms: Terms) -> str:
    model = found.base if found.verdict is Verdict.NONE else found.chosen or found.closest
    return " ".join(filter(None, [_SENTENCES[found.verdict](found, terms), leaning(model, terms)]))


def reason_sentence(found: Discovery, terms: Terms) -> str:
    """Return the rule that gave the verdict, as a sentence."""
    return f"{capital(_one_name(found.reason, terms)).rstrip('.')}."


def _one_name(text: str, terms: Terms) -> str:
    """Call every mechanism of a text by its title, as all the page does."""
    for name, mechanism in terms.mechanisms.items():
        text = text.replace(spaced(name), mechanism.title)
    return text


def verdict_line(found: Discovery, terms: Terms) -> str:
    """Headline and sentence."""
    return f"{headline(found, terms)}. {verdict_sentence(found, terms)}"


def tied(found: Discovery) -> list[Candidate]:
    """Candidates of a tie: of as many mechanisms as the chosen one, all of them among those named."""
    count = len(found.chosen.mechanisms) if found.chosen else 1
    names = set(found.named)
    return [one for one in found.candidates if len(one.mechanisms) == count and set(one.mechanisms) <= names]


def changes(found: Discovery, terms: Terms, settings: Settings) -> list[str]:
    """Say what would change the verdict, a sentence each."""
    parts = _CHANGES[found.verdict]
    return [
        sentence
        for part in parts
        for sentence in ([say(part)] if isinstance(part, str) else part(found, terms, settings))
    ]


def next_step(found: Discovery, terms: Terms) -> str:
    """Describe the next experiment; empty where none is proposed."""
    step, unknown = found.next_experiment, found.verdict is Verdict.UNKNOWN
    if slip_decides(found) or (found.slips and unknown and step is None):
        return open_question(found, "verdict.read_again") or say("verdict.data_first")
    if step is None:
        return measure_again(found) if unknown else ""
    pair = " from ".join(
        "the base" if name == "base" else f"the model with {terms.titles(name.split(BOTH))}"
        for name in step.separates
    )
    shared = {"pair": pair, "tests": step.replicates, "setting": _setting(step.conditions)}
    shared |= {"share": percent(min(step.chance, SURE))}
    if gone := terms.mechanisms.get(step.without):
        return say("verdict.without", **shared, title=gone.title, removal=gone.removal.rstrip("."))
    if not step.settles:
        return say("verdict.cannot_settle", **shared)
    how = "surer" if found.verdict is Verdict.NAMED else "repeat"
    return say(f"verdict.{how}", **shared, observable=spaced(step.observable))


def _setting(conditions: tuple[str, ...]) -> str:
    return f"the condition “{conditions[0]}”" if len(conditions) == 1 else "each condition"


def _none(found: Discovery, terms: Terms) -> str:
    if found.base is None or found.gap is None:
        return reason_sentence(found, terms)
    moved = [terms.factors[drift.factor].label for drift in found.drifts if drift.p_value < DRIFTS]
    drifting = say("verdict.drifting", names=enumeration(moved)) if moved else ""
    apart = standing_out(found, terms)
    means = say("verdict.single_means", means=" And ".join(apart)) if apart else ""
    return say("verdict.none", misfit=_q_and_p(found.base), drifting=drifting, means=means)


def _added(found: Discovery, terms: Terms) -> str:
    if found.chosen is None:
        return reason_sentence(found, terms)
    sizes = terms.sizes(found.chosen.mechanisms, found.chosen.sizes)
    text = f"Adding {terms.titles(found.chosen.mechanisms)} at {sizes}{heading_phrase(found.chosen)}"
    training, held_out = _set(found, held_out=False), _set(found, held_out=True)
    if training:
        text += f" removed {_share(training.removed)} of the excess"
    elif found.base:
        text += f" brings Q from {trimmed(found.base.q, 3)} to {trimmed(found.chosen.q, 3)}"
    if held_out:
        fell = "fell" if held_out.after.value < held_out.before.value else "rose"
        text += f"; held out, Q {fell} from {_q(held_out.before)} to {_q(held_out.after)}"
    confirm = [terms.mechanisms[name].confirm for name in found.named if name in terms.mechanisms]
    return " ".join([f"{text}.", *(f"Do this next: {one}" for one in confirm[:1])])


def _tie(found: Discovery, terms: Terms) -> str:
    each = []
    for one in tied(found):
        titles, sizes = terms.titles(one.mechanisms), terms.sizes(one.mechanisms, one.sizes)
        each.append(say("verdict.tie_one", titles=titles, sizes=sizes, q=trimmed(one.q, 3)))
    return say("verdict.tie", each="; ".join(each))


def _unknown(found: Discovery, terms: Terms) -> str:
    if found.base is None:
        return reason_sentence(found, terms)
    within = found.base.q <= found.base.q_limit
    how = f", not by Q alone but in that {_beyond(found.base.clearest, terms)}" if within else ""
    text = f"The model disagrees with the data ({_q_and_p(found.base)}){how}"
    if not found.candidates:
        return say("verdict.nothing_explains", text=text)
    best = found.candidates[0]
    many = len(best.mechanisms) > 1
    does = f"{'they leave' if many else 'it leaves'} Q = {trimmed(best.q, 3)}"
    if found.base.excess and best.explained < ALL:
        share = percent(max(best.explained, 0.0))
        does = f"{'they remove' if many else 'it removes'} {share} of the excess"
    why = (
        f", but {_one_name(best.objection, terms).rstrip('.')}"
        if best.objection
        else f", but {'they do' if many else 'it does'} not stand out"
    )
    come = "come" if many else "comes"
    text += f". {capital(terms.titles(best.mechanisms))} {come} closest ({does}){why}."
    return " ".join([text, *(capital(one) for one in misses(found, terms)[:1])])


def _q_and_p(base: Fit) -> str:
    q, freedom = trimmed(base.q, 3), fixed(base.degrees_of_freedom, 0)
    return say("verdict.misfit", q=q, freedom=freedom, p=p_clause(base.p_value))


def _beyond(answer: Answer, terms: Terms) -> str:
    statistic = {
        Question.SIZE: "Q is",
        Question.FALL: f"{terms.title(answer.mechanism)} would lower Q by",
        Question.SCORES: say("verdict.scores"),
    }[answer.question]
    limit = "limit of such a fall" if answer.question is Question.FALL else "limit"
    return f"{statistic} {trimmed(answer.value, 3)} ({limit} {trimmed(answer.limit, 3)})"


def _smaller_effects(found: Discovery, terms: Terms, settings: Settings) -> Iterator[str]:
    visible = [power for power in found.power if power.resolvable]
    hidden = [power for power in found.power if not power.resolvable]
    if visible:
        yield say("verdict.small_effects")
    if hidden:
        act = "it acts" if len(hidden) == 1 else "they act"
        yield say("verdict.left_open", hidden=_cannot_be_seen(hidden, terms), act=act)


def _margins(found: Discovery, terms: Terms, settings: Settings) -> Iterator[str]:
    model = found.chosen.mechanisms if found.chosen else ()
    chosen = next((c for c in found.candidates if c.mechanisms == model), None)
    if chosen is None:
        return
    weakest = min(chosen.size_over_se)
    least = settings.least_ratio if len(model) == 1 else settings.pair_ratio
    gained = chosen.held_out_gain
    gain = say("verdict.margins_gain", gain=_gain(gained)) if gained else ""
    yield say("verdict.margins", ratio=fixed(weakest, 1), least=least, gain=gain)


def _room(found: Discovery, terms: Terms, settings: Settings) -> Iterator[str]:
    if found.chosen is not None:
        share, least = percent(found.chosen.p_value), f"{100.0 * settings.fit_level:g}{GAP}%"
        yield say("verdict.room", share=share, least=least)


def _rivals(found: Discovery, terms: Terms, settings: Settings) -> Iterator[str]:
    shown = tied(found) if found.verdict is Verdict.TIE else found.candidates[:1]
    shown = [] if found.verdict is Verdict.NAMED else shown
    refused = [c for c in found.candidates if not c.admitted and c.objection and c not in shown]
    for rival in refused[:SHOWN_RIVALS]:
        objection = _one_name(rival.objection, terms).rstrip(".")
        were = "were" if len(rival.mechanisms) > 1 else "was"
        titles = capital(terms.titles(rival.mechanisms))
        yield say("verdict.refused", titles=titles, were=were, objection=objection)


def _unresolved(found: Discovery, terms: Terms, settings: Settings) -> Iterator[str]:
    hidden = [p for p in found.power if not p.resolvable and p.mechanism not in found.named]
    if hidden:
        yield say("verdict.unresolved", hidden=_cannot_be_seen(hidden, terms))


def _settle_by_experiment(found: Discovery, terms: Terms, settings: Settings) -> Iterator[str]:
    step = found.next_experiment
    if step is None:
        return
    if step.settles:
        yield say("verdict.would_settle", tests=step.replicates, setting=_setting(step.conditions))
        return
    yield say("verdict.no_condition", tests=step.replicates)
    both = [name for model in step.separates for name in model.split(BOTH)]
    for name in found.named or both:
        if name in terms.mechanisms:
            yield say("verdict.to_see", title=terms.title(name), confirm=terms.mechanisms[name].confirm)


def _more_data(found: Discovery, terms: Terms, settings: Settings) -> Iterator[str]:
    measured = int(np.isfinite(found.data.means[~np.array(found.data.held_out)]).sum())
    s, factors = "" if measured == 1 else "s", len(found.factors)
    yield say("verdict.more_data", means=measured, s=s, factors=factors)


_SENTENCES: dict[Verdict, Callable[[Discovery, Terms], str]] = {
    Verdict.NONE: _none,
    Verdict.NAMED: _added,
    Verdict.TIE: _tie,
    Verdict.UNKNOWN: _unknown,
    Verdict.NOT_IDENTIFIABLE: reason_sentence,
}

_CHANGES: dict[Verdict, tuple[str | Callable[[Discovery, Terms, Settings], Iterator[str]], ...]] = {
    Verdict.NONE: (_smaller_effects,),
    Verdict.NAMED: (_margins, _room, _rivals, _unresolved, "verdict.outside"),
    Verdict.TIE: (_settle_by_experiment, _rivals, _unresolved),
    Verdict.UNKNOWN: (_settle_by_experiment, _rivals, "verdict.widen", _unresolved),
    Verdict.NOT_IDENTIFIABLE: (_more_data,),
}


def _set(found: Discovery, held_out: bool) -> BeforeAfter | None:
    return next((both for both in found.before_after if both.held_out is held_out), None)


def _cannot_be_seen(hidden: list[Power], terms: Terms) -> str:
    return say("verdict.hidden", names=terms.titles(power.mechanism for power in hidden))


def _share(share: Interval) -> str:
    return f"{percent(share.value)} ({fixed(100.0 * share.low, 0)} to {percent(share.high)})"


def _q(interval: Interval) -> str:
    # of a sum of squares nothing is below zero; its interval is less the noise of the means
    low, value, high = (trimmed(max(end, 0.0), 3) for end in (interval.low, interval.value, interval.high))
    return f"{value} ({low} to {high})"


def _gain(gain: Interval) -> str:
    return f"{fixed(gain.value, 1)}, 90 % interval {fixed(gain.low, 1)} to {fixed(gain.high, 1)}"
