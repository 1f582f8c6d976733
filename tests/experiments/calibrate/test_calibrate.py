"""The campaign on analytic heaps: a known surface and a noise that each seed determines."""

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from analytic_heaps import NOISE, AnalyticHeaps, Angle, StandInStudy, settings

from doe import Factor, Sample
from experiments.calibrate import Campaign, ClimbEnd, Outcome, calibrate, stages
from experiments.calibrate.results import STAGES
from experiments.studyfile.campaign import Response, Target, Twin

FACTORS = (
    Factor("A", 0.16, 0.42),
    Factor("B", 6.81, 61.84, "MPa"),
    Factor("E", 0.32, 0.60),
    Factor("F", 0.18, 0.58),
    Factor("G", 0.03, 0.08),
)
ANGLE = Response("angle", "angle", "deg")


def measured(mean: float, sd: float, n: int = 5) -> Target:
    """Target of one measured angle."""
    return Target((replace(ANGLE, measured=Sample(mean, sd, n)),))


def hidden(**truth: float) -> Target:
    """Target of the angle of cases with hidden settings."""
    return Target((ANGLE,), Twin(truth))


def analytic_study(target: Target | None = None, **decisions: Mapping) -> StandInStudy:
    """Make a study of five factors whose target is 26 degrees."""
    return StandInStudy(target or measured(26.0, 0.4), FACTORS, settings(**decisions))


def coded(row: Mapping[str, float], name: str) -> float:
    return float(next(f for f in FACTORS if f.name == name).to_coded(row[name]))


def two_frictions(row: Mapping[str, float]) -> float:
    """Return the angle of a saturating heap: both frictions matter, the rest does not."""
    e, f = coded(row, "E"), coded(row, "F")
    return 24.0 + 2.5 * e + 5.0 * f + 0.8 * e * f - 1.0 * f * f


def ends_after_screening(angle: Angle) -> AnalyticHeaps:
    """Make heaps that all fail on the climb, where no later stage is wanted."""
    return AnalyticHeaps(angle, fails=lambda row: row["stage"] == "climb")


@cache
def chain() -> tuple[Campaign, AnalyticHeaps]:
    """Calibrate the default study once."""
    heaps = AnalyticHeaps(two_frictions)
    return calibrate(analytic_study(), heaps), heaps


def test_the_whole_chain_finds_a_known_contour() -> None:
    campaign, heaps = chain()
    assert campaign.outcome is Outcome.CALIBRATED
    assert list(campaign.stages) == list(STAGES[:-1])
    assert set(campaign.selection.kept) == {"E", "F"}
    # The standard error of the fit near the centre is about NOISE / sqrt(5); four of them are allowed.
    assert two_frictions(campaign.optimum.settings) == pytest.approx(26.0, abs=4.0 * NOISE / np.sqrt(5))
    assert campaign.optimum.settings["A"] == pytest.approx(0.29)
    assert campaign.climb.end is ClimbEnd.CROSSED
    crossing = {**campaign.optimum.settings, **campaign.climb.crossing}
    # The crossing is interpolated between means of two heaps over a step of less than 3 deg.
    assert two_frictions(crossing) == pytest.approx(26.0, abs=1.0)
    assert campaign.cases["seed"].is_unique
    assert len(campaign.cases) == sum(map(len, heaps.tables))


def test_contour_and_region_belong_to_the_reduced_surface() -> None:
    campaign, _ = chain()
    optimum, fit = campaign.optimum, campaign.surface.leading.reduced
    assert fit.predict(optimum.point)["mean"].iloc[0] == pytest.approx(26.0, abs=1e-9)
    np.testing.assert_allclose(fit.predict(optimum.contour)["mean"], 26.0, atol=1e-9)
    assert 0.0 < optimum.region.fraction < 1.0
    distance = [
        np.linalg.norm([f.to_coded(point[f.name]) for f in fit.design.factors])
        for point in optimum.contour.to_dict("records")
    ]
    chosen = np.linalg.norm([f.to_coded(optimum.point[f.name]) for f in fit.design.factors])
    assert chosen <= min(distance) + 1e-9


