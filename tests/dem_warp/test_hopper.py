"""The flat-bottomed hopper: what comes out of it, how fast, and what stays."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import GRAIN, GRAVITY, STEEL, assert_measured_as_told, ball_case, run_batch

from dem_warp import Case, CaseResult, Hopper
from dem_warp.scenes.discharge import DischargeState

BALL_DIAMETER = 4e-3
CLOSED, NARROW, WIDE = 3e-3, 14e-3, 20e-3
BIN = Hopper(diameter=0.032, fill_depth=0.03, outlet=WIDE, wall_material=STEEL)


def hopper_case(outlet: float) -> Case:
    """A bin of some four hundred balls with little friction."""
    return ball_case(replace(BIN, outlet=outlet), friction=0.1)


@pytest.fixture(scope="module")
def runs() -> dict[float, CaseResult]:
    """Results by outlet, of one batch."""
    outlets = (CLOSED, NARROW, WIDE)
    results = run_batch([hopper_case(outlet) for outlet in outlets])
    return {outlet: results[i] for i, outlet in enumerate(outlets)}


@pytest.mark.parametrize("outlet", [NARROW, WIDE])
def test_what_was_filled_in_comes_out_or_stays(runs, outlet):
    run, seen = runs[outlet], runs[outlet].observables
    assert (run.status, run.reason) == ("finished", "")
    assert [phase["name"] for phase in run.phases] == ["fill", "settle", "open", "discharge"]
    # Four looks, three rates in between: too few to say how good their mean is.
    absent = frozenset({"flow_rate_se"}) if outlet == WIDE else frozenset()
    assert_measured_as_told(hopper_case(outlet), run, absent)
    assert absent or 0.0 < seen["flow_rate_se"] < 0.2 * seen["flow_rate"]
    # Masses are kept in single precision: 6e-8 of each, and of the sum of some hundred.
    assert seen["fallen_mass"] + seen["mass_left"] == pytest.approx(seen["filled_mass"], rel=1e-6)
    balls = GRAIN.density * np.pi / 6.0 * (BALL_DIAMETER * run.sizes) ** 3
    assert seen["mass_left"] == pytest.approx(balls.sum(), rel=1e-6)
    assert seen["grains_lost"] == 0
    assert seen["clogged"] == 0
    assert 0.0 < seen["discharge_time"] < sum(phase["time"] for phase in run.phases[2:])


@pytest.mark.parametrize("outlet", [NARROW, WIDE])
def test_what_stays_leaves_the_outlet_free(runs, outlet):
    run = runs[outlet]
    from_axis = np.hypot(*run.positions.T[:2])
    assert len(run.positions) > 0
    assert (run.positions[:, 2] > 0.0).all()
    assert (from_axis > 0.25 * outlet).all()
    # Inside the bin, into whose wall a ball sinks by less than a tenth of its radius.
    assert (from_axis + 0.9 * run.sphere_radii < BIN.diameter / 2).all()


def test_a_crater_rises_from_the_outlet_to_the_wall(runs):
    # The narrow outlet leaves room for one: about the wide one stands a ring of one or two balls.
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
    assert_measured_as_told(hopper_case(CLOSED), run, absent=frozenset({"flow_rate", "flow_rate_se"}))
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


@pytest.mark.parametrize(
    ("changes", "message"),
    [],
)
def test_a_hopper_that_cannot_be_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        replace(BIN, **changes)
