"""Self-contained pages in HTML: a summary, chapters with tables and charts, one style."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import jinja2
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from experiments.report.kit import numbers, theme
from experiments.report.kit.chart import Chart
from experiments.report.kit.table import Table

TEMPLATE = "chapter.html.j2"
"""Template of a chapter that needs none of its own: its text, its charts, its tables."""


SHORT_ROWS = 20
"""Rows up to which a table is not broken between two sheets of paper."""


@dataclass(frozen=True)
class Chapter:
    """One chapter of a page."""

    name: str
    """Its anchor."""
    title: str
    """Its heading."""
    tables: Mapping[str, Table] = field(default_factory=dict)
    """Tables by the names that its template uses."""
    charts: Sequence[Chart] | Mapping[str, Sequence[Chart]] = ()
    """Charts in the order of the page, or by the names that its template uses."""
    text: str = ""
    """Paragraph above charts and tables, where the template is the common one."""
    template: str = TEMPLATE
    """Template that fills it."""


def render_page(
    kind: str, heading: str, summary: str, chapters: Sequence[Chapter], context: Mapping[str, Any]
) -> str:
    """Render a page with its chapters, and 4.8 MB of plotly.js if one has charts.

    `summary` is the template of its beginning, `context` has the values of all templates.
    """
    page = environment().get_template("page.html.j2")
    plotly = Markup(get_plotlyjs()) if any(chapter.charts for chapter in chapters) else ""
    shared = {"theme": theme, "plotly": plotly, "SHORT_ROWS": SHORT_ROWS}
    return page.render(kind=kind, heading=heading, summary=summary, chapters=chapters, **shared, **context)


def flat(settings: Mapping[str, Any], prefix: str = "") -> dict[str, str]:
    """Lay out nested settings as dotted names with their values as text."""
    rows: dict[str, str] = {}
    for name, value in settings.items():
        path = f"{prefix}{name}"
        match value:
            case Mapping() if value:
                rows |= flat(value, f"{path}.")
            case [Mapping(), *_]:
                for position, item in enumerate(value, start=1):
                    rows |= flat(item, f"{path} {position}.")
            case _:
                rows[path] = numbers.plain(value)
    return rows


def environment() -> jinja2.Environment:
    """Open the templates; every function of `numbers` is a filter."""
    folders = [jinja2.PackageLoader(name) for name in ("experiments.report.kit", "experiments.report")]
    opened = jinja2.Environment(
        loader=jinja2.ChoiceLoader(folders),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    opened.filters |= dict(inspect.getmembers(numbers, inspect.isfunction))
    return opened
