"""The composite design and the optimum on a plane whose contours are straight lines."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from analytic_heaps import StandInStudy, settings

from doe import Factor, Goal, Sample, joint_fit
from experiments.calibrate import ClimbEnd, Outcome
from experiments.calibrate.cases import StageEnd
from experiments.calibrate.joint import ranges_of
from experiments.calibrate.optimum_stage import find_optimum
from experiments.calibrate.results import ClimbResult, SurfaceResult, TargetResult
from experiments.calibrate.surface_stage import climbed_box, explore_surface, require_slope
from experiments.studyfile.campaign import Response, Target

CENTER = {"E": 1.0, "F": 1.0}
HALF_RANGE = 0.4
"""Half-range of both factors: least share (0.4) of a screening half-range of 1, above the climb's step."""
NOISE = 0.01
"""Standard deviation of a heap [deg]; every slope and offset below is far larger."""

MEASURED = Target((Response("angle", "angle", "deg", measured=Sample(20.0, NOISE, 5)),))


def plane_study(**decisions: Mapping) -> StandInStudy:
    """Make a study of two frictions without limits."""
    factors = (Factor("E", 0.0, 2.0), Factor("F", 0.0, 2.0))
    return StandInStudy(MEASURED, factors, settings(**decisions), least=-math.inf)


def explored(
    slope: float, step: float = 0.1, failed: tuple[int, ...] = (), **decisions: Mapping
) -> SurfaceResult:
    """Explore a plane: 20 deg at the centre, ``slope`` deg for a coded unit of either factor."""

    def heaps(table: pd.DataFrame) -> pd.DataFrame:
        noise = [np.random.default_rng(seed).normal(0.0, NOISE) for seed in table["seed"]]
        angle = 20.0 + slope * (table["E"] + table["F"] - 2.0) / HALF_RANGE + noise
        lost = table["run"].isin(failed)
        return table.assign(
            status=np.where(lost, "failed", "finished"), reason="", angle=angle.mask(lost, math.nan)
        )

    study = plane_study(**decisions)
    return explore_surface(study, climbed_box(study, crossed_climb(step)), heaps)


def crossed_climb(step: float = 0.1) -> ClimbResult:
    path, step_by_name = pd.DataFrame(CENTER, index=[1]), dict.fromkeys(CENTER, step)
    return ClimbResult(
        pd.DataFrame(), ("E", "F"), path, step_by_name, ClimbEnd.CROSSED, CENTER, 1.0, 1, decisions=()
    )


def aim(mean: float, truth: dict[str, float] | None = None) -> TargetResult:
    return TargetResult({"angle": Sample(mean, NOISE, 5)}, truth, None, ())


def at_coded(e: float, f: float) -> dict[str, float]:
    return {"E": 1.0 + HALF_RANGE * e, "F": 1.0 + HALF_RANGE * f}


@pytest.mark.parametrize(("step", "half_range"), [(0.1, 0.4), (-0.7, 0.7)])
def test_a_half_range_is_a_climb_step_but_not_too_short(step: float, half_range: float) -> None:
    assert explored(3.0, step).half_range == pytest.approx({"E": half_range, "F": half_range})


def test_a_surface_of_few_runs_says_that_it_rules_hardly_anything_out() -> None:
    # 13 runs, 6 coefficients: with 3 degrees of freedom t's limit is 3.2 standard errors, with 1 it is 12.7
    assert "hardly rules" not in explored(3.0, failed=(10, 11, 12, 13)).decisions[-1].outcome
    few = explored(3.0, failed=(7, 8, 10, 11, 12, 13))
    assert "Degrees of freedom for its errors: 1" in few.decisions[-1].outcome


# The line E + F = s in coded units lies s / sqrt(2) from the centre, nearest at (s / 2, s / 2). The axial
# points reach sqrt(2), the runs' circle too: s = 2 passes through the corner of the two-level part.
@pytest.mark.parametrize("line", [0.0, -1.9])
def test_the_nearest_point_of_a_line(line: float) -> None:
    optimum = find_optimum(plane_study(), explored(3.0), aim(20.0 + 3.0 * line))
    # Standard error of the fit in coded units: below NOISE / slope; ten of them.
    assert optimum.point == pytest.approx(at_coded(line / 2, line / 2), abs=10 * NOISE / 3.0 * HALF_RANGE)
    assert optimum.extent == pytest.approx(math.sqrt(2.0))


def test_a_range_that_ends_where_nothing_was_explored_is_open_there() -> None:
    optimum = find_optimum(plane_study(), explored(3.0), aim(20.0))
    region = optimum.region
    assert "of what was explored: E (low), E (high), F (low), F (high)." in optimum.decisions[1].outcome
    assert region.open_ends.to_numpy().all()
    assert "high of E, not explored beyond" in optimum.decisions[1].numbers
    # The line E + F = 0 meets the circle of the runs, of radius sqrt(2), at -1 and 1: to two cells of .007
    # and the slant of a band that is ten standard errors wide.
    ends = [[at_coded(-1, 0)["E"], at_coded(1, 0)["E"]]] * 2
    assert region.ranges.to_numpy() == pytest.approx(
        np.array(ends), abs=(0.014 + 10 * NOISE / 3.0) * HALF_RANGE
    )
    # Where E ends at its limit nothing is beyond, so that this end is not open.
    low = region.ranges.loc["E", "low"]
    ranges = ranges_of(region, None, {"E": (low - 1e-9, math.inf), "F": (low - 0.01, math.inf)})
    assert ranges["low_open"].tolist() == [False, True]
    assert ranges.loc["E", "low"] == low - 1e-9
    closed = replace(region, mask=np.linalg.norm(region.coded, axis=1) < 0.5)
    assert not closed.open_ends.to_numpy().any()
    band = replace(region, mask=region.explored & (region.coded["E"].abs() < 0.5).to_numpy())
    assert band.open_ends.to_numpy().tolist() == [[False, False], [True, True]]


