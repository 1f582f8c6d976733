"""Every way in which a campaign can end, and every number of kept factors, in the report."""

from collections.abc import Mapping

import pytest
from analytic_heaps import AnalyticHeaps, study_with, twin_of_one_angle
from page_reader import Page

from experiments.calibrate import Outcome, calibrate
from experiments.report import render_page
from experiments.report.kit.numbers import prose
from experiments.report.verdict import HEADLINES, verdict_sentence
from experiments.studyfile import load_study


def never_climbing(row: Mapping[str, float]) -> float:
    return 15.0 + 2.0 * (row["F"] - 0.38)


def turning(row: Mapping[str, float]) -> float:
    return 24.0 + 20.0 * (row["F"] - 0.38) - 500.0 * max(row["F"] - 0.42, 0.0) ** 2


def three_frictions(row: Mapping[str, float]) -> float:
    return 28.0 + 25.0 * (row["E"] - 0.46) + 20.0 * (row["F"] - 0.38) + 60.0 * (row["G"] - 0.055)


ENDINGS = {
    Outcome.NO_SIGNIFICANT_FACTOR: (
        {"angle": lambda row: 24.0},
        {"selection": {"alpha": 0.01}, "seeds": {"campaign": 3}},
    ),
    Outcome.TARGET_NOT_REACHED: ({"angle": never_climbing}, {"selection": {"keep": ("F",)}}),
    Outcome.PLATEAU: ({"angle": turning}, {"selection": {"keep": ("F",)}}),
    Outcome.NO_CONTOUR: (
        {},
        {"selection": {"keep": ("E", "F")}, "surface": {"center": {"E": 0.36, "F": 0.25}}},
    ),
    Outcome.MISSED: (
        {
            "angle": lambda row: (
                26.0
                + 20.0 * (row["F"] - 0.38)
                + 20.0 * (row["E"] - 0.46)
                + 4.0 * (row["stage"] == "verification")
            )
        },
        {"selection": {"keep": ("E", "F")}},
    ),
    Outcome.TOO_MANY_FAILED_RUNS: ({"fails": lambda row: row["stage"] == "surface"}, {}),
}


@pytest.mark.parametrize("outcome", ENDINGS)
def test_every_ending_is_a_clear_report(outcome: Outcome) -> None:
    nature, decisions = ENDINGS[outcome]
    study = study_with(load_study(), **decisions)
    campaign = calibrate(study, AnalyticHeaps(**nature))
    assert campaign.outcome is outcome
    page = Page(render_page(campaign, study))
    assert page.mismatches == []
    reason = campaign.reason if campaign.verification is None else verdict_sentence(campaign)
    assert f"{HEADLINES[outcome]}. {prose(reason)}" in page.text
    reached = set(campaign.stages)
    assert reached <= set(page.ids)
    assert not {"climb", "surface", "optimum", "verification"} - reached & set(page.ids)
    assert ("Not reached:" in page.text) == (len(reached) < 8)
    assert ("These values miss the target" in page.text) == (outcome is Outcome.MISSED)
    assert "Enter these values" not in page.text


@pytest.mark.parametrize("names", [("F",), ("E", "F", "G")])
def test_one_and_three_kept_factors_have_their_charts(names: tuple[str, ...]) -> None:
    study = study_with(load_study(), selection={"keep": names})
    campaign = calibrate(study, AnalyticHeaps(three_frictions))
    page = Page(render_page(campaign, study))
    drawn = {name for name in page.charts if name.startswith(("contour", "surface"))}
    if len(names) == 1:
        assert drawn == {"surface-curve"}
    else:
        assert drawn == {"surface-relief", "contour-E-F", "contour-E-G", "contour-F-G"}


def test_a_twin_study_tells_the_truth() -> None:
    study = twin_of_one_angle()
    campaign = calibrate(study, AnalyticHeaps())
    page = Page(render_page(campaign, study))
    truth = campaign.optimum.truth
    assert (truth.values["E"], truth.values["F"]) == (0.42, 0.34)
    said = "the method recovered it" if truth.compatible else "the method did not recover it"
    assert truth.compatible is None or said in page.text
    assert "28 mm tube" in page.text
    assert "divided by 400" in page.text
    marker = next(
        trace for trace in page.charts["contour-E-F"]["data"] if trace.get("name") == "hidden truth"
    )
    assert (marker["x"], marker["y"]) == ([0.42], [0.34])


def test_failed_runs_are_listed_with_their_reason() -> None:
    study = study_with(load_study(), selection={"keep": ("E", "F")})
    campaign = calibrate(
        study, AnalyticHeaps(fails=lambda row: row["stage"] == "screening" and row["run"] == 3)
    )
    text = render_page(campaign, study)
    assert "a grain left &lt;the domain&gt; &amp; fell" in text
    rows = Page(text).rows("failed")
    assert len(rows) == len(campaign.failed_cases) == 1
    assert [text for text, _ in rows[0]][-2:] == ["diverged", "a grain left <the domain> & fell"]
