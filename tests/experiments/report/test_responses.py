"""The page and the card of a campaign on several responses."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from analytic_heaps import planes, study_with
from page_reader import Page

from experiments.calibrate import Campaign, calibrate
from experiments.io.units import Quantity
from experiments.report import render_page
from experiments.report.material_card import write_material_card
from experiments.studyfile import Study, load_study

POINT = Path(__file__).parents[3] / "experiments" / "studies" / "buckwheat" / "curve_to_point.toml"


@pytest.fixture(scope="module")
def point() -> Study:
    return study_with(load_study(POINT, "bench"), selection={"keep": ("E", "G")})


@pytest.fixture(scope="module")
def found(point: Study) -> Campaign:
    return calibrate(point, lambda table: planes(point, table))


@pytest.fixture(scope="module")
def responses_page(found: Campaign, point: Study):
    return Page(render_page(found, point))


def test_the_page_says_what_each_response_buys_and_takes(found: Campaign, responses_page) -> None:
    assert responses_page.mismatches == []
    shrinkage = found.optimum.joint.shrinkage
    rows = responses_page.rows("shrinkage")
    assert [row[0][0] for row in rows] == list(shrinkage.index)
    shown = responses_page.values("shrinkage")
    np.testing.assert_array_equal(shown[:, 0], 100.0 * shrinkage["share"])
    cost = dict(zip(shrinkage.index, shown[:, 4:], strict=True))
    # The density is measured on the heaps themselves; heaps and hoppers together are all the work.
    assert cost["density"].tolist() == [0.0, 0.0, 0.0]
    assert cost["angle"][0] + cost["flow"][0] == len(found.cases)
    assert cost["angle"][2] + cost["flow"][2] == pytest.approx(100.0)


def test_the_page_shows_targets_directions_and_planes(found: Campaign, responses_page) -> None:
    assert [row[0][0] for row in responses_page.rows("responses")] == ["angle", "density", "flow"]
    tests = found.optimum.joint.tests(found.optimum.point)
    goals = responses_page.values("responses")
    fitted = np.isclose(goals, tests["fitted"].to_numpy()[:, None], rtol=1e-12)
    assert fitted.any(axis=1).all()  # the fit next to p is that of the model that p comes from
    assert "Another kind of test" not in responses_page.text
    assert len(responses_page.rows("directions")) == len(found.selection.kept)
    assert {"joint-shares", "joint-E-G"} <= set(responses_page.charts)
    assert "42 mm" in responses_page.text  # the hopper, among what was simulated
    for decision in found.optimum.decisions:
        assert decision.rule.split(".")[0] in responses_page.text


def test_a_page_of_one_response_has_no_such_section(page) -> None:
    assert "responses" not in page.ids


def test_the_card_names_every_response(found: Campaign, point: Study, tmp_path: Path) -> None:
    path = write_material_card(found, point, tmp_path)
    fitted = tomllib.loads(path.read_text(encoding="utf-8"))["fitted"]
    assert list(fitted["response"]) == ["angle", "density", "flow"]
    assert fitted["response"]["flow"]["scene"] == "bin"
    assert fitted["response-scene"]["bin"]["hopper"]["outlet"] == "30 mm"
    target = found.target.responses["flow"]
    assert Quantity.parse(fitted["response"]["flow"]["mean"]).to_base("mass flow") == pytest.approx(
        target.mean,
        rel=5e-4,  # four digits
    )


@pytest.fixture(scope="module")
def measured_alone() -> Study:
    """Add a reading of E that is far off, and one of F, which is not kept."""
    rows = [
        {"parameter": "E", "by": "sledge", "mean": 40, "sd": 2, "n": 10, "model_sd": 0.01},
        {"parameter": "F", "by": "value", "mean": 0.3, "sd": 0.02, "n": 1},
    ]
    return study_with(load_study(POINT, "bench", {"direct": rows}), selection={"keep": ("E", "G")})


@pytest.fixture(scope="module")
def read_directly(measured_alone: Study) -> Campaign:
    return calibrate(measured_alone, lambda table: planes(measured_alone, table))


def test_direct_readings_are_rows_next_to_the_responses(
    read_directly: Campaign, measured_alone: Study
) -> None:
    shown = Page(render_page(read_directly, measured_alone))
    assert shown.mismatches == []
    for table in ("target", "responses"):
        assert [row[0][0] for row in shown.rows(table)][-2:] == ["E_sledge", "F_value"]
    rows = {row[0][0]: row for row in shown.rows("shrinkage")}
    assert set(rows) == {"angle", "density", "flow", "E_sledge"}  # F was not kept
    cost = dict(zip((row[0][0] for row in shown.rows("shrinkage")), shown.values("shrinkage"), strict=True))
    assert cost["E_sledge"][4:].tolist() == [0.0, 0.0, 0.0]
    check = read_directly.optimum.direct[0]
    assert check.apart
    # among the cautions before the values, and in the decisions
    words = f"density and flow disagree with the sledge of E by {check.errors:.1f} standard errors"
    assert shown.text.count(words) >= 2
    assert "E by sledge" in shown.text or "friction by sledge" in shown.text


def test_the_card_names_the_direct_readings(
    read_directly: Campaign, measured_alone: Study, tmp_path: Path
) -> None:
    path = write_material_card(read_directly, measured_alone, tmp_path)
    direct = tomllib.loads(path.read_text(encoding="utf-8"))["fitted"]["direct"]
    assert direct["F_value"] == {
        "factor": "F", "by": "value", "mean": 0.3, "sd": 0.02, "n": 1, "model_sd": 0.015
    }  # fmt: skip
    assert direct["E_sledge"]["mean"] == pytest.approx(np.tan(np.radians(40.0)), rel=1e-3)
