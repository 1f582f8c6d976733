"""The report of campaigns on analytic heaps: its numbers, its structure, and every outcome."""

from __future__ import annotations

import base64
import json
import math
from collections import Counter
from collections.abc import Callable, Mapping
from html.parser import HTMLParser
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

from dem_warp import CaseResult
from experiments.calibrate import Campaign, CampaignSettings, Outcome, calibrate
from experiments.report import HeapPicture, heap_pictures, render_page, write_report
from experiments.report.charts import half_normal_chart, pareto_chart
from experiments.report.numbers import (
    enumeration,
    equation,
    fixed,
    p_value,
    plain,
    prose,
    significant,
    trimmed,
)
from experiments.report.page import flat
from experiments.report.surfaces import surface_charts
from experiments.studies.buckwheat import paper
from experiments.study import Study, load_study

NOISE = 0.35
"""Standard deviation of one analytic heap [deg]."""

VOID = {"meta", "link", "img", "br"}
"""Elements that have no end tag."""


def friction(row: Mapping[str, float]) -> float:
    """Both static frictions raise the angle, nothing else does."""
    e, f = (row["E"] - 0.48) / 0.06, (row["F"] - 0.45) / 0.10
    return 30.2 + 3.0 * e + 2.0 * f + 0.7 * e * f - 0.35 * f * f


def heaps(
    angle: Callable[[Mapping[str, float]], float] = friction,
    fails: Callable[[Mapping[str, float]], bool] = lambda row: False,
) -> Callable[[pd.DataFrame], pd.DataFrame]:
    """Make a runner: the angle is a function of the settings plus noise from the case's seed."""

    def run(table: pd.DataFrame) -> pd.DataFrame:
        rows = table.to_dict("records")
        failed = np.array([fails(row) for row in rows])
        angles = [angle(row) + NOISE * np.random.default_rng(row["seed"]).standard_normal() for row in rows]
        return table.assign(
            status=np.where(failed, "diverged", "finished"),
            reason=np.where(failed, "a grain left <the domain> & fell", ""),
            angle=np.where(failed, np.nan, angles),
            angle_se=0.2,
            grain_count=400.0,
            fill_height=0.028,
            case_key=[f"key-{row['seed']}" for row in rows],
        )

    return run


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
            if self._script.get("type") == "application/json":
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


def changed(study: Study, paper_study: bool | None = None, **campaign: Mapping) -> Study:
    settings = CampaignSettings.model_validate(study.campaign.model_dump() | campaign)
    update = {"campaign": settings}
    return study.model_copy(update=update if paper_study is None else update | {"paper": paper_study})


@pytest.fixture(scope="module")
def study() -> Study:
    return changed(load_study(), selection={"keep": ("E", "F")})


@pytest.fixture(scope="module")
def campaign(study: Study) -> Campaign:
    return calibrate(study, heaps())


@pytest.fixture(scope="module")
def page(campaign: Campaign, study: Study) -> Page:
    return Page(render_page(campaign, study, provenance={"device": "cpu", "seconds": 12.5}))


def test_the_page_is_well_formed_and_its_contents_lead_somewhere(page: Page) -> None:
    assert page.mismatches == []
    assert [name for name, count in Counter(page.ids).items() if count > 1] == []
    inner = {link.removeprefix("#") for link in page.links if link.startswith("#")}
    assert {"summary", "screening", "surface", "verification", "provenance"} <= inner
    assert inner <= set(page.ids)


def test_the_page_needs_no_network(campaign: Campaign, study: Study, page: Page) -> None:
    picture = HeapPicture("Heap", "A heap.", np.zeros((8, 12, 3), np.uint8))
    text = render_page(campaign, study, [picture])
    assert all(link.startswith(("#", "data:")) for link in Page(text).links)
    plotly = text[text.index("<script>") : text.index("</script>", text.index("<script>"))]
    assert "plotly.js v" in plotly
    assert "://" not in text.replace(plotly, "")
    assert text.count("plotly.js v") == plotly.count("plotly.js v")
    assert "@import" not in text.replace(plotly, "")


