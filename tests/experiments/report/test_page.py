"""The page: well formed, self-contained, with the results' own numbers."""

import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from analytic_heaps import study_with
from page_reader import Page

from experiments.calibrate import Campaign, Outcome
from experiments.report import HeapPicture, campaign_page, kit, render_page
from experiments.report.kit.numbers import prose
from experiments.studies.buckwheat import paper
from experiments.studyfile import Study, load_study


def test_the_page_is_well_formed_and_its_contents_lead_somewhere(page) -> None:
    assert page.mismatches == []
    assert [name for name, count in Counter(page.ids).items() if count > 1] == []
    inner = {link.removeprefix("#") for link in page.links if link.startswith("#")}
    assert {"summary", "screening", "surface", "verification", "provenance"} <= inner
    assert inner <= set(page.ids)


def test_the_page_needs_no_network(
    campaign: Campaign, study: Study, plotly: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kit.html, "get_plotlyjs", lambda: plotly)
    picture = HeapPicture("Heap", "A heap.", np.zeros((8, 12, 3), np.uint8))
    text = render_page(campaign, study, [picture])
    assert all(link.startswith(("#", "data:")) for link in Page(text).links)
    assert "plotly.js v" in plotly
    assert "://" not in text.replace(plotly, "")
    assert text.count("plotly.js v") == plotly.count("plotly.js v")
    assert "@import" not in text.replace(plotly, "")


def test_every_number_of_the_tables_is_the_results_own(campaign: Campaign, page) -> None:
    screen, surface = campaign.screening.leading.screen, campaign.surface
    effects = screen.table.sort_values("rank")
    published = paper.screening().table.loc[effects.index, ["F", "p"]]
    columns = ["rank", "effect", "sum_sq", "percent", "F", "t", "p"]
    full = surface.leading.full.anova
    expected = {
        "effects": effects[columns].to_numpy(),
        "paper-effects": np.column_stack([effects[["F", "p"]], published]),
        "screening-anova": screen.anova.to_numpy(),
        "screening-design": np.column_stack(
            [campaign.screening.design.coded.reset_index(), campaign.screening.leading.measured]
        ),
        "climb": campaign.climb.path.reset_index().to_numpy(),
        "anova-full": full.to_numpy(),
        "paper-anova-full": np.column_stack(
            [anova.loc[full["F"].notna(), ["F", "p"]] for anova in (full, paper.surface().anova)]
        ),
        "surface-design": np.column_stack(
            [surface.design.natural.reset_index(), surface.design.points, surface.leading.measured]
        ),
    }
    for name, values in expected.items():
        # Written by repr and read back: the same bits.
        np.testing.assert_array_equal(page.values(name), values.astype(np.float64), err_msg=name)
    coded = surface.leading.reduced.coded_coefficients
    np.testing.assert_array_equal(
        page.values("coefficients")[:, 0], coded[surface.leading.reduced.coefficients.index]
    )


def test_every_shown_number_is_its_value_rounded(page) -> None:
    checked = 0
    for rows in page.tables.values():
        for text, value in (cell for row in rows for cell in row if cell[1] is not None):
            checked += 1
            if text.startswith("<"):
                assert value < float(text.removeprefix("< "))
                continue
            shown = re.sub("^[≤≥] |, not explored beyond$", "", text).replace("−", "-").replace("\u202f", "")
            decimals = len(shown.partition(".")[2])
            # Half a unit of the last digit shown, and the last bits of the comparison itself.
            assert abs(float(shown) - value) <= 0.5000001 * 10.0**-decimals, (text, value)
    assert checked > 300


def test_every_chart_has_a_place_finite_numbers_and_axes_with_titles(page) -> None:
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


def test_marked_rows_are_the_significant_ones(campaign: Campaign, page_text: str) -> None:
    table = page_text[page_text.index('<table id="table-anova-full">') :]
    table = table[: table.index("</table>")]
    assert table.count('<tr class="strong">') == int((campaign.surface.leading.full.anova["p"] < 0.05).sum())


def test_the_summary_says_what_was_found(campaign: Campaign, page) -> None:
    assert campaign.outcome is Outcome.CALIBRATED
    assert "Target met; values not pinned." in page.text
    assert "Calibrated." not in page.text
    open_ones = "grain-grain static friction (E) and grain-steel static friction (F)"
    assert f"The target alone leaves open {open_ones}" in page.text
    assert "35 mm wide, 110 mm high" in page.text
    for decision in campaign.decisions:
        assert prose(decision.rule) in page.text
        assert prose(decision.outcome) in page.text


def test_only_the_papers_study_shows_the_papers_numbers(campaign: Campaign, study: Study, page) -> None:
    other = Page(render_page(campaign, study_with(study, companion="")))
    for shown, expected in ((page, True), (other, False)):
        assert ("paper" in shown.ids) is expected
        assert ("table-paper-climb" in shown.tables) is expected
        assert any(head.startswith("paper, ") for heads in shown.heads.values() for head in heads) is expected
        assert ("The paper kept E and F and chose E = 0.482 and F = 0.446" in shown.text) is expected
    assert len(page.rows("misprints")) == len(paper.misprints())
    assert [row[0][0] for name in ("tests", "paper-tests") for row in page.rows(name)] == [
        "angle",
        "the paper",
    ]


def test_the_facts_name_the_spheres_of_every_shape(write_study: Callable[..., Path]) -> None:
    one = load_study(write_study())
    assert campaign_page.study_facts(one)["Grains"] == "30 grains, 1 sphere each"
    (one.file.parent / "two.txt").write_text("0 0 0 1\n1 0 0 1\n", encoding="utf-8")
    shapes = '[grain.shapes.a]\nclump = "two.txt"\n[grain.shapes.b]\nsphere = "2 mm"\nfraction = 0.5\n\n'
    both = load_study(write_study(('sphere = "2 mm"\n', ""), ("[wall]", f"{shapes}[wall]")))
    assert campaign_page.study_facts(both)["Grains"] == "30 grains, 1 or 2 spheres each"
