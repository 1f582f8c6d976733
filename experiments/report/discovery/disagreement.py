"""Misses of a model, in words: which observable, where, by how much; what looks the same; likely slips."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from doe.discrepancy import CalibrationUse, Discovery, Fit, Question, Slip, Verdict
from experiments.report.discovery.terms import Terms, spaced
from experiments.report.kit.numbers import capital, enumeration, trimmed
from experiments.report.kit.sentences import say
from experiments.studyfile.observables import Instrument

CLEAR = 0.05
"""Adjusted p value below which a residual is reported."""
CLEARLY = 2.0
"""Error of a mean over the conditions that is reported, at least [standard errors]."""
SHOWN = 4
"""Observables that are reported at most."""
ALIKE = 1.0
"""Standard deviations that a residual has at least where it is one of all conditions."""
LEANING = 2.0
"""Standard deviations of a calibration error beyond which a model leans on it."""

_CONVENTIONS = {
    Instrument.FILM: "a start of the clock, or a frame rate, other than the definition's",
    Instrument.RULER: "a filling measured to another level than the mean surface",
    Instrument.BALANCE: "a balance that was not set to zero, or a share of another whole",
    Instrument.PHOTOGRAPH: "a scale, a roll of the camera or a fit of the flank other than the study's",
    Instrument.SCAN: "a scan whose plate is not at height zero",
}


def misses(found: Discovery, terms: Terms) -> list[str]:
    """Say which observables the closest model misses, where and by how much, the clearest first.

    Where it is refused for what is off alike in all conditions, or no single mean is clear, means over the
    conditions say so.
    """
    fit = found.closest or found.base
    return [] if fit is None else [one.sentence(terms) for one in _missed(found, fit)]


def standing_out(found: Discovery, terms: Terms) -> list[str]:
    """Say which single means a base that agrees on the whole misses."""
    return [] if found.base is None else [one.sentence(terms) for one in _standing_out(found, found.base)]


def conventions(found: Discovery, terms: Terms) -> list[str]:
    """Say which conventions or slips would look as what is missed does, one an instrument."""
    fit = found.closest or found.base
    alike: dict[str, list[str]] = {}
    for one in [] if fit is None else _missed(found, fit):
        instrument = terms.observables[one.observable].instrument
        if instrument is not None:
            alike.setdefault(_CONVENTIONS[instrument], []).append(spaced(one.observable))
    return [say("misses.same", names=enumeration(names), text=text) for text, names in alike.items()]


def leaning(fit: Fit | None, terms: Terms) -> str:
    """Say which instruments a model needs to be off by more than was allowed, a sentence; empty for none."""
    uses = fit.calibration if fit else ()
    leans = dict(_leaned_on(use, terms) for use in uses if use.deviations > LEANING)
    if not leans:
        return ""
    leant = (f"{what} ({trimmed(by, 2)} standard deviations)" for what, by in leans.items())
    which = "that instrument" if len(leans) == 1 else "those instruments"
    return say("misses.leaning", what=enumeration(leant), which=which)


def _leaned_on(use: CalibrationUse, terms: Terms) -> tuple[str, float]:
    """Name what is off, and by how many standard deviations: an observable, or the scale of an instrument."""
    instrument = terms.observables[use.observable].instrument
    if instrument is not None and abs(use.used_scale) > LEANING * use.scale > 0.0:
        return f"the scale of the {instrument}", abs(use.used_scale) / use.scale
    return spaced(use.observable), use.deviations


def measure_again(found: Discovery) -> str:
    """Say which measurement tells an effect from a fault of an instrument; empty where nothing is missed."""
    fit = found.closest or found.base
    missed = [] if fit is None else _missed(found, fit)
    if not missed:
        return ""
    where = f"under “{missed[0].condition}”" if missed[0].condition else "under two conditions"
    return say("misses.again", observable=spaced(missed[0].observable), where=where)


def slip_sentences(found: Discovery) -> Iterator[str]:
    """Say what likely slips there are, each with what shows it."""
    for slip in found.slips:
        if slip.replicate is not None:
            lies = "It lies" if len(slip.observables) == 1 else "On average its values lie"
            deviations = trimmed(slip.q_with**0.5, 2)
            yield say("misses.slip_of_heap", slip=_slip(slip), lies=lies, deviations=deviations)
        else:
            after = "once they are exchanged back" if slip.exchanged else "without these values"
            q, q_without = trimmed(slip.q_with, 3), trimmed(slip.q_without, 3)
            yield say("misses.slip_of_values", slip=_slip(slip), q=q, q_without=q_without, after=after)


def open_question(found: Discovery, text: str) -> str:
    """Ask whether observables are misread or moved; empty where no slip is open."""
    off = dict.fromkeys(name for slip in found.slips if slip.is_open for name in slip.observables)
    return capital(say(text, names=enumeration(map(spaced, off)))) if off else ""


def _slip(slip: Slip) -> str:
    if slip.exchanged:
        two = slip.observables if len(slip.observables) == 2 else slip.conditions
        return say("misses.exchanged", names=enumeration(map(spaced, two)))
    names, many = enumeration(map(spaced, slip.observables)), len(slip.observables) > 1
    heap = "" if slip.replicate is None else f"heap {slip.replicate} under {slip.conditions[0]}"
    if not heap and len(slip.conditions) == 1:
        return say("misses.condition", name=slip.conditions[0])
    how = f"{'are' if many else 'is'} far from all that the rest allows"
    if heap:
        names, how = (heap, "is none of the others") if many else (f"{names} of {heap}", how)
        many = False
    first = "Misread or moved" if slip.is_open else "A likely slip"
    if slip.factor is None:
        return f"{first}: {names} {how}."
    look = "look" if many else "looks"
    return say("misses.factor", first=first, names=names, look=look, factor=trimmed(slip.factor, 3))


@dataclass(frozen=True)
class _Miss:
    """Miss of one observable."""

    observable: str
    condition: str
    """Condition in which it is off most; empty if it is off alike in all."""
    away: float
    """Measured less predicted."""
    deviations: float
    error: str
    """Distribution that the deviations are of."""

    def sentence(self, terms: Terms) -> str:
        """``t55 is 7 ms late in all conditions``, or where it is off most."""
        factor, unit = terms.scale(self.observable)
        late = terms.observables[self.observable].instrument is Instrument.FILM
        more, less = ("late", "early") if late else ("too large", "too small")
        size = f"{trimmed(abs(factor * self.away), 2)} {unit}".strip()
        where = f"under {self.condition}" if self.condition else "in all conditions"
        return say(
            "misses.off",
            name=spaced(self.observable),
            size=size,
            direction=more if self.away > 0.0 else less,
            where=where,
            deviations=trimmed(self.deviations, 2),
            error=self.error,
        )


def _missed(found: Discovery, fit: Fit) -> list[_Miss]:
    """Find what a model misses: single means beyond chance, and what is off alike in all conditions."""
    single = _standing_out(found, fit)
    passes = bool(found.candidates) and found.candidates[0].admitted
    if passes or (single and fit.clearest.question is not Question.COMMON):
        return single
    names = {one.observable for one in single}
    return [*single, *(one for one in _off_alike(found, fit) if one.observable not in names)][:SHOWN]


def _standing_out(found: Discovery, fit: Fit) -> list[_Miss]:
    clear = np.where(np.nan_to_num(fit.adjusted_p, nan=1.0) < CLEAR, np.abs(fit.residuals), 0.0)
    order = np.argsort(-clear.max(axis=0))
    return [_worst(found, fit, int(at)) for at in order[:SHOWN] if clear[:, at].any()]


def _worst(found: Discovery, fit: Fit, at: int) -> _Miss:
    away = found.data.means[:, at] - fit.predicted[:, at]
    residuals, rows = fit.residuals[:, at], np.flatnonzero(np.isfinite(fit.residuals[:, at]))
    everywhere = len(rows) > 1 and ((residuals[rows] > ALIKE).all() or (residuals[rows] < -ALIKE).all())
    worst = rows[np.argmax(np.abs(residuals[rows]))]
    condition = "" if everywhere else found.data.conditions[worst]
    value = float(np.mean(away[rows])) if everywhere else float(away[worst])
    deviations = np.abs(residuals[rows]).mean() if everywhere else abs(residuals[worst])
    return _Miss(found.data.observables[at], condition, value, float(deviations), "standard deviations")


def _off_alike(found: Discovery, fit: Fit) -> list[_Miss]:
    """Find the observables whose mean over the conditions is off, the clearest first; at least one.

    A mean is weighted by the variances of its residuals.
    """
    off = []
    for at, name in enumerate(found.data.observables):
        residuals, away = fit.residuals[:, at], found.data.means[:, at] - fit.predicted[:, at]
        rows = np.isfinite(residuals) & (residuals != 0.0)
        if rows.sum() > 1:
            weights = (residuals[rows] / away[rows]) ** 2
            mean = float(weights @ away[rows] / weights.sum())
            error = "standard errors of the mean"
            off.append(_Miss(name, "", mean, abs(mean) * float(weights.sum()) ** 0.5, error))
    off.sort(key=lambda one: -one.deviations)
    return [one for rank, one in enumerate(off[:SHOWN]) if not rank or one.deviations > CLEARLY]


def heading_phrase(fit: Fit) -> str:
    """Say towards where a directed mechanism is, seen in the pictures; empty without one."""
    if fit.heading is None:
        return ""
    towards = {0.0: "to the right of the pictures (+x)", 180.0: "to the left of the pictures (-x)"}
    # pictures from one side do not tell if it is towards the camera or away from it
    off = min(fit.heading, 360.0 - fit.heading)
    return f", down {towards.get(fit.heading, say('misses.heading', off=off))}"


def slip_decides(found: Discovery) -> bool:
    """Say if what is found hangs on likely slips.

    Those beyond one heap make the whole misfit, whichever verdict it gets with them and without them.
    """
    rest = found.without_slips
    if rest is None:
        return False
    differs = (rest.verdict, set(rest.named)) != (found.verdict, set(found.named))
    return differs or any(slip.replicate is None for slip in found.slips)


def with_and_without(found: Discovery, terms: Terms) -> str:
    """Say the verdict with and without likely slips; empty where there is none."""
    rest = found.without_slips
    if rest is None:
        return ""
    if (rest.verdict, set(rest.named)) == (found.verdict, set(found.named)):
        return "Without these values the verdict is the same."
    words = {
        Verdict.NONE: "nothing is missing",
        Verdict.UNKNOWN: "something is missing that the library does not explain",
        Verdict.NOT_IDENTIFIABLE: "the data cannot tell",
    }
    verdicts = [
        words.get(one.verdict, f"{one.verdict.value}: {terms.titles(one.named)}") for one in (rest, found)
    ]
    return say("misses.both", without=verdicts[0], with_them=verdicts[1])
