"""The stages replayed on the paper's printed angles take the paper's decisions."""

import numpy as np
import pandas as pd
import pytest
from analytic_heaps import StandInStudy, settings

from doe import Design, Sample, compare_means, noise_floor
from experiments.calibrate import ClimbEnd
from experiments.calibrate.climb_stage import climb, require_crossing
from experiments.calibrate.optimum_stage import find_optimum
from experiments.calibrate.results import (
    ClimbResult,
    NoiseFloorResult,
    ScreeningResult,
    SelectionResult,
    SurfaceResult,
    TargetResult,
)
from experiments.calibrate.screening_stage import analyse_screening
from experiments.calibrate.selection_stage import select_factors
from experiments.calibrate.surface_stage import climbed_box, explore_surface
from experiments.calibrate.target_stage import settle_target
from experiments.calibrate.verification_stage import verify
from experiments.studies.buckwheat.paper import factors, published
from experiments.studyfile.campaign import Response, Target

ANGLE = "repose_angle_deg"

PAPER_DECISIONS = settings(
    climb={"start": {"E": 0.30, "F": 0.15}, "step": {"E": 0.06, "F": 0.10}, "replicates": 1},
    surface={"center_rule": "smallest-error", "alpha": 1.414, "drop": ["F^2"]},
    verification={"replicates": 3},
)
MEASURED = Target((Response("angle", "angle", "deg", measured=Sample(30.148, 0.518, 5)),))


def printed_angles(points: pd.DataFrame, angles: pd.Series) -> dict[tuple[float, float], list[float]]:
    by_point: dict[tuple[float, float], list[float]] = {}
    for e, f, angle in zip(points["E"], points["F"], angles, strict=True):
        by_point.setdefault((round(e, 6), round(f, 6)), []).append(float(angle))
    return by_point


def replay(by_point: dict[tuple[float, float], list[float]], table: pd.DataFrame) -> pd.DataFrame:
    """Hand out the printed angles of every point, replicates in printed order."""
    left = {point: list(angles) for point, angles in by_point.items()}
    keys = zip(table["E"].round(6), table["F"].round(6), strict=True)
    angles = [left[key].pop(0) for key in keys]
    return table.assign(status="finished", reason="", angle=angles)


def climb_runner(table: pd.DataFrame) -> pd.DataFrame:
    steps = published("steepest_climb")
    return replay(printed_angles(steps, steps[ANGLE]), table)


def composite_runner(table: pd.DataFrame) -> pd.DataFrame:
    runs = published("central_composite")
    points = pd.DataFrame({"E": 0.48 + 0.06 * runs["E_coded"], "F": 0.45 + 0.10 * runs["F_coded"]})
    return replay(printed_angles(points, runs[ANGLE]), table)


def verification_runner(table: pd.DataFrame) -> pd.DataFrame:
    angles = published("verification")[ANGLE].to_numpy()
    return table.assign(status="finished", reason="", angle=angles)


@pytest.fixture(scope="module")
def study() -> StandInStudy:
    return StandInStudy(MEASURED, tuple(factors()), PAPER_DECISIONS)


@pytest.fixture(scope="module")
def target(study: StandInStudy) -> TargetResult:
    return settle_target(study)


@pytest.fixture(scope="module")
def noise() -> NoiseFloorResult:
    """Take the noise floor, which the paper lacks, from the five centre runs of its composite design."""
    runs = published("central_composite")
    center = runs[(runs["E_coded"] == 0) & (runs["F_coded"] == 0)]
    return NoiseFloorResult({"angle": noise_floor(center[ANGLE].to_numpy(dtype=float))}, pd.DataFrame(), ())


@pytest.fixture(scope="module")
def screening(study: StandInStudy) -> ScreeningResult:
    table = published("plackett_burman")
    names = [factor.name for factor in study.factors]
    runs = table.drop(columns=ANGLE)
    design = Design.from_table(runs, study.factors, dummies=runs.columns.drop(names))
    rows = {"scene": "target", "run": table.index, "replicate": 1, "status": "finished"}
    cases = pd.DataFrame(rows | {"angle": table[ANGLE]}).reset_index(drop=True)
    return analyse_screening(design, cases, study.target.fitted)


@pytest.fixture(scope="module")
def selection(study: StandInStudy, screening: ScreeningResult, noise: NoiseFloorResult) -> SelectionResult:
    return select_factors(study.campaign.selection, screening, noise, study.target.leading)


@pytest.fixture(scope="module")
def path(
    study: StandInStudy,
    screening: ScreeningResult,
    selection: SelectionResult,
    noise: NoiseFloorResult,
    target: TargetResult,
) -> ClimbResult:
    return climb(study, screening, selection.kept, noise, target, climb_runner)


