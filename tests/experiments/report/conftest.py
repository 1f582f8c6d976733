"""Campaigns on analytic heaps, and a page taken apart, for the tests of the report."""

from collections.abc import Callable, Iterator
from functools import cache

import numpy as np
import pytest
from analytic_heaps import AnalyticHeaps, study_with
from discoveries import made_discovery, made_terms
from page_reader import Page
from plotly.offline import get_plotlyjs

from doe.discrepancy import Settings, Verdict
from experiments.calibrate import Campaign, calibrate
from experiments.report import HeapPicture, render_page
from experiments.report.discovery import Terms, render_discovery
from experiments.report.kit import html
from experiments.studyfile import Study, load_study


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