def test_every_number_of_the_tables_is_the_results_own(campaign: Campaign, page: Page) -> None:
    screen, surface = campaign.screening.screen, campaign.surface
    effects = screen.table.sort_values("rank")
    published = paper.screening().table.loc[effects.index, ["F", "p"]]
    columns = ["rank", "effect", "sum_sq", "percent", "F", "t", "p"]
    expected = {
        "effects": np.column_stack([effects[columns], published]),
        "screening-anova": screen.anova.to_numpy(),
        "screening-design": np.column_stack(
            [campaign.screening.design.coded.reset_index(), campaign.screening.response]
        ),
        "climb": campaign.climb.path.reset_index().to_numpy(),
        "anova-full": np.column_stack([surface.full.anova, paper.surface().anova[["F", "p"]]]),
        "surface-design": np.column_stack(
            [surface.design.natural.reset_index(), surface.design.points, surface.response]
        ),
        "ranges": np.column_stack([list(campaign.optimum.point.values()), campaign.optimum.region.ranges]),
    }
    for name, values in expected.items():
        # Written by repr and read back: the same bits.
        np.testing.assert_array_equal(page.values(name), values.astype(np.float64), err_msg=name)
    coded = surface.reduced.coded_coefficients
    np.testing.assert_array_equal(
        page.values("coefficients")[:, 1], coded[surface.reduced.coefficients.index]
    )


def test_every_shown_number_is_its_value_rounded(page: Page) -> None:
    checked = 0
    for rows in page.tables.values():
        for text, value in (cell for row in rows for cell in row if cell[1] is not None):
            checked += 1
            if text.startswith("<"):
                assert value < float(text.removeprefix("< "))
                continue
            shown = text.replace("−", "-").replace("\u202f", "")
            decimals = len(shown.partition(".")[2])
            # Half a unit of the last digit shown, and the last bits of the comparison itself.
            assert abs(float(shown) - value) <= 0.5000001 * 10.0**-decimals, (text, value)
    assert checked > 300


def test_every_chart_has_a_place_finite_numbers_and_axes_with_titles(page: Page) -> None:
    assert {"noise-chart", "pareto-chart", "half-normal-chart", "climb-chart", "verification-chart"} <= set(
        page.charts
    )
    assert {"surface-relief", "contour-E-F", "residual-normal", "residual-actual"} <= set(page.charts)
    for name, chart in page.charts.items():
        assert name in page.ids
        assert chart["data"]
        axes = chart["layout"]["scene"] if "scene" in chart["layout"] else chart["layout"]
        assert axes["xaxis"]["title"]["text"]
        # Pareto chart and verification name their rows instead.
        assert axes["yaxis"]["title"].get("text") or name in ("pareto-chart", "verification-chart")


def test_marked_rows_are_the_significant_ones(campaign: Campaign, study: Study) -> None:
    text = render_page(campaign, study)
    table = text[text.index('<table id="table-anova-full">') :]
    table = table[: table.index("</table>")]
    assert table.count('<tr class="strong">') == int((campaign.surface.full.anova["p"] < 0.05).sum())


def test_the_summary_says_what_was_found(campaign: Campaign, page: Page) -> None:
    assert campaign.outcome is Outcome.CALIBRATED
    assert "Calibrated." in page.text
    assert "One repose angle does not pin down E and F" in page.text
    assert "35 mm wide, 110 mm high" in page.text
    for decision in campaign.decisions:
        assert prose(decision.rule) in page.text
        assert prose(decision.outcome) in page.text


def test_only_the_papers_study_shows_the_papers_numbers(campaign: Campaign, study: Study, page: Page) -> None:
    other = Page(render_page(campaign, changed(study, paper_study=False)))
    for shown, expected in ((page, True), (other, False)):
        assert ("paper" in shown.ids) is expected
        assert ("table-paper-climb" in shown.tables) is expected
        assert any(head.startswith("paper, ") for heads in shown.heads.values() for head in heads) is expected
        assert ("The paper kept E and F" in shown.text) is expected
    assert len(page.rows("misprints")) == len(paper.misprints())
    assert [row[0][0] for row in page.rows("tests")] == ["this campaign", "the paper"]


def never_climbing(row: Mapping[str, float]) -> float:
    return 15.0 + 2.0 * (row["F"] - 0.38)


def turning(row: Mapping[str, float]) -> float:
    return 24.0 + 20.0 * (row["F"] - 0.38) - 500.0 * max(row["F"] - 0.42, 0.0) ** 2


ENDINGS = {
    Outcome.NO_SIGNIFICANT_FACTOR: (
        heaps(lambda row: 24.0),
        {"selection": {"alpha": 0.01}, "seeds": {"campaign": 3}},
    ),
    Outcome.TARGET_NOT_REACHED: (heaps(never_climbing), {"selection": {"keep": ("F",)}}),
    Outcome.PLATEAU: (heaps(turning), {"selection": {"keep": ("F",)}}),
    Outcome.NO_CONTOUR: (
        heaps(),
        {"selection": {"keep": ("E", "F")}, "surface": {"center": {"E": 0.36, "F": 0.25}}},
    ),
    Outcome.NOT_VERIFIED: (
        heaps(lambda row: friction(row) + 4.0 * (row["stage"] == "verification")),
        {"selection": {"keep": ("E", "F")}},
    ),
    Outcome.TOO_MANY_FAILED_RUNS: (heaps(fails=lambda row: row["stage"] == "surface"), {}),
}