@pytest.fixture(scope="module")
def surface(study: StandInStudy, path: ClimbResult) -> SurfaceResult:
    return explore_surface(study, climbed_box(study, path), composite_runner)


def test_the_screening_keeps_the_two_static_frictions(selection: SelectionResult) -> None:
    assert selection.kept == ("E", "F")
    # The recomputed p values of the published table.
    assert selection.table["p"]["E"] == pytest.approx(0.093891, rel=1e-5)
    assert selection.table["p"]["F"] == pytest.approx(0.002426, rel=1e-3)


def test_effects_above_the_noise_that_were_not_kept_are_named(selection: SelectionResult) -> None:
    # The screening's error is 23 times the composite's pure error: it holds interactions.
    assert set(selection.table.index[selection.table["visible"] & ~selection.table["kept"]]) == set("ABCDH")
    assert "interactions" in selection.decisions[1].outcome


def test_the_climb_is_the_printed_one_and_its_fourth_step_is_nearest(
    path: ClimbResult, study: StandInStudy, target: TargetResult
) -> None:
    steps = published("steepest_climb")
    np.testing.assert_allclose(path.path[["E", "F"]], steps[["E", "F"]], atol=1e-12)
    assert path.end is ClimbEnd.CROSSED
    assert path.best_step == 4
    assert path.best == pytest.approx({"E": 0.48, "F": 0.45})
    # Table 5 prints 1.26 for the fourth step; its own angles give 1.27.
    assert path.path["error_percent"].round(2).to_list() == [68.99, 35.69, 6.80, 1.27, 4.82, 9.74]
    require_crossing(study, path, target)


def test_the_crossing_is_interpolated_between_the_fourth_and_fifth_step(path: ClimbResult) -> None:
    share = (30.148 - 29.766) / (31.601 - 29.766)
    assert path.crossing_step == pytest.approx(4.0 + share, rel=1e-12)
    assert path.crossing == pytest.approx({"E": 0.48 + 0.06 * share, "F": 0.45 + 0.10 * share}, rel=1e-12)


def test_the_composite_design_is_the_printed_one(surface: SurfaceResult) -> None:
    assert surface.center == pytest.approx({"E": 0.48, "F": 0.45})
    assert surface.half_range == pytest.approx({"E": 0.06, "F": 0.10})
    assert len(surface.design.coded) == 13
    # The one printed run outside the stated ranges: F = 0.45 + 1.414 * 0.10 above 0.58.
    assert surface.outside["factor"].to_list() == ["F"]
    assert surface.outside["value"].to_list() == pytest.approx([0.5914])


def test_the_surfaces_are_the_published_ones(surface: SurfaceResult) -> None:
    published_terms = {"intercept": 60.799227, "E": -108.920994, "F": -46.957648, "E^2": 72.085852}
    for term, value in published_terms.items():
        assert surface.leading.reduced.coefficients[term] == pytest.approx(value, rel=1e-6)
    assert surface.leading.full.anova["p"]["lack of fit"] == pytest.approx(0.573992, rel=1e-5)
    assert surface.leading.reduced.dropped == ("F^2",)


def test_the_optimum_is_the_contours_point_nearest_to_the_centre(
    study: StandInStudy, surface: SurfaceResult, target: TargetResult
) -> None:
    optimum = find_optimum(study, surface, target)
    # The recomputed point (.479518, .448979) is that of the printed equation (9); its three decimals move
    # it by up to 0.0008 coded units.
    assert optimum.point["E"] == pytest.approx(0.479518, abs=0.0008 * 0.06)
    assert optimum.point["F"] == pytest.approx(0.448979, abs=0.0008 * 0.10)
    assert optimum.settings["A"] == pytest.approx(0.29)
    assert optimum.settings["B"] == pytest.approx(34.325)
    # One angle does not identify two friction coefficients.
    assert set(optimum.unidentified) == {"E", "F"}
    assert optimum.truth is None


def test_the_verification_is_the_printed_t_test(
    study: StandInStudy, surface: SurfaceResult, target: TargetResult
) -> None:
    result = verify(study, find_optimum(study, surface, target), target, verification_runner)
    # The paper's own test takes one variance for both; a campaign takes Welch's (test_published has both).
    pooled = compare_means(result.leading.a, target.leading, method="pooled")
    assert pooled.p == pytest.approx(0.768591, rel=1e-5)
    assert result.leading.p == pytest.approx(0.820823, rel=1e-5)
    assert result.leading.margin == pytest.approx(2.0 * 0.518)
    # no difference is found, and three heaps that scatter by 1.2 degrees show no equivalence within 1 either
    assert not result.leading.different
    assert not result.verified
    # Three heaps of standard deviation 1.16 show nothing within about a degree.
    assert result.leading.equivalent is False
