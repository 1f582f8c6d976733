"""The page on what is missing: the verdict, and all that it rests on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from markupsafe import Markup
from plotly.offline import get_plotlyjs

from experiments.discover.discovery import Discovery, Verdict
from experiments.discover.settings import Settings
from experiments.report.discovery import charts, tables
from experiments.report.discovery.terms import Terms, percent
from experiments.report.discovery.verdict import (
    SETTLED,
    changes,
    headline,
    next_step,
    reason_sentence,
    verdict_sentence,
)
from experiments.report.kit.numbers import capital, trimmed
from experiments.report.campaign_page import environment, flat, study_facts
from experiments.report.pictures import HeapPicture
from experiments.report.kit.table import Table
from experiments.report.kit.chart import Chart
from experiments.studyfile import Study

TITLES = {
    "gap": "Where the model disagrees",
    "candidates": "What could be missing",
    "before_after": "The gap before and after",
    "compared": "Predicted against measured",
    "heaps": "Heaps side by side",
    "power": "What these data could show",
    "changes": "What would change the verdict",
    "data": "The data, and notes on them",
    "provenance": "Settings and provenance",
}
"""Headings by section, in the order of the page."""


@dataclass(frozen=True)
class Section:
    """One section of the page."""

    name: str
    """Its anchor, and the name of the template that fills it."""
    tables: dict[str, Table] = field(default_factory=dict)
    charts: dict[str, list[Chart]] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """Heading."""
        return TITLES[self.name]


def render_discovery(
    found: Discovery,
    study: Study,
    terms: Terms,
    settings: Settings,
    pictures: Sequence[HeapPicture] = (),
    files: Sequence[str] = (),
    provenance: Mapping[str, Any] | None = None,
) -> str:
    """Render the report of an analysis as one self-contained HTML page.

    Parameters
    ----------
    found
        What the analysis found.
    study
        The study that was analysed.
    terms
        What the names mean.
    settings
        The rules of the analysis.
    pictures
        Heaps to show side by side.
    files
        Study files with the mechanism added that lie beside the page.
    provenance
        What made the numbers: names and values, nested as they come.
    """
    if found.verdict is Verdict.NOT_IDENTIFIABLE:
        # A fit with nothing left to test it by would fill the page with zeros.
        found = replace(found, base=None, gap=None, drifts=(), candidates=(), power=(), confounding=None)
    page = environment().get_template("page.html.j2")
    return page.render(
        kind="report on a disagreement",
        folder="discovery",
        found=found,
        study=study,
        terms=terms,
        headline=headline(found, terms),
        sentence=verdict_sentence(found, terms),
        reason=reason_sentence(found),
        settled=found.verdict in SETTLED,
        cards=_cards(found, terms),
        explained=found.named,
        next_step=next_step(found, terms),
        changes=changes(found, terms, settings),
        sections=[section for section in _sections(found, terms) if pictures or section.name != "heaps"],
        pictures=pictures,
        files=files,
        facts=study_facts(study),
        provenance=flat(provenance or {}),
        rules=flat(asdict(settings)),
        document=flat(study.document),
        plotly=Markup(get_plotlyjs()),
    )


@dataclass(frozen=True)
class Card:
    """One figure of the summary."""

    title: str
    value: str
    more: str


def _cards(found: Discovery, terms: Terms) -> list[Card]:
    cards = []
    if found.base:
        more = (
            f"{found.base.degrees_of_freedom:.0f} degrees of freedom, limit {trimmed(found.base.q_limit, 3)}"
        )
        cards.append(Card("Q of the calibrated base", trimmed(found.base.q, 3), more))
    if found.gap and found.gap.drop_mechanism and not found.chosen:
        more = f"{terms.title(found.gap.drop_mechanism)}; limit {trimmed(found.gap.drop_limit, 3)}"
        cards.append(Card("Largest fall of Q by one mechanism", trimmed(found.gap.largest_drop, 3), more))
    if found.chosen:
        for name, size in zip(found.chosen.mechanisms, found.chosen.sizes, strict=True):
            ends = f"90 % interval {trimmed(size.low, 3)} to {trimmed(size.high, 3)}"
            cards.append(Card(capital(terms.title(name)), terms.value(name, size.value), ends))
    for both in found.before_after:
        where = "held out" if both.held_out else "training"
        ends = f"90 % interval {percent(both.removed.low)} to {percent(both.removed.high)}, fresh runs"
        cards.append(Card(f"Excess removed, {where}", percent(both.removed.value), ends))
    return cards


def _sections(found: Discovery, terms: Terms) -> list[Section]:
    """Build the sections that this discovery has something for."""
    built = {
        "gap": _gap(found, terms),
        "candidates": _candidates(found, terms),
        "before_after": _before_after(found),
        "compared": _compared(found, terms),
        "heaps": Section("heaps"),
        "power": Section("power", {"power": tables.power_table(found, terms)}) if found.power else None,
        "changes": Section("changes"),
        "data": Section("data", {"data": tables.data_table(found, terms)}),
        "provenance": Section("provenance"),
    }
    return [section for name in TITLES if (section := built[name]) is not None]


def _gap(found: Discovery, terms: Terms) -> Section | None:
    if found.base is None:
        return None
    shown = {"parameters": tables.parameters_table(found, terms)}
    if found.drifts:
        shown["drifts"] = tables.drifts_table(found)
    return Section("gap", shown, {"maps": charts.residual_maps(found, terms)})


def _candidates(found: Discovery, terms: Terms) -> Section | None:
    if not found.candidates:
        return None
    drawn = {}
    if found.base and found.base.excess:
        drawn["explained"] = [charts.explained_chart(found, terms)]
    if found.confounding:
        drawn["confounding"] = [charts.confounding_chart(found.confounding, terms)]
    return Section("candidates", {"candidates": tables.candidates_table(found, terms)}, drawn)


def _before_after(found: Discovery) -> Section | None:
    if not found.before_after:
        return None
    return Section(
        "before_after", {"gaps": tables.before_after_table(found)}, {"gaps": [charts.gap_chart(found)]}
    )


def _compared(found: Discovery, terms: Terms) -> Section | None:
    if found.base is None:
        return None
    return Section("compared", charts={"compared": charts.comparison_charts(found, terms)})
