"""Misses of a model, in words: which observable, where, by how much; what looks the same; likely slips."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from doe.discrepancy import Discovery, Fit, Slip, Verdict
from experiments.measurement.observables import Instrument
from experiments.report.discovery.terms import Terms, spaced
from experiments.report.kit.numbers import enumeration, trimmed

CLEAR = 0.05
"""Adjusted p value below which a residual is told."""
SHOWN = 4
"""Observables that are told of."""
ALIKE = 1.0
"""Standard deviations that a residual has at least where it is one of all conditions."""

_CONVENTIONS = {
    Instrument.FILM: "a start of the clock, or a frame rate, other than the definition's",
    Instrument.RULER: "a filling measured to another level than the mean surface",
    Instrument.BALANCE: "a balance that was not set to zero, or a share of another whole",
    Instrument.PHOTOGRAPH: "a scale, a roll of the camera or a fit of the flank other than the study's",
    Instrument.SCAN: "a scan whose plate is not at height zero",
}


def misses(found: Discovery, terms: Terms) -> list[str]:
    """Say which observables the closest model misses, where and by how much, the clearest first."""
    fit = found.closest or found.base
    if fit is None:
        return []
    clear = np.where(np.nan_to_num(fit.adjusted_p, nan=1.0) < CLEAR, np.abs(fit.residuals), 0.0)
    order = np.argsort(-clear.max(axis=0))
    return [_missed(found, fit, terms, int(at)) for at in order[:SHOWN] if clear[:, at].any()]


def conventions(found: Discovery, terms: Terms) -> list[str]:
    """Say which conventions or slips would look as what is missed does, one an instrument."""
    fit = found.closest or found.base
    if fit is None:
        return []
    clear = (np.nan_to_num(fit.adjusted_p, nan=1.0) < CLEAR).any(axis=0)
    told: dict[str, list[str]] = {}
    for at in np.flatnonzero(clear):
        name = found.data.observables[at]
        instrument = terms.observables[name].instrument
        if instrument is not None:
            told.setdefault(_CONVENTIONS[instrument], []).append(spaced(name))
    return [f"For {enumeration(names)}: {text} would look the same." for text, names in told.items()]


def slip_sentences(found: Discovery) -> Iterator[str]:
    """Say what likely slips there are, each with what shows it."""
    for slip in found.slips:
        if slip.replicate is not None:
            yield f"{_slip(slip)} It lies {trimmed(slip.q_with**0.5, 2)} standard deviations from the others."
        else:
            after = "once they are exchanged back" if slip.exchanged else "without these values"
            before = f"Q of the base is {trimmed(slip.q_with, 3)}"
            yield f"{_slip(slip)} {before}, and {trimmed(slip.q_without, 3)} {after}."


def _slip(slip: Slip) -> str:
    names = enumeration(map(spaced, slip.observables))
    if slip.exchanged:
        return f"A likely slip: the conditions {enumeration(slip.conditions)} look exchanged."
    where = ""
    if slip.replicate is not None:
        where = f" of heap {slip.replicate} under {slip.conditions[0]}"
    elif len(slip.conditions) == 1:
        return f"A likely slip: what was measured under {slip.conditions[0]} fits nothing else."
    how = "is far from all that the rest allows"
    if slip.factor is not None:
        how = f"looks as if multiplied by {trimmed(slip.factor, 3)}: a unit, a digit or a sign?"
    return f"A likely slip: {names}{where} {how.rstrip('.')}{'' if how.endswith('?') else '.'}"


def _missed(found: Discovery, fit: Fit, terms: Terms, at: int) -> str:
    """``t55 is 7 ms late in all conditions``, or where it is off most."""
    name = found.data.observables[at]
    factor, unit = terms.scale(name)
    away = factor * (found.data.means[:, at] - fit.predicted[:, at])
    residuals, rows = fit.residuals[:, at], np.flatnonzero(np.isfinite(fit.residuals[:, at]))
    everywhere = len(rows) > 1 and ((residuals[rows] > ALIKE).all() or (residuals[rows] < -ALIKE).all())
    worst = rows[np.argmax(np.abs(residuals[rows]))]
    value = float(np.mean(away[rows])) if everywhere else float(away[worst])
    instrument = terms.observables[name].instrument
    more, less = ("late", "early") if instrument is Instrument.FILM else ("too large", "too small")
    where = "in all conditions" if everywhere else f"under {found.data.conditions[worst]}"
    size = f"{trimmed(abs(value), 2)} {unit}".strip()
    deviations = np.abs(residuals[rows]).mean() if everywhere else abs(residuals[worst])
    return (
        f"{spaced(name)} is {size} {more if value > 0.0 else less} {where}"
        f" ({trimmed(float(deviations), 2)} standard deviations)."
    )


def heading_phrase(fit: Fit) -> str:
    """Say towards where a directed mechanism is, seen in the pictures; empty without one."""
    if fit.heading is None:
        return ""
    towards = {0.0: "to the right of the pictures (+x)", 180.0: "to the left of the pictures (-x)"}
    # pictures from one side do not tell if it is towards the camera or away from it
    off = min(fit.heading, 360.0 - fit.heading)
    other = f"some {off:.0f} degrees off the right of the pictures, towards the camera or away from it"
    return f", down {towards.get(fit.heading, other)}"


def with_and_without(found: Discovery) -> str:
    """Say the verdict with and without likely slips; empty where there is none."""
    rest = found.without_slips
    if rest is None:
        return ""
    words = {
        Verdict.NONE: "nothing is missing",
        Verdict.UNKNOWN: "something is missing that the library does not explain",
        Verdict.NOT_IDENTIFIABLE: "the data cannot tell",
    }
    told = [
        words.get(one.verdict, f"{one.verdict.value}: {enumeration(map(spaced, one.named))}")
        for one in (rest, found)
    ]
    return f"Without the values of the likely slip: {told[0]}. With them: {told[1]}."
