"""The flat-bottomed hopper and the draw-down test: flow, what stays, and the slopes of heaps."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import GRAIN, GRAVITY, STEEL, assert_measured_as_declared, ball_case, run_batch

from dem_warp import Case, CaseResult, DrawDown, Hopper
from dem_warp.scenes.discharge import DischargeState

BALL_DIAMETER = 4e-3
CLOSED, NARROW, WIDE = 3e-3, 14e-3, 20e-3
BIN = Hopper(diameter=0.032, fill_depth=0.03, outlet=WIDE, wall_material=STEEL)


def hopper_case(outlet: float) -> Case:
    return ball_case(replace(BIN, outlet=outlet), friction=0.1)


@pytest.fixture(scope="module")
def runs() -> dict[float, CaseResult]:
    outlets = (CLOSED, NARROW, WIDE)
    results = run_batch([hopper_case(outlet) for outlet in outlets])
    return {outlet: results[i] for i, outlet in enumerate(outlets)}


@pytest.mark.parametrize("outlet", [NARROW, WIDE])
def test_a_hopper_keeps_its_mass(runs, outlet):
    run, seen = runs[outlet], runs[outlet].observables
    assert (run.status, run.reason) == ("finished", "")
    assert [phase["name"] for phase in run.phases] == ["fill", "settle", "open", "discharge"]
    # Four looks, three rates in between: too few to say how good their mean is.
    absent = frozenset({"flow_rate_se"}) if outlet == WIDE else frozenset()
    assert_measured_as_declared(hopper_case(outlet), run, absent)
    assert absent or 0.0 < seen["flow_rate_se"] < 0.2 * seen["flow_rate"]
    # Masses are kept in single precision: 6e-8 of each, and of the sum of some hundred.
    assert seen["fallen_mass"] + seen["mass_left"] == pytest.approx(seen["filled_mass"], rel=1e-6)
    balls = GRAIN.density * np.pi / 6.0 * (BALL_DIAMETER * run.sizes) ** 3
    assert seen["mass_left"] == pytest.approx(balls.sum(), rel=1e-6)
    assert seen["grains_lost"] == 0
    assert seen["clogged"] == 0
    assert 0.0 < seen["discharge_time"] < sum(phase["time"] for phase in run.phases[2:])


@pytest.mark.parametrize("outlet", [NARROW, WIDE])
def test_grains_that_stay_leave_the_outlet_free(runs, outlet):
    run = runs[outlet]
    from_axis = np.hypot(*run.positions.T[:2])
    assert len(run.positions) > 0
    assert (run.positions[:, 2] > 0.0).all()
    assert (from_axis > 0.25 * outlet).all()
    # Inside the bin, into whose wall a ball sinks by less than a tenth of its radius.
    assert (from_axis + 0.9 * run.sphere_radii < BIN.diameter / 2).all()


def test_a_crater_rises_from_the_outlet_to_the_wall(runs):
    # The narrow outlet leaves room for one: the wide one leaves a ring of one or two balls.
    run = runs[NARROW]
    from_axis = np.hypot(*run.positions.T[:2])
    far = from_axis > np.median(from_axis)
    assert run.positions[far, 2].mean() > run.positions[~far, 2].mean()


def test_a_bin_is_filled_as_densely_as_balls_pack(runs):
    for run in runs.values():
        # Poured balls: between loose packing, 0.55, and the random close packing of balls of several sizes.
        assert 0.55 < run.observables["solid_fraction"] < 0.65
        # The rain ends when four balls lie above the mark; the surface is then less than two balls below it.
        assert abs(run.observables["fill_height"] - BIN.fill_depth) < 2 * BALL_DIAMETER


def test_a_wider_outlet_lets_more_through(runs):
    rates = {outlet: runs[outlet].observables["flow_rate"] for outlet in (NARROW, WIDE)}
    # Beverloo's law with k from 1 to 2: ((20 - 4 k) / (14 - 4 k))^2.5 is 3.2 to 5.7. Some two hundred balls
    # come out, whose rate varies by a tenth of itself, or two, and so short a bed is nearly too low for it.
    assert 2.2 < rates[WIDE] / rates[NARROW] < 7.0
    seen = runs[WIDE].observables
    bulk_density = GRAIN.density * seen["solid_fraction"]
    factor = rates[WIDE] / (bulk_density * np.sqrt(GRAVITY) * (WIDE - 1.4 * BALL_DIAMETER) ** 2.5)
    # Beverloo, Leniger and van de Velde (1961): 0.55 to 0.65 for sands and seeds in tall bins.
    assert 0.4 < factor < 0.8


def test_nothing_passes_a_hole_smaller_than_a_ball(runs):
    run, seen = runs[CLOSED], runs[CLOSED].observables
    assert run.status == "failed"
    assert run.reason.startswith("the outlet is clogged: 0.0")
    assert_measured_as_declared(hopper_case(CLOSED), run, absent=frozenset({"flow_rate", "flow_rate_se"}))
    assert (seen["clogged"], seen["fallen_mass"], seen["discharge_time"]) == (1, 0, 0)
    assert seen["mass_left"] == seen["filled_mass"]
    assert len(run.positions) == seen["grain_count"]


def test_the_rate_is_that_of_the_steady_part():
    # Nothing for a second, then 2 kg/s up to 10 kg, and slower from there on; 20 to 70 % is the fast part.
    time = np.arange(0.0, 12.0, 0.25)
    mass = np.interp(time, [0.0, 1.0, 6.0, 10.0, 12.0], [0.0, 0.0, 10.0, 12.0, 12.0])
    state = DischargeState("discharge", fallen=np.column_stack([time, mass]).tolist())
    assert state.flow_rate == pytest.approx(2.0, rel=1e-12)
    assert state.last_fall == 10.0
    assert DischargeState("discharge", fallen=[[0.0, 0.0], [1.0, 5.0]]).flow_rate is None


BOXES = DrawDown(0.08, 0.0165, 0.03, 0.028, 0.045, STEEL, rain_rate=3e3, rest_speed=3e-3)
LOW = replace(BOXES, depth=0.009, drop=0.012)
"""Boxes whose heap reaches the slot."""


def draw_down_case(boxes: DrawDown = BOXES) -> Case:
    """Return boxes of some six hundred balls, or half as many."""
    return ball_case(boxes, friction=0.2, rolling=0.1)


@pytest.fixture(scope="module")
def drawn() -> list[CaseResult]:
    """Simulate a draw-down, and one whose lower box is too low."""
    results = run_batch([draw_down_case(), draw_down_case(LOW)])
    return [results[0], results[1]]


def test_a_draw_down_keeps_its_mass(drawn):
    run, seen = drawn[0], drawn[0].observables
    assert (run.status, run.reason) == ("finished", "")
    assert_measured_as_declared(draw_down_case(), run)
    # Masses are kept in single precision: 6e-8 of each, and of the sum of some hundred.
    assert seen["fallen_mass"] + seen["mass_left"] == pytest.approx(seen["filled_mass"], rel=1e-6)
    balls = GRAIN.density * np.pi / 6.0 * (BALL_DIAMETER * run.sizes) ** 3
    below = run.positions[:, 2] < BOXES.drop
    assert seen["fallen_mass"] == pytest.approx(balls[below].sum(), rel=1e-6)
    assert seen["mass_left"] == pytest.approx(balls[~below].sum(), rel=1e-6)
    assert seen["grains_lost"] == 0


def test_every_ball_is_inside_the_boxes(drawn):
    for boxes, run in zip((BOXES, LOW), drawn, strict=True):
        # A ball sinks into a wall by less than a tenth of its radius.
        size = 0.9 * run.sphere_radii
        assert (np.abs(run.positions[:, 0]) + size < boxes.width / 2).all()
        assert (np.abs(run.positions[:, 1]) + size < boxes.depth / 2).all()
        assert (run.positions[:, 2] > size).all()


def test_a_draw_down_is_symmetric(drawn):
    seen = drawn[0].observables
    # Over four sets of frictions the part at the left was 0.46 to 0.57.
    assert seen["mass_left_left"] / seen["mass_left"] == pytest.approx(0.5, abs=0.15)
    for name in ("shear_angle", "repose_angle"):
        left, right = seen[f"{name}_left"], seen[f"{name}_right"]
        assert seen[name] == (left + right) / 2
        # Flanks of four to eight balls: over those sets the sides differed by 0.1 to 11 degrees, 5.2 in the
        # root mean square; three times that.
        assert left == pytest.approx(right, abs=16.0)
        assert 15.0 < seen[name] < 60.0


def test_the_slopes_end_at_the_slot(drawn):
    x, _, z = drawn[0].positions.T
    above = z > BOXES.drop
    # Balls may lean over the edge by less than one.
    assert (np.abs(x[above]) > BOXES.slot / 2 - BALL_DIAMETER).all()
    assert {-1.0, 1.0} == set(np.sign(x[above]))


def test_a_heap_that_reaches_the_slot_is_a_failure_with_its_reason(drawn):
    run = drawn[1]
    assert run.status == "failed"
    assert run.reason == "the heap has reached the slot: raise drop, or lower fill_depth"
    assert run.observables["clogged"] == 1
    assert "shear_angle" not in run.observables
    assert run.observables["fallen_mass"] > 0