def test_same_seeds_give_the_same_campaign_and_other_seeds_another() -> None:
    first = chain()[0].to_dict()
    assert first == calibrate(analytic_study(), AnalyticHeaps(two_frictions)).to_dict()
    other_study = analytic_study(seeds={"campaign": 11})
    other = calibrate(other_study, ends_after_screening(two_frictions)).to_dict()
    assert first["noise_floor"]["responses"] != other["noise_floor"]["responses"]


def test_more_replicates_change_no_other_case() -> None:
    def cases(replicates: int) -> pd.DataFrame:
        study = analytic_study(screening={"replicates": replicates})
        table = calibrate(study, ends_after_screening(two_frictions)).screening.cases
        return table[table["replicate"] == 1].reset_index(drop=True)

    pd.testing.assert_frame_equal(cases(1), cases(3))


def test_a_twin_recovers_its_hidden_truth_in_the_compatible_region() -> None:
    truth = {"E": 0.50, "F": 0.42}
    inside = []
    for seed in range(10, 22, 2):
        seeds = {"campaign": seed, "target": seed + 1}
        study = analytic_study(hidden(**truth), seeds=seeds)
        campaign = calibrate(study, AnalyticHeaps(two_frictions))
        assert campaign.target.truth["A"] == pytest.approx(0.29)
        inside.append(campaign.optimum is not None and campaign.optimum.truth.compatible is True)
    # Each region holds the truth with probability 0.95: fewer than 5 of 6 come once in 30 times.
    assert sum(inside) >= 5


def test_a_truth_that_is_not_where_the_angle_says_is_called_incompatible() -> None:
    def shifted(row: Mapping[str, float]) -> float:
        # The target heaps are 1.5 deg higher than the same settings do later: a model error of 5 noise sd.
        return two_frictions(row) + (1.5 if row["stage"] == "target" else 0.0)

    study = analytic_study(hidden(E=0.46, F=0.38))
    check = calibrate(study, AnalyticHeaps(shifted)).optimum.truth
    assert check.inside_design
    assert check.compatible is False
    # The gradient is about sqrt(2.5^2 + 5^2) = 5.6 deg per screening unit; a design unit is 0.4 of one.
    assert check.distance > 0.4


def test_a_fixed_point_is_taken_even_where_the_surface_misses_the_target() -> None:
    fixed = {"surface": {"center": {"E": 0.36, "F": 0.22}}, "optimum": {"point": {"E": 0.38, "F": 0.25}}}
    study = analytic_study(hidden(E=0.5, F=0.45), **fixed)
    campaign = calibrate(study, AnalyticHeaps(two_frictions))
    assert campaign.optimum.point == {"E": 0.38, "F": 0.25}
    assert campaign.optimum.contour.empty
    assert campaign.optimum.region.fraction == 0.0
    assert campaign.outcome is Outcome.MISSED
    json.dumps(campaign.to_dict(), allow_nan=False)


def test_no_significant_factor() -> None:
    # At the default level of 0.10, one of five null factors is kept in 4 of 10 campaigns.
    campaign = calibrate(analytic_study(selection={"alpha": 0.01}), AnalyticHeaps(lambda row: 24.0))
    assert campaign.outcome is Outcome.NO_SIGNIFICANT_FACTOR
    assert list(campaign.stages) == ["target", "noise_floor", "screening", "selection"]
    assert campaign.climb is None
    assert "keep" in campaign.reason
    # Two-sided test of 12 heaps: effects of a few standard errors 2 sd / sqrt(12) can be seen.
    assert (
        1.0 < campaign.selection.visible_effect / (2.0 * campaign.noise_floor.leading.sd / np.sqrt(12)) < 10.0
    )


