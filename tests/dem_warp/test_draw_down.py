"""The draw-down test: two slopes above, a heap below, and the mass that went from one to the other."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import GRAIN, STEEL, assert_measured_as_told, ball_case, run_batch

from dem_warp import Case, CaseResult, DrawDown

BALL_DIAMETER = 4e-3
BOXES = DrawDown(
    width=0.08, depth=0.0165, fill_depth=0.03, slot=0.028, drop=0.045, wall_material=STEEL, rest_speed=3e-3
)
LOW_DROP = 0.012


def draw_down_case(drop: float = BOXES.drop) -> Case:
    """Boxes of some six hundred balls."""
    return ball_case(replace(BOXES, drop=drop), friction=0.2, rolling=0.1)


@pytest.fixture(scope="module")
def runs() -> list[CaseResult]:
    """A draw-down, and one whose lower box is too low."""
    results = run_batch([draw_down_case(), draw_down_case(LOW_DROP)])
    return [results[0], results[1]]


def test_what_was_above_is_now_above_or_below(runs):
    run, seen = runs[0], runs[0].observables
    assert (run.status, run.reason) == ("finished", "")
    assert_measured_as_told(draw_down_case(), run)
    # Masses are kept in single precision: 6e-8 of each, and of the sum of some hundred.
    assert seen["fallen_mass"] + seen["mass_left"] == pytest.approx(seen["filled_mass"], rel=1e-6)
    balls = GRAIN.density * np.pi / 6.0 * (BALL_DIAMETER * run.sizes) ** 3
    below = run.positions[:, 2] < BOXES.drop
    assert seen["fallen_mass"] == pytest.approx(balls[below].sum(), rel=1e-6)
    assert seen["mass_left"] == pytest.approx(balls[~below].sum(), rel=1e-6)
    assert seen["grains_lost"] == 0


def test_every_ball_is_inside_the_boxes(runs):
    for run in runs:
        # A ball sinks into a wall by less than a tenth of its radius.
        size = 0.9 * run.sphere_radii
        assert (np.abs(run.positions[:, 0]) + size < BOXES.width / 2).all()
        assert (np.abs(run.positions[:, 1]) + size < BOXES.depth / 2).all()
        assert (run.positions[:, 2] > size).all()


def test_a_draw_down_is_symmetric(runs):
    seen = runs[0].observables
    # Over four sets of frictions the part at the left was 0.46 to 0.57.
    assert seen["mass_left_left"] / seen["mass_left"] == pytest.approx(0.5, abs=0.15)
    for name in ("shear_angle", "repose_angle"):
        left, right = seen[f"{name}_left"], seen[f"{name}_right"]
        assert seen[name] == (left + right) / 2
        # Flanks of four to eight balls: over those sets the sides differed by 0.1 to 11 degrees, 5.2 in the
        # root mean square; three times that.
        assert left == pytest.approx(right, abs=16.0)
        assert 15.0 < seen[name] < 60.0


def test_the_slopes_end_at_the_slot(runs):
    x, _, z = runs[0].positions.T
    above = z > BOXES.drop
    # Balls may lean over the edge by less than one.
    assert (np.abs(x[above]) > BOXES.slot / 2 - BALL_DIAMETER).all()
    assert {-1.0, 1.0} == set(np.sign(x[above]))


def test_a_heap_that_reaches_the_slot_is_a_failure_with_its_reason(runs):
    run = runs[1]
    assert run.status == "failed"
    assert run.reason == "the heap has grown up to the slot: raise the drop, or lower the fill"
    assert run.observables["clogged"] == 1
    assert "shear_angle" not in run.observables
    assert run.observables["fallen_mass"] > 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"slot": 0.08}, r"DrawDown.slot: must be below the width 0.08 \[m\], got 0.08"),
    ],
)
def test_boxes_that_cannot_be_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        replace(BOXES, **changes)
