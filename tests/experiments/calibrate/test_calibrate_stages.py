"""Rules of single stages: seeds, tables of cases, and how a design is fitted into hard limits."""

import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from doe import Design, Factor
from experiments.calibrate import case_seed
from experiments.calibrate.cases import plan_cases, response_table, too_many_failed
from experiments.calibrate.climb_stage import _Line
from experiments.calibrate.results import STAGES
from experiments.calibrate.screening_stage import DESIGNS, analyse_screening, screening_design
from experiments.calibrate.surface_stage import fit_inside
from experiments.calibrate.target_stage import plan_target
from experiments.io.errors import InputError
from experiments.studyfile.campaign import (
    TARGET_SCENE,
    CampaignSettings,
    Response,
    ScreeningSettings,
    SeedSettings,
    Target,
    Twin,
)

ANGLE = Response("angle", "angle", "deg")


def factors(count: int) -> list[Factor]:
    return [Factor(f"x{number}", 0.0, 1.0) for number in range(count)]


def test_a_design_that_returns_another_thing_is_named_with_its_module(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(DESIGNS, "_outside", {"odd": lambda factors, runs: None})
    with pytest.raises(
        InputError, match=r"test_calibrate_stages must return a doe.Design of the study's factors, got None"
    ):
        screening_design(factors(2), ScreeningSettings(design="odd"))


def slope_of(factor: Factor) -> tuple[Design, pd.DataFrame]:
    """Return a screening design of one factor and finished cases whose angle rises with it."""
    design = screening_design([factor], ScreeningSettings())
    noise = np.linspace(-0.1, 0.1, len(design.coded)) ** 2
    angle = 20.0 + 3.0 * design.coded[factor.name] + noise
    cases = {"scene": "target", "run": design.coded.index, "replicate": 1, "status": "finished"}
    return design, pd.DataFrame(cases | {"angle": angle}).reset_index(drop=True)


def test_seeds_are_pinned() -> None:
    # A change here makes every stored case of every user useless: it must be deliberate.
    assert case_seed(1, "noise_floor", 1, 1) == 830202287
    assert case_seed(1, "climb", -1, 2) == 455331711


def test_seeds_differ_over_stages_runs_and_replicates() -> None:
    seeds = [
        case_seed(root, stage, run, replicate)
        for root in (1, 2)
        for stage in STAGES
        for run in range(-6, 30)
        for replicate in (1, 2, 3)
    ]
    assert len(set(seeds)) == len(seeds)
    assert all(0 <= seed < 2**31 for seed in seeds)


def test_a_plan_holds_every_factor_and_its_replicates() -> None:
    points = pd.DataFrame({"x1": [0.2, 0.9]}, index=[1, 2])
    study = SimpleNamespace(factors=factors(3), campaign=CampaignSettings())
    plan = plan_cases(study, "climb", points, {1: 2, 2: 1}, [ANGLE])
    assert plan[["run", "replicate"]].to_numpy().tolist() == [[1, 1], [1, 2], [2, 1]]
    assert plan["x1"].tolist() == [0.2, 0.2, 0.9]
    assert plan[["x0", "x2"]].eq(0.5).all(axis=None)


def test_a_response_has_a_place_for_every_case_and_nothing_where_it_failed() -> None:
    cases = pd.DataFrame(
        {
            "scene": "target",
            "run": [1, 1, 2, 2, 3, 3],
            "replicate": [1, 2] * 3,
            "status": ["finished", "diverged", "finished", "finished", "diverged", "diverged"],
            "angle": [20.0, np.nan, 21.0, 22.0, np.nan, np.nan],
        }
    )
    expected = [[20.0, np.nan], [21.0, 22.0], [np.nan, np.nan]]
    np.testing.assert_array_equal(response_table(cases, ANGLE, [1, 2, 3]), expected)


@pytest.mark.parametrize(
    ("count", "chosen", "runs"),
    [(1, {}, 8), (4, {}, 8), (8, {}, 12), (9, {}, 16), (11, {"dummies": 0}, 12), (3, {"runs": 20}, 20)],
)
def test_a_screening_has_as_few_runs_as_leave_the_dummies(count: int, chosen: dict, runs: int) -> None:
    assert len(screening_design(factors(count), ScreeningSettings(**chosen)).coded) == runs


def test_a_screening_without_dummies_and_replicates_uses_lenths_error() -> None:
    design = screening_design(factors(7), ScreeningSettings(runs=8))
    angle = 20.0 + 3.0 * design.coded["x0"] + np.linspace(0.0, 0.1, 8) ** 2
    facts = {"scene": "target", "run": design.coded.index, "replicate": 1, "status": "finished"}
    cases = pd.DataFrame(facts | {"angle": angle})
    result = analyse_screening(design, cases.reset_index(drop=True), [ANGLE])
    assert result.leading.screen.error_rule == "lenth"
    assert result.leading.screen.table["rank"].idxmin() == "x0"
    assert "Lenth" in result.decisions[0].rule


def test_a_twins_target_does_not_depend_on_the_campaigns_seed() -> None:
    def seeds(campaign: int, target: int) -> list[int]:
        settings = CampaignSettings(seeds=SeedSettings(campaign=campaign, target=target))
        aim = Target((ANGLE,), Twin({"x0": 0.3}))
        return plan_target(SimpleNamespace(factors=factors(2), campaign=settings, target=aim))[
            "seed"
        ].tolist()

    first, other, moved = seeds(1, 2), seeds(3, 2), seeds(1, 4)
    assert first == other
    assert not set(first) & set(moved)


def test_a_climb_clipped_at_zero_is_not_rounded_below_it() -> None:
    # With these levels, coding zero and back gives -5.6e-17.
    factor = Factor("F", 0.2, 0.6)
    assert factor.to_natural(factor.to_coded(0.0)) < 0.0
    screening = analyse_screening(*slope_of(factor), [ANGLE])
    start, step = {"F": 0.1}, {"F": 0.2}
    line = _Line(screening.leading.screen, ("F",), start, step, {"F": (0.0, 1.0)})
    assert line.walk(start, 2, descend=True)["F"].tolist() == pytest.approx([0.1, 0.0])
    assert line.walk(start, 2, descend=True)["F"].min() == 0.0


@pytest.mark.parametrize(
    ("center", "half_range", "low", "high", "expected"),
    [
        (0.45, 0.10, 0.0, math.inf, (0.45, 0.10)),
        (0.12, 0.10, 0.0, math.inf, (0.12, 0.08)),
        (0.02, 0.10, 0.0, math.inf, (0.075, 0.05)),
        (0.98, 0.10, 0.0, 1.0, (0.925, 0.05)),
        (0.50, 0.90, 0.4, 0.6, (0.50, 1.0 / 15.0)),
    ],
)
def test_a_design_is_fitted_into_its_limits(
    center: float, half_range: float, low: float, high: float, expected: tuple[float, float]
) -> None:
    fitted = fit_inside(center, half_range, 1.5, low, high)
    assert fitted == pytest.approx(expected)
    axial = Factor.around("x", *fitted).to_natural(np.array([-1.5, 1.5]))
    assert axial[0] >= low
    assert axial[1] <= high


SPEED = "a grain passed the speed limit at {} s: lower time_step_fraction"
LIMIT = "the program was ended at its time limit of 60 s"


@pytest.mark.parametrize(
    ("reasons", "shared", "advice"),
    [
        ([SPEED.format(0.25), SPEED.format(1.5), SPEED.format(2)], f"of 3 of them: {SPEED}.", "Fix this;"),
        ([LIMIT, SPEED.format(2), SPEED.format(0.1)], f"of 2 of them: {SPEED}.", "Fix this, or narrow"),
        (["", SPEED.format(2), ""], f"of 1 of them: {SPEED}.", "or narrow the factors' ranges;"),
        ([LIMIT, LIMIT, SPEED.format(2)], f"of 2 of them: {LIMIT}.", "widen the time limit or narrow"),
        ([None, None, None], "3 of 3 cases failed", "widen the time limit or narrow"),
    ],
)
def test_the_end_of_a_campaign_names_the_commonest_reason_and_what_it_advises(
    reasons: list[str | None], shared: str, advice: str
) -> None:
    status = ["finished" if reason == "" else "failed" for reason in reasons]
    angle = [20.0 if reason == "" else np.nan for reason in reasons]
    cases = pd.DataFrame({"scene": TARGET_SCENE, "status": status, "reason": reasons, "angle": angle})
    said = too_many_failed(cases, "noise_floor", "needs at least 2 measured cases", ANGLE).reason
    first = next((reason for reason in reasons if reason and "speed" in reason), "")
    assert shared.replace(SPEED, first) in said
    assert advice in said
    assert ("widen" in said) is ("widen" in advice)