@pytest.mark.parametrize("outcome", ENDINGS)
def test_every_ending_is_a_clear_report(outcome: Outcome) -> None:
    runner, decisions = ENDINGS[outcome]
    study = changed(load_study(), **decisions)
    campaign = calibrate(study, runner)
    assert campaign.outcome is outcome
    page = Page(render_page(campaign, study))
    assert page.mismatches == []
    assert prose(campaign.reason) in page.text
    reached = set(campaign.stages)
    assert reached <= set(page.ids)
    assert not {"climb", "surface", "optimum", "verification"} - reached & set(page.ids)
    assert ("Not reached:" in page.text) == (len(reached) < 8)


@pytest.mark.parametrize("names", [("F",), ("E", "F", "G")])
def test_one_and_three_kept_factors_have_their_charts(names: tuple[str, ...]) -> None:
    study = changed(load_study(), selection={"keep": names})
    campaign = calibrate(study, heaps(lambda row: friction(row) + 60.0 * (row["G"] - 0.055)))
    page = Page(render_page(campaign, study))
    drawn = {name for name in page.charts if name.startswith(("contour", "surface"))}
    if len(names) == 1:
        assert drawn == {"surface-curve"}
    else:
        assert drawn == {"surface-relief", "contour-E-F", "contour-E-G", "contour-F-G"}


def test_a_twin_study_tells_the_truth() -> None:
    study = changed(load_study(None, "bench"), selection={"keep": ("E", "F")})
    campaign = calibrate(study, heaps())
    page = Page(render_page(campaign, study))
    truth = campaign.optimum.truth
    assert (truth.values["E"], truth.values["F"]) == (0.42, 0.34)  # noqa: PD011  (no DataFrame)
    said = "the method recovered it" if truth.compatible else "the method did not recover it"
    assert truth.compatible is None or said in page.text
    assert "28 mm tube" in page.text
    assert "divided by 400" in page.text
    marker = next(
        trace for trace in page.charts["contour-E-F"]["data"] if trace.get("name") == "hidden truth"
    )
    assert (marker["x"], marker["y"]) == ([0.42], [0.34])


def test_failed_runs_are_listed_with_their_reason() -> None:
    study = changed(load_study(), selection={"keep": ("E", "F")})
    campaign = calibrate(study, heaps(fails=lambda row: row["stage"] == "screening" and row["run"] == 3))
    text = render_page(campaign, study)
    assert "a grain left &lt;the domain&gt; &amp; fell" in text
    rows = Page(text).rows("failed")
    assert len(rows) == len(campaign.failed_cases) == 1
    assert [text for text, _ in rows[0]][-2:] == ["diverged", "a grain left <the domain> & fell"]


def test_files_hold_the_same_numbers(campaign: Campaign, study: Study, tmp_path: Path) -> None:
    written = write_report(campaign, study, tmp_path / "out", provenance={"device": "cpu"})
    assert written == tmp_path / "out" / "report.html"
    assert written.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    results = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))
    assert results["campaign"]["outcome"] == "calibrated"
    assert results["campaign"]["optimum"]["point"] == campaign.optimum.point
    assert results["provenance"]["device"] == "cpu"
    assert results["provenance"]["versions"]["numpy"] == np.__version__
    files = {path.stem: path for path in (tmp_path / "out" / "tables").iterdir()}
    assert set(files) == set(campaign.tables())
    effects = pd.read_csv(files["screening_effects"], index_col="factor")
    np.testing.assert_array_equal(effects.to_numpy(), campaign.screening.screen.table.to_numpy())
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "report.html",
        "results.json",
        "tables",
    ]


def test_a_report_that_cannot_be_written_leaves_nothing(
    campaign: Campaign, study: Study, tmp_path: Path
) -> None:
    with pytest.raises(TypeError, match="object"):
        write_report(campaign, study, tmp_path / "out", provenance={"device": object()})
    assert not (tmp_path / "out").exists()


