"""The page on what is missing: the verdict, and all that it rests on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from doe.discrepancy import Discovery, Settings, Verdict
from experiments.report.cautions import Caution, study_cautions
from experiments.report.discovery import discovery_charts, discovery_tables
from experiments.report.discovery.disagreement import conventions, misses, slip_decides
from experiments.report.discovery.discovery_verdict import (
    SETTLED,
    changes,
    headline,
    next_step,
    reason_sentence,
    verdict_sentence,
)
from experiments.report.discovery.search_text import search_pastes
from experiments.report.discovery.terms import Terms, percent
from experiments.report.kit.chart import Chart
from experiments.report.kit.html import Chapter, flat, render_page
from experiments.report.kit.numbers import trimmed
from experiments.report.kit.table import Table
from experiments.report.pictures import HeapPicture
from experiments.report.solid import SolidHeap
from experiments.report.study_facts import study_facts
from experiments.studyfile import Study

TITLES = {
    "gap": "Where the model disagrees",
    "candidates": "What could be missing",
    "before_after": "The gap before and after",
    "compared": "Predicted against measured",
    "heaps": "Heaps side by side",
    "power": "What these data could show",
    "changes": "What would change the verdict",
    "data": "The data",
    "paper_text": "For your paper",
    "provenance": "Settings and provenance",
}
"""Headings by chapter, in the order of the page."""


def _chapter(
    name: str, tables: Mapping[str, Table] | None = None, charts: Mapping[str, Sequence[Chart]] | None = None
) -> Chapter:
    return Chapter(name, TITLES[name], tables or {}, charts or {}, template=f"discovery/{name}.html.j2")


def render_discovery(
    found: Discovery,
    study: Study,
    terms: Terms,
    settings: Settings,
    pictures: Sequence[HeapPicture] = (),
    files: Sequence[str] = (),
    provenance: Mapping[str, Any] | None = None,
    further: Sequence[Chapter] = (),
    solid: SolidHeap | None = None,
) -> str:
    """Render the report of an analysis as one self-contained HTML page.

    It shows pictures of heaps, a heap in three dimensions, links to study files with the mechanism added,
    the companion's further chapters, and the nested values of the provenance.
    """
    if found.verdict is Verdict.NOT_IDENTIFIABLE:
        # A fit with nothing left to test it by would fill the page with zeros.
        found = replace(found, base=None, gap=None, drifts=(), candidates=(), power=(), confounding=None)
    *chapters, last = _chapters(found, terms)
    shown = [chapter for chapter in chapters if pictures or chapter.name != "heaps"]
    said = found.candidates[0].objection if found.candidates and found.verdict is Verdict.UNKNOWN else ""
    drawn_on = {
        "found": found,
        "study": study,
        "terms": terms,
        "headline": headline(found, terms),
        "sentence": verdict_sentence(found, terms),
        "reason": "" if said and said in found.reason else reason_sentence(found, terms),
        "settled": found.verdict in SETTLED and not slip_decides(found),
        **_missed(found, terms),
        "cards": _cards(found, terms),
        "explained": found.named,
        "next_step": next_step(found, terms),
        "changes": changes(found, terms, settings),
        "cautions": [
            *study_cautions(study),
            *(Caution(f"{terms.in_words(note).rstrip('.')}.", "data") for note in found.notes),
        ],
        "pastes": search_pastes(found, study, terms, provenance or {}),
        "pictures": pictures,
        "solid": solid,
        "files": files,
        "facts": study_facts(study),
        "provenance": flat(provenance or {}),
        "rules": flat(asdict(settings)),
        "document": flat(study.document),
    }
    summary, chapters = "discovery/summary.html.j2", [*shown, *further, last]
    return render_page("report on a disagreement", study.name, summary, chapters, drawn_on)


def _missed(found: Discovery, terms: Terms) -> dict[str, Any]:
    """Collect what the summary says of a model that nothing explains; a likely slip is looked at before."""
    unknown = found.verdict is Verdict.UNKNOWN and not slip_decides(found)
    return {
        "misses": misses(found, terms)[1:] if unknown else [],  # the sentence tells the first
        "conventions": conventions(found, terms) if unknown else [],
        "step_first": unknown or found.verdict is Verdict.TIE or slip_decides(found),
    }


@dataclass(frozen=True)
class Card:
    """One figure of the summary."""

    title: str
    value: str
    more: str


def _cards(found: Discovery, terms: Terms) -> list[Card]:
    cards, verdict = [], found.verdict
    if found.base and verdict not in (Verdict.NONE, Verdict.UNKNOWN):
        df, limit = found.base.degrees_of_freedom, trimmed(found.base.q_limit, 3)
        more = f"{df:.0f} degrees of freedom, limit {limit}"
        cards.append(Card("Q of the calibrated base", trimmed(found.base.q, 3), more))
    if found.gap and found.gap.drop_mechanism and verdict is Verdict.NONE:
        more = f"{terms.title(found.gap.drop_mechanism)}; limit {trimmed(found.gap.drop_limit, 3)}"
        cards.append(Card("Largest fall of Q by one mechanism", trimmed(found.gap.largest_drop, 3), more))
    for both in found.before_after:
        if verdict is Verdict.NAMED and not both.held_out:
            continue
        where = "held out" if both.held_out else "training"
        ends = f"90 % interval {percent(both.removed.low)} to {percent(both.removed.high)}, fresh runs"
        cards.append(Card(f"Excess removed, {where}", percent(both.removed.value), ends))
    return cards


def _chapters(found: Discovery, terms: Terms) -> list[Chapter]:
    compared = discovery_charts.comparison_charts(found, terms)
    built = {
        "gap": _gap(found, terms),
        "candidates": _candidates(found, terms),
        "before_after": _before_after(found),
        "compared": _chapter("compared", charts={"compared": compared}) if found.base else None,
        "heaps": _chapter("heaps"),
        "power": _chapter("power", {"power": discovery_tables.power_table(found, terms)})
        if found.power
        else None,
        "changes": _chapter("changes"),
        "data": _chapter("data", {"data": discovery_tables.data_table(found, terms)}),
        "paper_text": Chapter("paper_text", TITLES["paper_text"], template="sections/paper_text.html.j2")
        if found.base
        else None,
        "provenance": _chapter("provenance"),
    }
    return [chapter for name in TITLES if (chapter := built[name]) is not None]


def _gap(found: Discovery, terms: Terms) -> Chapter | None:
    if found.base is None:
        return None
    shown = {"parameters": discovery_tables.parameters_table(found, terms)}
    if (calibration := discovery_tables.calibration_table(found, terms)) is not None:
        shown["calibration"] = calibration
    if found.drifts:
        shown["drifts"] = discovery_tables.drifts_table(found, terms)
    return _chapter("gap", shown, {"maps": discovery_charts.residual_maps(found, terms)})


def _candidates(found: Discovery, terms: Terms) -> Chapter | None:
    if not found.candidates:
        return None
    drawn = {}
    if found.base and found.base.excess:
        drawn["explained"] = [discovery_charts.explained_chart(found, terms)]
    if found.confounding:
        drawn["confounding"] = [discovery_charts.confounding_chart(found.confounding, terms)]
    return _chapter("candidates", {"candidates": discovery_tables.candidates_table(found, terms)}, drawn)


def _before_after(found: Discovery) -> Chapter | None:
    if not found.before_after:
        return None
    gaps = {"gaps": discovery_tables.before_after_table(found)}
    return _chapter("before_after", gaps, {"gaps": [discovery_charts.gap_chart(found)]})