def test_of_many_significant_factors_the_strongest_are_kept() -> None:
    weights = dict(zip("ABEFG", (1.0, 1.5, 3.0, 2.5, 2.0), strict=True))
    heaps = ends_after_screening(lambda row: 25.0 + sum(w * coded(row, n) for n, w in weights.items()))
    selection = calibrate(analytic_study(selection={"at_most": 2}), heaps).selection
    assert selection.kept == ("E", "F")
    assert "Every factor is significant" in selection.decisions[0].outcome


def test_a_climb_that_never_reaches_the_target() -> None:
    study = analytic_study(measured(60.0, 0.5))
    heaps = AnalyticHeaps(lambda row: 24.0 + 3.0 * coded(row, "E") + 3.0 * coded(row, "F"))
    campaign = calibrate(study, heaps)
    assert campaign.outcome is Outcome.TARGET_NOT_REACHED
    assert campaign.climb.end is ClimbEnd.BOUNDED
    assert len([table for table in heaps.tables if "climb" in set(table["stage"])]) == 2
    assert campaign.climb.path[["E", "F"]].max().to_dict() == pytest.approx({"E": 0.74, "F": 0.78}, abs=0.08)
    assert "Widen" in campaign.reason
    assert campaign.surface is None


def test_a_target_below_the_first_step_extends_the_climb_downward() -> None:
    study = analytic_study(measured(16.5, 0.5))
    heaps = AnalyticHeaps(lambda row: 24.0 + 3.0 * coded(row, "E") + 3.0 * coded(row, "F"))
    campaign = calibrate(study, heaps)
    assert campaign.climb.path.index.min() < 1
    assert campaign.climb.path.index.is_monotonic_increasing
    assert campaign.climb.crossing_step < 1.0
    assert campaign.outcome is Outcome.CALIBRATED
    assert campaign.cases["seed"].is_unique


def test_a_climb_that_meets_a_hard_limit_stays_inside_it() -> None:
    study = analytic_study(measured(8.0, 0.5), climb={"reach": 3.0})
    heaps = AnalyticHeaps(lambda row: 24.0 + 3.0 * coded(row, "E") + 5.0 * coded(row, "F"))
    campaign = calibrate(study, heaps)
    assert campaign.climb.path["F"].min() == 0.0
    assert campaign.outcome is Outcome.TARGET_NOT_REACHED
    assert "at the bound: parameter F (F)" in campaign.reason


def test_a_climb_whose_start_is_its_bound_says_so() -> None:
    fixed = {"start": {"F": 0.78}, "step": {"F": 0.1}}
    study = analytic_study(selection={"keep": ["F"]}, climb=fixed)
    campaign = calibrate(study, AnalyticHeaps(two_frictions))
    assert campaign.outcome is Outcome.TARGET_NOT_REACHED
    assert "cannot leave its start (parameter F (F) 0.78)" in campaign.reason


def test_a_climb_that_turns_is_a_plateau() -> None:
    heaps = AnalyticHeaps(
        lambda row: 24.0 + 4.0 * coded(row, "F") - 4.0 * max(coded(row, "F") - 0.2, 0.0) ** 2 * 5
    )
    study = analytic_study(measured(30.0, 0.4), selection={"keep": ["F"]})
    campaign = calibrate(study, heaps)
    assert campaign.outcome is Outcome.PLATEAU
    assert campaign.climb.end is ClimbEnd.TURNED


def test_a_climb_without_slope_is_a_plateau() -> None:
    study = analytic_study(selection={"keep": ["G"]})
    campaign = calibrate(study, AnalyticHeaps(lambda row: 20.0))
    assert campaign.outcome is Outcome.PLATEAU
    assert campaign.climb.end is ClimbEnd.FLAT


def test_heaps_that_change_at_the_optimum_are_not_verified() -> None:
    heaps = AnalyticHeaps(lambda row: two_frictions(row) + (2.0 if row["stage"] == "verification" else 0.0))
    campaign = calibrate(analytic_study(), heaps)
    assert campaign.outcome is Outcome.MISSED
    assert campaign.verification.leading.different
    assert not campaign.verification.verified


