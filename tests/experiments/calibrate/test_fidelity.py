"""A cheaper scale: its design, moved by a few runs, gives the point of the study's own scale."""

import json
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from analytic_heaps import AnalyticHeaps, StandInStudy, friction, settings

from doe import Factor, Sample
from experiments.calibrate import Campaign, Outcome, calibrate
from experiments.calibrate.fidelity_stage import OWN_SCALE
from experiments.studyfile.campaign import Response, Target

FACTORS = (Factor("A", 0.16, 0.42), Factor("E", 0.32, 0.60), Factor("F", 0.18, 0.58))
ANGLE = Response("angle", "angle", "deg")
FAR = 2.5
"""Degrees by which the cheaper scale is flatter in the middle; the slopes differ, too."""


def two_scales(row: Mapping[str, float]) -> float:
    """Heaps of both scales: the friction E counts for less, and F for more, at the cheaper one."""
    e, f = (row["E"] - 0.48) / 0.06, (row["F"] - 0.45) / 0.10
    return friction(row) - (0.0 if row["stage"] in OWN_SCALE else FAR + 0.6 * e - 0.5 * f)


def study(target: float = 30.0, **decisions: Mapping) -> StandInStudy:
    measured = Target((replace(ANGLE, measured=Sample(target, 0.4, 5)),))
    return StandInStudy(measured, FACTORS, settings(**decisions))


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    """Calibrate at a cheaper scale; ten heaps show equivalence within .8 degrees for a point .3 off."""
    decisions = {"fidelity": {"scale": "cheap"}, "verification": {"replicates": 10}}
    return calibrate(study(**decisions), AnalyticHeaps(two_scales))


def test_the_point_is_that_of_the_own_scale(campaign: Campaign) -> None:
    assert campaign.outcome is Outcome.CALIBRATED
    assert list(campaign.stages)[-4:] == ["surface", "fidelity", "optimum", "verification"]
    point = campaign.optimum.settings
    # The moved surface has a standard error of some .25 degrees there; four are allowed.
    assert friction(point) == pytest.approx(30.0, abs=1.0)
    # Without the move the point would be wrong by the difference of the scales.
    assert two_scales(point | {"stage": "surface"}) < 28.5


def test_differences_are_found_and_stated(campaign: Campaign) -> None:
    moved = campaign.fidelity
    carried, factors = moved.responses["angle"], campaign.surface.design.factors
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]])
    rows = [
        {f.name: float(f.to_natural(x)) for f, x in zip(factors, corner, strict=True)} for corner in corners
    ]
    mean, se = carried.evaluate(corners)
    assert np.abs(mean - [friction(row) for row in rows]).max() < 4.0 * se.max()
    assert se.max() < 1.0
    decision = moved.decisions[-1]
    assert decision.numbers["se after of angle [deg]"] > decision.numbers["se before of angle [deg]"] > 0.0
    assert "The angle is shifted by" in decision.outcome


def test_opening_and_design_have_the_cheaper_scale(campaign: Campaign) -> None:
    cases = campaign.cases
    assert cases["seed"].is_unique
    counts = dict(cases["stage"].value_counts())
    # A step of the climb is one case; four and one a factor are the least that move the surface.
    assert (counts["climb"], counts["fidelity"]) == (6, 6)
    plain = calibrate(study(), AnalyticHeaps(two_scales))
    assert plain.fidelity is None
    for stage in ("noise_floor", "screening"):
        assert getattr(campaign, stage).cases["seed"].equals(getattr(plain, stage).cases["seed"])


def test_results_are_plain_json(campaign: Campaign) -> None:
    kept = json.loads(json.dumps(campaign.to_dict(), allow_nan=False))["fidelity"]
    carried = campaign.fidelity.responses["angle"]
    assert kept["responses"]["angle"]["shift"] == pytest.approx(carried.shift)
    assert kept["responses"]["angle"]["slope_values"] == pytest.approx(list(carried.slope_values))
    assert len(campaign.tables()["fidelity_runs"]) == len(carried.response)
    assert 6 < len(carried.response) <= 6 + 6


def test_too_few_runs_that_give_a_value_end_the_campaign() -> None:
    heaps = AnalyticHeaps(two_scales, fails=lambda row: row["stage"] == "fidelity")
    ended = calibrate(study(fidelity={"scale": "cheap"}), heaps)
    assert ended.outcome is Outcome.TOO_MANY_FAILED_RUNS
    assert "cannot move the surface" in ended.reason
    assert ended.unreached == ("optimum", "verification", "fidelity")
