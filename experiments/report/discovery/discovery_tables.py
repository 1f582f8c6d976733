"""Tables of a discovery: the same numbers as frames for the CSV files, and laid out for the page."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

import numpy as np
import pandas as pd

from doe.discrepancy import BeforeAfter, Candidate, Discovery, Drift, Fit, Interval, Power
from experiments.report.discovery.terms import GAP, Terms, condition_name, percent, spaced
from experiments.report.kit.numbers import MISSING, estimate, trimmed
from experiments.report.kit.sentences import say
from experiments.report.kit.table import Column, Layout, Table, columns, make_table

T = TypeVar("T")
Entries = dict[Column, Callable[[T], object]]
"""Columns of a table, each with what it shows of an item."""

SHOWN_PAIRS = 5
"""Pairs of mechanisms that the page shows."""


def frames(found: Discovery) -> dict[str, pd.DataFrame]:
    """Every table of a discovery by file name (without ending); numbers in full, in natural units."""
    tables = {
        "compared": compared_frame(found),
        "candidates": pd.DataFrame([_candidate_row(candidate) for candidate in found.candidates]),
        "power": pd.DataFrame([vars(power) for power in found.power]),
        "parameters": parameters_frame(found),
        "before_after": pd.DataFrame([_before_after_row(both) for both in found.before_after]),
        "drifts": pd.DataFrame(
            [
                {"factor": drift.factor, "condition": name, "value": value, "se": se, "p": drift.p_value}
                for drift in found.drifts
                for name, value, se in _by_condition(drift)
            ]
        ),
    }
    uses = {name: fit.calibration for name, fit in _models(found).items()}
    tables["calibration"] = pd.DataFrame(
        [{"model": name} | vars(use) for name, each in uses.items() for use in each]
    )
    if found.confounding:
        names = list(found.confounding.mechanisms)
        matrix = pd.DataFrame(found.confounding.correlations, index=names, columns=names)
        tables["confounding"] = matrix.rename_axis("mechanism").reset_index()
    return {name: table for name, table in tables.items() if len(table)}


def compared_frame(found: Discovery) -> pd.DataFrame:
    """Compare measured means with the base and the chosen model: one row a condition and observable."""
    data = found.data
    rows = []
    for at, value in np.ndenumerate(data.means):
        if not np.isfinite(value):
            continue
        row = {
            "condition": data.conditions[at[0]],
            "held_out": data.held_out[at[0]],
            "observable": data.observables[at[1]],
            "replicates": int(data.replicates[at]),
            "measured": value,
            "measured_se": data.standard_errors[at],
        }
        for name, fit in _models(found).items():
            row |= {name: fit.predicted[at], f"{name}_se": fit.predicted_se[at]}
            row |= {f"{name}_residual": fit.residuals[at], f"{name}_adjusted_p": fit.adjusted_p[at]}
        rows.append(row)
    return pd.DataFrame(rows)


def parameters_frame(found: Discovery) -> pd.DataFrame:
    """Fitted factors of the base and of the chosen model, one row a factor."""
    rows = []
    for position, factor in enumerate(found.factors):
        row: dict[str, object] = {"factor": factor}
        for name, fit in _models(found).items():
            row |= {name: fit.theta[position], f"{name}_se": fit.theta_se[position]}
        rows.append(row)
    return pd.DataFrame(rows)


def shown_candidates(found: Discovery) -> list[Candidate]:
    """Candidates that the page shows, in their order: every mechanism, and the first pairs."""
    pairs = [candidate for candidate in found.candidates if len(candidate.mechanisms) > 1]
    return [candidate for candidate in found.candidates if candidate not in pairs[SHOWN_PAIRS:]]


def candidates_table(found: Discovery, terms: Terms) -> Table:
    """Lay out the candidates that `shown_candidates` picks."""
    shown = shown_candidates(found)
    excess = found.base.excess if found.base else 0.0
    ranks = {id(candidate): rank for rank, candidate in enumerate(shown, start=1)}
    entries: Entries[Candidate] = {
        Column("rank", "rank", "count"): lambda one: ranks[id(one)],
        Column("mechanism", "mechanism"): lambda one: terms.titles(one.mechanisms),
        Column("explained", "explains", "percent", "% of excess"): lambda one: (
            100.0 * one.explained if excess else None
        ),
        Column("q", "Q", "free"): lambda one: one.q,
        Column("p", "p of the fit", "p"): lambda one: one.p_value,
        Column("size", "size [90 % interval]"): lambda one: _sizes(one, terms),
        Column("over_se", "size / se", "ratio"): lambda one: min(one.size_over_se),
        Column("gain", "held-out gain"): lambda one: _interval(one.held_out_gain, 1),
        Column("judged", "judgement"): lambda one: "admitted" if one.admitted else one.objection,
    }
    note = say("note.candidates", share="" if excess else say("note.no_excess"))
    if left_out := len(found.candidates) - len(shown):
        note += say("note.pairs_left", count=left_out)
    named = set(found.named)
    marks = ["chosen" if one.admitted and set(one.mechanisms) <= named else "" for one in shown]
    pairs = any(len(one.mechanisms) > 1 for one in shown)
    title = f"Mechanisms of the library{', and pairs of them, each' if pairs else ','} best first."
    return _laid_out("candidates", shown, entries, title, note, marks)


def power_table(found: Discovery, terms: Terms) -> Table:
    """Lay out the smallest size of each mechanism that the data could show."""
    entries: Entries[Power] = {
        Column("mechanism", "mechanism"): lambda one: terms.title(one.mechanism),
        Column("what", "what it does"): lambda one: terms.mechanisms[one.mechanism].sentence,
        Column("least", "smallest size named"): lambda one: terms.value(one.mechanism, one.detectable_size),
        Column("maximum", "end of its range"): lambda one: terms.value(one.mechanism, one.maximum),
        Column("share", "of the range", "percent", "%"): lambda one: 100 * one.detectable_size / one.maximum,
        Column("visible", "left after calibration", "percent", "%"): lambda one: 100.0 * one.visible_share,
        Column("resolvable", "resolvable"): lambda one: "yes" if one.resolvable else "no",
    }
    caption = "The smallest size of each mechanism that shows."
    return _laid_out("power", found.power, entries, caption, say("note.power"))


def before_after_table(found: Discovery) -> Table:
    """Lay out the gap of fresh runs before and after."""
    entries: Entries[BeforeAfter] = {
        Column("set", "conditions"): lambda one: (
            "held-out conditions" if one.held_out else "training conditions"
        ),
        Column("df", "degrees of freedom", "count"): lambda one: one.degrees_of_freedom,
        Column("before", "Q of the base"): lambda one: _interval(one.before, 1),
        Column("after", "Q with the mechanism"): lambda one: _interval(one.after, 1),
        Column("removed", "excess removed [%]"): lambda one: _interval(_times(one.removed, 100.0), 0),
        Column("runs", "fresh runs a model and condition", "count"): lambda one: one.runs,
    }
    caption = "The gap before and after."
    return _laid_out("before-after", found.before_after, entries, caption, say("note.before_after"))


def parameters_table(found: Discovery, terms: Terms) -> Table:
    """Lay out the fitted factors of both models."""
    frame = parameters_frame(found)
    frame["label"] = [terms.factors[name].label for name in frame["factor"]]
    frame["unit"] = [terms.factors[name].unit for name in frame["factor"]]
    models = _models(found).items()
    frame["bound"] = [
        ", ".join(model for model, fit in models if factor in fit.at_bounds) for factor in frame["factor"]
    ]
    titles = {"base": "base", "chosen": "with the mechanism", "closest": "closest model"}
    heads = {f"{name}{end}": "se" if end else title for name, title in titles.items() for end in ("", "_se")}
    numbers = columns("level", **heads)
    for number in (column.key for column in numbers if column.key in frame):
        frame[number] = [float(f"{value:.3g}") for value in frame[number]]
    frame = frame.drop(columns=[name for name in ("unit", "bound") if not frame[name].any()])
    words = columns(label="what it is", unit="unit", bound="at an end of its range")
    return make_table("parameters", frame, ["factor", words[0], *numbers, *words[1:]], "The fitted factors.")


def calibration_table(found: Discovery, terms: Terms) -> Table | None:
    """Lay out the calibration errors that were allowed, and how much each model uses; None without any."""
    rows = []
    models = {name: {use.observable: use for use in fit.calibration} for name, fit in _models(found).items()}
    for observable, allowed in next(iter(models.values()), {}).items():
        factor, unit = terms.scale(observable)
        row: dict[str, object] = {"observable": spaced(observable)}
        row["offset"] = f"{trimmed(factor * allowed.offset, 2)}{GAP}{unit}" if allowed.offset else MISSING
        row["scale"] = percent(allowed.scale, 1) if allowed.scale else MISSING
        for name, uses in models.items():
            use = uses[observable]
            row[name] = f"{trimmed(factor * use.used_offset, 2)}{GAP}{unit}".strip()
            row[f"{name}_sd"] = use.deviations
        rows.append(row)
    if not rows:
        return None
    shown: Layout = ["observable", Column("offset", "offset allowed"), Column("scale", "scale allowed")]
    for name, title in {"base": "base", "chosen": "with the mechanism", "closest": "closest model"}.items():
        if name in models:
            shown += [Column(name, f"offset used, {title}"), Column(f"{name}_sd", "of both, in sd", "ratio")]
    caption = "What instruments may be off by."
    return make_table("calibration", pd.DataFrame(rows), shown, caption, say("note.calibration"))


def drifts_table(found: Discovery, terms: Terms) -> Table:
    """Lay out the factors fitted to one condition at a time."""
    rows = [
        {"factor": drift.factor, "label": terms.factors[drift.factor].label}
        | {name: _estimate(value, se) for name, value, se in _by_condition(drift)}
        | {"p": drift.p_value}
        for drift in found.drifts
    ]
    names = dict.fromkeys(name for drift in found.drifts for name in drift.conditions)
    marks = ["strong" if drift.p_value < 0.05 else "" for drift in found.drifts]
    caption = "Factors of the base, fitted condition by condition."
    shown: Layout = ["factor", Column("label", "what it is"), *names, "p"]
    return make_table("drifts", pd.DataFrame(rows), shown, caption, say("note.drifts"), marks)


def data_table(found: Discovery, terms: Terms) -> Table:
    """Lay out the measured means: a row an observable, a column a condition, of those that were measured."""
    data = found.data
    rows = []
    measured = np.isfinite(data.means)
    for at in np.flatnonzero(measured.any(axis=0)):
        factor = terms.scale(data.observables[at])[0]
        estimates = zip(factor * data.means[:, at], factor * data.standard_errors[:, at], strict=True)
        shown = [_estimate(mean, se) if np.isfinite(mean) else MISSING for mean, se in estimates]
        row = dict(zip(data.conditions, shown, strict=True))
        rows.append({"observable": terms.axis(data.observables[at]), **row})
    heaps = [str(count) for count in data.replicates.max(axis=1)]
    rows.append({"observable": "heaps", **dict(zip(data.conditions, heaps, strict=True))})
    heads = [
        Column(data.conditions[at], condition_name(data.conditions[at], data.held_out[at]))
        for at in np.flatnonzero(measured.any(axis=1))
    ]
    caption = "Measured means and their standard errors."
    return make_table("data", pd.DataFrame(rows), ["observable", *heads], caption)


def _laid_out(
    name: str, items: Sequence[T], entries: Entries[T], caption: str, note: str, marks: Sequence[str] = ()
) -> Table:
    frame = pd.DataFrame([{column.key: take(one) for column, take in entries.items()} for one in items])
    return make_table(name, frame, list(entries), caption, note, marks or None)


def _models(found: Discovery) -> dict[str, Fit]:
    fits = {"base": found.base, "chosen": found.chosen, "closest": found.closest}
    return {name: fit for name, fit in fits.items() if fit is not None}


def _candidate_row(candidate: Candidate) -> dict[str, object]:
    first = ("explained", "score", "visible_share", "q", "degrees_of_freedom", "p_value")
    row: dict[str, object] = {"mechanisms": "+".join(candidate.mechanisms)}
    row |= {name: getattr(candidate, name) for name in first}
    for position, (size, over) in enumerate(zip(candidate.sizes, candidate.size_over_se, strict=True), 1):
        row |= _ends(f"size_{position}", size) | {f"size_{position}_over_se": over}
    row |= _ends("held_out_gain", candidate.held_out_gain)
    return row | {name: getattr(candidate, name) for name in ("simulated", "admitted", "objection")}


def _before_after_row(both: BeforeAfter) -> dict[str, object]:
    row: dict[str, object] = {"held_out": both.held_out, "degrees_of_freedom": both.degrees_of_freedom}
    for name in ("before", "after", "removed"):
        row |= _ends(name, getattr(both, name))
    return row | {"runs": both.runs}


def _ends(name: str, ends: Interval | None) -> dict[str, float | None]:
    value, low, high = (ends.value, ends.low, ends.high) if ends else (None, None, None)
    return {name: value, f"{name}_low": low, f"{name}_high": high}


def _by_condition(drift: Drift) -> Iterator[tuple[str, float, float]]:
    return zip(drift.conditions, drift.values, drift.standard_errors, strict=True)


def _sizes(candidate: Candidate, terms: Terms) -> str:
    pairs = zip(candidate.mechanisms, candidate.sizes, strict=True)
    return "; ".join(terms.short_size(name, size) for name, size in pairs)


def _interval(ends: Interval | None, decimals: int) -> str:
    if ends is None:
        return MISSING
    return estimate(ends.value, ends.low, ends.high, decimals).replace(" ", GAP)


def _estimate(value: float, se: float) -> str:
    return f"{trimmed(value, 3)}{GAP}±{GAP}{trimmed(se, 2)}"


def _times(ends: Interval, factor: float) -> Interval:
    return Interval(factor * ends.low, factor * ends.value, factor * ends.high)
