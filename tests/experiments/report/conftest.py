"""Campaigns on analytic heaps, and a page taken apart, for the tests of the report."""

import json
from collections.abc import Callable, Iterator
from functools import cache
from html.parser import HTMLParser

import numpy as np
import pytest
from analytic_heaps import AnalyticHeaps, study_with
from discoveries import made_discovery, made_terms
from plotly.offline import get_plotlyjs

from doe.discrepancy import Discovery, Settings, Verdict
from experiments.calibrate import Campaign, calibrate
from experiments.report import HeapPicture, render_page
from experiments.report.discovery import Terms, render_discovery
from experiments.report.kit import html
from experiments.studyfile import Study, load_study

VOID = {"meta", "link", "img", "br"}
"""Elements that have no end tag."""


class Page(HTMLParser):
    """A page taken apart: ids, links, tables by id, charts by name, and whether its tags match."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.links: list[str] = []
        self.tables: dict[str, list[list[tuple[str, float | None]]]] = {}
        self.heads: dict[str, list[str]] = {}
        self.charts: dict[str, dict] = {}
        self.text = ""
        self.mismatches: list[str] = []
        self._open: list[str] = []
        self._script: dict[str, str | None] | None = None
        self._table = ""
        self._cell: list[str] | None = None
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        named = dict(attributes)
        if tag not in VOID:
            self._open.append(tag)
        self.ids += [named["id"]] if named.get("id") else []
        self.links += [str(named[key]) for key in ("href", "src") if key in named]
        if tag == "script":
            self._script = named
        elif tag == "table":
            self._table = str(named.get("id", ""))
            self.tables[self._table], self.heads[self._table] = [], []
        elif tag == "tr":
            self.tables[self._table].append([])
        elif tag in ("td", "th"):
            self._cell = []
            value = named.get("data-value")
            self._value = float(value) if value is not None else None

    def handle_endtag(self, tag: str) -> None:
        if not self._open or self._open.pop() != tag:
            self.mismatches.append(tag)
        if tag == "script":
            self._script = None
        elif tag in ("td", "th") and self._cell is not None:
            text = "".join(self._cell)
            if tag == "td":
                self.tables[self._table][-1].append((text, self._value))
            else:
                self.heads[self._table].append(text)
            self._cell = None

    def handle_data(self, data: str) -> None:
        if self._script is not None:
            if "data-plot" in self._script:
                self.charts[str(self._script["data-plot"])] = json.loads(data)
            return
        if self._cell is not None:
            self._cell.append(data)
        if "style" not in self._open:
            self.text += data

    def rows(self, name: str) -> list[list[tuple[str, float | None]]]:
        """Rows of a table's body."""
        return [row for row in self.tables[f"table-{name}"] if row]

    def values(self, name: str) -> np.ndarray:
        """Numbers of a table, row by row; a row's text cells are left out, missing numbers are NaN."""
        numeric = [
            [value for text, value in row if value is not None or text == "–"] for row in self.rows(name)
        ]
        return np.array(numeric, dtype=np.float64)


@pytest.fixture(scope="session")
def plotly() -> str:
    """Return the 4.8 MB of plotly.js."""
    return get_plotlyjs()


@pytest.fixture(autouse=True, scope="session")
def _small_pages(plotly: str) -> Iterator[None]:
    """Leave plotly.js out of the pages: they are read much faster."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(html, "get_plotlyjs", lambda: "/* plotly.js v0 */")
        yield


@pytest.fixture(scope="session")
def changed() -> Callable[..., Study]:
    return study_with


@pytest.fixture(scope="session")
def heaps() -> Callable[..., AnalyticHeaps]:
    return AnalyticHeaps


@pytest.fixture(scope="session")
def read_page() -> type[Page]:
    return Page


@pytest.fixture(scope="session")
def study() -> Study:
    return study_with(load_study(), selection={"keep": ("E", "F")})


@pytest.fixture(scope="session")
def campaign(study: Study) -> Campaign:
    return calibrate(study, AnalyticHeaps())


@pytest.fixture(scope="session")
def page_text(campaign: Campaign, study: Study) -> str:
    return render_page(campaign, study, provenance={"device": "cpu", "seconds": 12.5})


@pytest.fixture(scope="session")
def page(page_text: str) -> Page:
    return Page(page_text)


@pytest.fixture(scope="session")
def discovered() -> Callable[[Verdict], Discovery]:
    return made_discovery


@pytest.fixture(scope="session")
def whole_study() -> Study:
    return load_study()


@pytest.fixture(scope="session")
def terms(whole_study: Study) -> Terms:
    return made_terms(whole_study)


@pytest.fixture(scope="session")
def discovery_page(terms: Terms, whole_study: Study) -> Callable[[Verdict], Page]:
    """Take the page of each verdict apart once."""

    @cache
    def page(verdict: Verdict) -> Page:
        picture = HeapPicture("Heap", "A heap.", np.zeros((8, 12, 3), np.uint8))
        about = ([picture], ["study-with.toml"], {"device": "cpu"})
        return Page(render_discovery(made_discovery(verdict), whole_study, terms, Settings(), *about))

    return page
