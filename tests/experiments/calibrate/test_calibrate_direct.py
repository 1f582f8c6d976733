"""Campaigns with direct readings: an analytic angle and density, and factors measured by themselves."""

import json
from dataclasses import replace
from functools import cache

import pytest
from analytic_cases import ANGLE, DENSITY, FACTORS, TRUTH, Cases, angle, solid_fraction
from analytic_heaps import StandInStudy

from doe import Sample, StatedValue
from experiments.calibrate import Campaign, calibrate
from experiments.studyfile.campaign import Direct, Response, Target

RIGHT = Direct("F_incline", "F", Sample(TRUTH["F"], 0.02, 10), 0.005, "incline")


def study(*direct: Direct, responses: tuple[Response, ...] = (ANGLE,)) -> StandInStudy:
    aims = {"angle": Sample(angle(TRUTH), 0.3, 5), "density": Sample(solid_fraction(TRUTH), 0.001, 5)}
    target = Target(tuple(replace(each, measured=aims[each.name]) for each in responses))
    return StandInStudy(target, FACTORS, direct=direct)


@cache
def calibrated(*direct: Direct, both: bool = False) -> Campaign:
    return calibrate(study(*direct, responses=(ANGLE, DENSITY) if both else (ANGLE,)), Cases())


def test_an_angle_and_a_reading_are_a_study_of_several_responses() -> None:
    alone, campaign = calibrated(), calibrated(RIGHT)
    assert alone.optimum.joint is None
    assert list(campaign.optimum.joint.goals) == ["angle", "F_incline"]
    # One angle leaves E and F to trade off; the reading closes F.
    assert campaign.optimum.region.fraction < 0.5 * alone.optimum.region.fraction
    assert "F" in alone.optimum.unidentified
    assert "F" not in campaign.optimum.unidentified
    # Errors of F: .008 of the reading and the model; of E that through the slopes, and the angle's: .01.
    assert campaign.optimum.point == pytest.approx(TRUTH, abs=0.03)
    assert campaign.optimum.joint.tests().loc["F_incline", "fitted_se"] == RIGHT.model_sd


def test_a_reading_takes_no_case() -> None:
    cases = Cases()
    campaign = calibrate(study(RIGHT), cases)
    assert {scene for table in cases.tables for scene in table["scene"]} == {"target"}
    assert list(campaign.verification.responses) == ["angle"]


def test_the_climb_holds_what_was_measured_at_its_reading() -> None:
    climb = calibrated(RIGHT).climb
    assert climb.path["F"].to_numpy() == pytest.approx(TRUTH["F"])
    assert climb.crossing == pytest.approx(TRUTH, abs=0.02)
    assert calibrated().climb.path["F"].nunique() > 1


def test_a_reading_that_keeps_the_path_from_the_target_does_not_hold_it() -> None:
    far = replace(RIGHT, measured=Sample(0.9, 0.02, 10))  # the angle is above the target at every E
    climb = calibrated(far).climb
    assert climb.path["F"].nunique() > 1
    assert "did not cross the target" in climb.decisions[0].rule


def test_a_right_reading_contradicts_nothing() -> None:
    (check,) = calibrated(RIGHT, both=True).optimum.direct
    assert check.others == ("angle", "density")
    assert check.errors < 2.0
    assert not check.apart


def test_a_wrong_reading_is_named_with_its_distance() -> None:
    # F is known to .01 by angle and density (their errors over the slopes), to .008 by the reading.
    wrong = replace(RIGHT, measured=Sample(TRUTH["F"] + 0.07, 0.02, 10))
    campaign = calibrated(wrong, both=True)
    (check,) = campaign.optimum.direct
    assert check.apart
    assert check.value == pytest.approx(TRUTH["F"], abs=0.03)
    said = campaign.optimum.decisions[-1].outcome
    assert said.startswith(f"Angle and density disagree with the incline of F by {check.errors:.1f} standard")
    assert 3.0 < check.errors < 8.0


def test_what_the_others_leave_open_cannot_be_contradicted() -> None:
    # The angle alone fits any F with its own E.
    off = replace(RIGHT, measured=Sample(TRUTH["F"] + 0.03, 0.02, 10))
    (check,) = calibrated(off).optimum.direct
    assert check.errors == pytest.approx(0.0, abs=0.1)  # the pull to the centre
    assert not check.apart


def test_a_factor_that_was_not_kept_is_compared_with_its_middle() -> None:
    rolling = Direct("G_value", "G", StatedValue(0.08, 0.004), 0.003, "value")
    campaign = calibrated(RIGHT, rolling)
    assert "G" not in campaign.selection.kept
    check = campaign.optimum.direct[1]
    # The middle is .05: .03 off, over hypot(.004, .003).
    assert (check.value, check.errors) == pytest.approx((0.05, 6.0))
    assert check.apart
    assert "value of G gives 0.08" in campaign.optimum.decisions[-1].outcome
    assert "G_value" not in campaign.optimum.joint.goals


def test_results_and_tables_hold_the_readings() -> None:
    campaign = calibrated(RIGHT)
    found = json.loads(json.dumps(campaign.to_dict(), allow_nan=False))
    assert found["direct"][0]["measured"]["mean"] == TRUTH["F"]
    assert found["optimum"]["direct"][0]["apart"] is False
    assert list(campaign.tables()["direct_readings"]["direct"]) == ["F_incline"]
    assert list(campaign.tables()["joint_responses"]["response"]) == ["angle", "F_incline"]