def test_without_equivalence_a_campaign_is_not_calibrated() -> None:
    campaign = calibrate(analytic_study(verification={"margin": 0.05}), AnalyticHeaps(two_frictions))
    assert campaign.outcome is Outcome.UNDECIDED
    assert not campaign.verification.leading.different
    assert "no difference is found, but equivalence is not shown for angle within" in campaign.reason
    assert "% of the settings that the surface covers" in campaign.reason


@pytest.mark.parametrize("names", [("F",), ("E", "F", "G")])
def test_one_and_three_kept_factors(names: tuple[str, ...]) -> None:
    heaps = AnalyticHeaps(lambda row: 25.0 + sum(3.0 * coded(row, name) for name in names))
    campaign = calibrate(analytic_study(selection={"alpha": 0.01}), heaps)
    assert set(campaign.selection.kept) == set(names)
    assert campaign.outcome is Outcome.CALIBRATED
    assert campaign.optimum.contour.shape[1] == len(names)
    unidentified = campaign.optimum.unidentified
    # One equation: it fixes one factor and leaves three free to trade off.
    assert set(unidentified) == (set() if len(names) == 1 else set(names))


@pytest.mark.parametrize("stage", ["target", "screening", "verification"])
def test_a_stage_whose_cases_all_fail_ends_the_campaign(stage: str) -> None:
    heaps = AnalyticHeaps(two_frictions, fails=lambda row: row["stage"] == stage)
    campaign = calibrate(analytic_study(hidden(E=0.5, F=0.42)), heaps)
    assert campaign.outcome is Outcome.TOO_MANY_FAILED_RUNS
    assert stage not in campaign.stages
    assert "diverged" in campaign.reason
    assert set(campaign.failed_cases["stage"]) == {stage}


def test_a_few_failed_cases_are_stated_and_do_not_stop_the_campaign() -> None:
    lost = {
        ("noise_floor", 1, 2),
        ("screening", 3, 1),
        ("climb", 2, 1),
        ("surface", 1, 1),
        ("verification", 1, 4),
    }
    heaps = AnalyticHeaps(
        two_frictions, fails=lambda row: (row["stage"], row["run"], row["replicate"]) in lost
    )
    campaign = calibrate(analytic_study(), heaps)
    assert campaign.outcome is Outcome.CALIBRATED
    assert len(campaign.failed_cases) == len(lost)
    assert np.isnan(campaign.screening.leading.measured[2, 0])
    assert campaign.climb.path.loc[2, "n"] == 1
    assert np.isnan(campaign.surface.leading.measured[0])
    assert len(campaign.surface.leading.full.response) == 12
    stated = [d.stage for d in campaign.decisions if "cases failed (1 diverged)" in d.outcome]
    assert stated == ["noise_floor", "screening", "climb", "surface", "verification"]


FIXED = {
    "selection": {"keep": ["E", "F"]},
    "surface": {"center": {"E": 0.48, "F": 0.40}, "half_range": {"E": 0.10, "F": 0.15}},
}
"""Decisions that leave nothing of the composite design to the climb."""


def batches(heaps: AnalyticHeaps) -> int:
    """Count the calls with new cases: the others ask for what was simulated."""
    seeds = [set(table["seed"]) for table in heaps.tables]
    return sum(not one <= set().union(*seeds[:number]) for number, one in enumerate(seeds))