def test_one_response_and_several_explore_the_same_settings() -> None:
    surface, target = explored(3.0), aim(20.0)
    region = find_optimum(plane_study(), surface, target).region
    joint = joint_fit({"angle": Goal(surface.leading.reduced, target.leading)}).region()
    assert (region.extent, region.fraction) == (joint.extent, joint.fraction)
    assert (region.mask == joint.mask).all()
    assert region.open_ends.equals(joint.open_ends)


def test_a_contour_beyond_the_runs_is_no_optimum_although_the_box_reaches_it() -> None:
    # s = 2.4 is 1.70 from the centre, outside the circle of the runs, inside the box of the axial points.
    with pytest.raises(StageEnd, match="beyond the design's runs") as end:
        find_optimum(plane_study(), explored(3.0), aim(20.0 + 3.0 * 2.4))
    assert end.value.outcome is Outcome.NO_CONTOUR


# 2 is the farthest that the circle of the runs reaches, and five values tell the target to 1.24 of their
# standard deviation. 2.05 is missed by .15 degrees; 3, which is beyond the box of the axial points too, by 3.
@pytest.mark.parametrize(("line", "sd"), [(2.05, 0.2), (3.0, 3.0)])
def test_a_target_that_the_surface_misses_within_their_errors_has_its_closest_point(
    line: float, sd: float
) -> None:
    target = TargetResult({"angle": Sample(20.0 + 3.0 * line, sd, 5)}, None, None, ())
    optimum = find_optimum(plane_study(), explored(3.0), target)
    # Cells of the region are .007 apart, 400 over 2 sqrt(2): 3 x 2 x .007 / 2 degrees. Along the circle the
    # plane falls by the square of the angle, 3 degrees a unit of it: as little within .12.
    assert optimum.prediction["mean"] == pytest.approx(26.0, abs=0.021 + 10 * NOISE)
    low, middle, high = optimum.prediction[["confidence_low", "full_mean", "confidence_high"]]
    assert middle == pytest.approx((low + high) / 2.0)
    assert optimum.point == pytest.approx(at_coded(1.0, 1.0), abs=0.12 * HALF_RANGE)
    assert "comes closest" in optimum.decisions[0].rule
    assert optimum.region.mask.any()


@pytest.mark.parametrize(
    ("truth", "inside", "compatible"),
    [
        ((0.0, 0.0), True, True),
        ((-0.9, 0.9), True, True),
        ((0.5, 0.5), True, False),
        ((-1.2, 1.2), False, None),  # in the box of the axial points, beyond the circle of the runs
        ((-1.5, 1.5), False, None),
    ],
)
def test_where_a_hidden_truth_lies(truth: tuple[float, float], inside: bool, compatible: bool | None) -> None:
    check = find_optimum(plane_study(), explored(3.0), aim(20.0, at_coded(*truth))).truth
    assert (check.inside_design, check.compatible) == (inside, compatible)
    # Distance of a point to the line E + F = 0; the line itself is known to ten standard errors.
    assert check.distance == pytest.approx(abs(sum(truth)) / math.sqrt(2.0), abs=10 * NOISE / 3.0)


def test_a_truth_is_judged_as_the_cells_of_the_region_are() -> None:
    surface = explored(0.02)
    region = find_optimum(plane_study(), surface, aim(20.0)).region
    inside, outside = (
        np.flatnonzero(region.explored & (region.mask == belongs)) for belongs in (True, False)
    )
    cells = np.concatenate([inside[:: len(inside) // 3], outside[:: len(outside) // 3]])
    truths = [{str(n): float(v) for n, v in region.natural.iloc[cell].items()} for cell in cells]
    judged = [find_optimum(plane_study(), surface, aim(20.0, truth)).truth.compatible for truth in truths]
    assert judged == region.mask[cells].tolist()
    assert {True, False} == set(judged)


def test_a_region_of_higher_confidence_is_wider() -> None:
    surface = explored(0.05)
    half, most = (
        find_optimum(
            plane_study(optimum={"confidence": confidence}),
            surface,
            aim(20.0),
        ).region.fraction
        for confidence in (0.50, 0.95)
    )
    assert half < most


def test_a_surface_without_slope_is_a_plateau() -> None:
    surface, named = explored(0.0, surface={"reduce_alpha": 1e-6}), plane_study()
    assert surface.leading.reduced.terms == ()
    with pytest.raises(StageEnd) as end:
        require_slope(named, surface, crossed_climb())
    assert end.value.outcome is Outcome.BOX_TOO_SMALL
    assert (
        "although the climb crossed the target: the box of the design (E = 0.4, F = 0.4" in end.value.reason
    )
    assert "Widen [campaign.surface] half_range, or raise its replicates." in end.value.reason
    assert "Around parameter E (E) 1, parameter F (F) 1 no term" in end.value.reason
    require_slope(named, explored(3.0), crossed_climb())