def test_the_pareto_chart_holds_every_effect_and_the_critical_values(campaign: Campaign) -> None:
    screen = campaign.screening.screen
    traces = pareto_chart(screen, 0.10).figure.data
    bars = {
        name: size
        for trace in traces
        if trace.type == "bar"
        for name, size in zip(trace.y, trace.x, strict=True)
    }
    assert bars == screen.table["t"].abs().to_dict()
    lines = sorted(trace.x[0] for trace in traces if trace.type == "scatter")
    # Two-sided t on 3 degrees of freedom at 0.10, 0.05 and 0.05 / 11, as tabulated.
    assert lines == pytest.approx([2.35336, 3.18245, 7.70406], abs=5e-6)


def test_the_half_normal_chart_holds_dummies_too(campaign: Campaign) -> None:
    traces = half_normal_chart(campaign.screening.screen, 0.10).figure.data
    drawn = sum(len(trace.text) for trace in traces if trace.text is not None)
    assert drawn == campaign.screening.design.coded.shape[1] == 11


def test_the_drawn_region_is_the_compatible_region(campaign: Campaign) -> None:
    chart = next(
        chart
        for chart in surface_charts(campaign.surface, campaign.optimum, campaign.target)
        if chart.name == "contour-E-F"
    )
    [cells] = [trace for trace in chart.figure.data if trace.type == "heatmap"]
    region = campaign.optimum.region
    drawn = {
        (e, f)
        for row, f in zip(cells.z, cells.y, strict=True)
        for inside, e in zip(row, cells.x, strict=True)
        if inside
    }
    expected = set(region.natural[region.mask].itertuples(index=False, name=None))
    assert drawn == expected


def heap_of(angle: float) -> CaseResult:
    """Stack spheres into a cone of a known slope [deg]."""
    radius, rise = 2e-3, math.tan(math.radians(angle))
    grid = np.arange(-15, 16) * 1.5 * radius
    x, y, z = (axis.ravel() for axis in np.meshgrid(grid, grid, np.arange(0, 12) * 1.5 * radius))
    inside = z <= rise * (0.04 - np.hypot(x, y))
    centers = np.column_stack([x, y, z + radius])[inside]
    count = len(centers)
    return CaseResult(
        "finished",
        "",
        positions=centers,
        orientations=np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)),
        sizes=np.ones(count),
        clump=np.array([[0.0, 0.0, 0.0, radius]]),
    )


def test_pictures_show_the_extremes_of_a_stage_with_their_flanks(campaign: Campaign, study: Study) -> None:
    asked = []

    def load(key: str) -> CaseResult:
        asked.append(key)
        return heap_of(28.0)

    pictures = heap_pictures(campaign, study, load)
    climb = campaign.cases[campaign.cases["stage"] == "climb"].sort_values("angle")["case_key"]
    assert {climb.iloc[0], climb.iloc[-1]} <= set(asked)
    assert len(pictures) == len(asked) == 7
    page = Page(render_page(campaign, study, pictures[:1]))
    [source] = [link for link in page.links if link.startswith("data:image")]
    data = np.frombuffer(base64.b64decode(source.partition(",")[2]), np.uint8)
    assert cv2.imdecode(data, cv2.IMREAD_COLOR).shape == pictures[0].image.shape
    assert "heaps" in page.ids


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (fixed(-0.004, 2), "0.00"),
        (fixed(-1.234, 2), "−1.23"),
        (fixed(12345.6, 1), "12\u202f345.6"),
        (fixed(float("nan"), 2), "–"),
        (significant(0.00123456), "0.001235"),
        (significant(1.0e-9), "1.000e−09"),
        (trimmed(0.4600, 4), "0.46"),
        (trimmed(340.0, 2), "340"),
        (p_value(3e-6), "< 0.0001"),
        (p_value(0.05), "0.0500"),
        (plain({"E": 0.5, "F": None}), "E 0.5, F –"),
        (plain((True, 3)), "yes, 3"),
        (prose("from -0.58 to +0.60 deg, p-value, degrees"), "from −0.58 to +0.60°, p-value, degrees"),
        (enumeration(["B", "E", "F"]), "B, E and F"),
        (enumeration(["E"]), "E"),
        (flat({"a": {"b": 1.5}, "c": [{"d": 2}], "e": {}}), {"a.b": "1.5", "c 1.d": "2", "e": "–"}),
    ],
)
def test_numbers_read_as_a_reader_expects(text: object, expected: object) -> None:
    assert text == expected


def test_an_equation_is_typeset_with_signs_and_powers() -> None:
    text = equation({"intercept": -60.8, "E:F": 121.17, "E^2": -72.09}, digits=4)
    assert (
        Page(f"<p>{text}</p>").text.replace("\xa0", " ").replace("\u2009", " ")
        == "−60.80 + 121.2 E·F − 72.09 E2"
    )
    assert "<sup>2</sup>" in text