@pytest.mark.parametrize(
    ("decisions", "goal", "fails", "apart", "joined", "lost"),
    [
        pytest.param(FIXED, 26.0, "", 4, 2, 0, id="all that is fixed comes first"),
        pytest.param({"surface": FIXED["surface"]}, 26.0, "", 4, 3, 0, id="the screening selects"),
        pytest.param(FIXED, 30.2, "", 5, 3, 0, id="the climb is extended"),
        pytest.param({"selection": FIXED["selection"]}, 26.0, "", 4, 4, 0, id="the climb places the design"),
        # The thirteen cases of a design of two factors, and the five of the verification, are the cost.
        pytest.param(FIXED, 26.0, "screening", 1, 1, 13, id="the opening fails"),
        pytest.param(FIXED, 26.0, "climb", 2, 2, 18, id="the climb fails"),
        pytest.param(FIXED, 26.0, "surface", 3, 2, 0, id="the design fails"),
    ],
)
def test_cases_that_are_certain_join_an_earlier_batch_and_change_no_result(
    decisions: Mapping,
    goal: float,
    fails: str,
    apart: int,
    joined: int,
    lost: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def campaign() -> tuple[Campaign, AnalyticHeaps]:
        heaps = AnalyticHeaps(two_frictions, fails=lambda row: row["stage"] == fails)
        return calibrate(analytic_study(measured(goal, 0.4), **decisions), heaps), heaps

    (early, ahead), _ = campaign(), monkeypatch.setattr(stages, "fixed_box", lambda *_: None)
    late, one_by_one = campaign()
    assert json.dumps(early.to_dict()) == json.dumps(late.to_dict())
    assert {name: table.to_csv() for name, table in early.tables().items()} == {
        name: table.to_csv() for name, table in late.tables().items()
    }
    assert (batches(one_by_one), batches(ahead)) == (apart, joined)
    assert len(set().union(*[table["seed"] for table in ahead.tables])) == len(early.cases) + lost


def test_points_stay_inside_hard_limits_and_leave_stated_ranges_openly() -> None:
    surface = {"center": {"E": 0.46, "F": 0.05}, "half_range": {"E": 0.15, "F": 0.08}}
    study = analytic_study(measured(15.0, 0.5), surface=surface)
    campaign = calibrate(study, AnalyticHeaps(two_frictions))
    surface = campaign.surface
    assert surface.design.natural["F"].min() >= 0.0
    assert surface.half_range["F"] < 0.08
    listed = surface.outside.set_index(["run", "factor"])["value"]
    natural = surface.design.natural
    assert set(listed.index) == {
        (run, f.name)
        for f in FACTORS
        if f.name in natural
        for run, value in natural[f.name].items()
        if not f.low <= value <= f.high
    }
    assert len(listed) > 0


def test_results_are_plain_finite_json_and_tables() -> None:
    names: list[str] = []
    campaign = calibrate(
        analytic_study(hidden(E=0.5, F=0.42)),
        AnalyticHeaps(two_frictions, fails=lambda row: row["stage"] == "climb" and row["run"] == 1),
        on_stage=lambda name, result: names.append(name),
    )
    kept = json.loads(json.dumps(campaign.to_dict(), allow_nan=False))
    assert (kept["outcome"], kept["climb"]["path"][0]["mean"]) == (campaign.outcome.value, None)
    assert names == list(STAGES[:-1])
    tables = campaign.tables()
    assert all(len(tables[name]) == len(getattr(campaign, name)) for name in ("cases", "decisions"))
    assert list(tables["surface_anova_full"].iloc[:, 1])[:1] == ["model"]


@pytest.mark.parametrize(
    ("section", "place"),
    [
        ({"selection": {"keep": ["X"]}}, "selection.keep"),
        ({"climb": {"start": {"E": 5.0}, "step": {"E": 0.1}}}, "climb.start.E"),
        ({"climb": {"start": {"E": 0.4}, "step": {"E": -0.1}}}, "climb.step.E"),
        ({"surface": {"half_range": {"F": 0.0}}}, "surface.half_range.F"),
        ({"surface": {"center": {"F": -0.1}}}, "surface.center.F"),
        ({"optimum": {"point": {"Q": 1.0}}}, "optimum.point"),
        ({"screening": {"runs": 4}}, "factors"),
    ],
)
def test_settings_that_do_not_fit_the_factors_stop_before_any_case(section: dict, place: str) -> None:
    heaps = AnalyticHeaps(two_frictions)
    with pytest.raises(ValueError, match=place):
        calibrate(analytic_study(**section), heaps)
    assert heaps.tables == []
