"""The rotating drum: the slope of a bed that flows."""

import math
from dataclasses import replace

import numpy as np
import pytest
from worlds import STEEL, assert_measured_as_told, ball_case, run_batch

from dem_warp import Case, CaseResult, Drum

DRUM = Drum(
    diameter=0.05,
    length=0.018,
    wall_material=STEEL,
    rotation_rate=1.0,
    start_up=0.25,
    revolutions=0.75,
    # Without friction a bed rocks to and fro for long: it is at rest when it is slow.
    rest_speed=0.05,
)
FRICTIONS = (0.0, 0.15, 0.6)


def drum_case(friction: float) -> Case:
    """A drum of some two hundred balls."""
    return ball_case(DRUM, friction)


@pytest.fixture(scope="module")
def runs() -> dict[float, CaseResult]:
    """Results by friction, of one batch."""
    results = run_batch([drum_case(friction) for friction in FRICTIONS])
    return {friction: results[i] for i, friction in enumerate(FRICTIONS)}


@pytest.mark.parametrize("friction", FRICTIONS)
def test_a_drum_turns_for_as_long_as_it_should_and_loses_nothing(runs, friction):
    run, seen = runs[friction], runs[friction].observables
    assert (run.status, run.reason) == ("finished", "")
    assert_measured_as_told(drum_case(friction), run)
    times = {phase["name"]: phase["time"] for phase in run.phases}
    assert list(times) == ["fill", "settle", "start up", "turn"]
    # It looks some forty times a revolution.
    assert times["turn"] == pytest.approx(DRUM.revolutions / DRUM.rotation_rate, abs=0.05)
    assert seen["grains_lost"] == 0
    assert len(run.positions) == seen["grain_count"]
    # A ball sinks into the shell and the ends by less than a tenth of its radius.
    from_axis = np.hypot(run.positions[:, 0], run.positions[:, 2] - DRUM.diameter / 2)
    assert (from_axis + 0.9 * run.sphere_radii < DRUM.diameter / 2).all()
    assert (np.abs(run.positions[:, 1]) + 0.9 * run.sphere_radii < DRUM.length / 2).all()


def test_a_bed_without_friction_stays_level(runs):
    seen = runs[0.0].observables
    # It still rocks: half the height of a ball over the half of its surface is 2.5 degrees.
    assert abs(seen["mass_angle"]) < 2.5
    assert abs(seen["dynamic_angle"]) < 2.5


def test_a_bed_stands_the_steeper_the_more_friction_it_has(runs):
    for name in ("dynamic_angle", "mass_angle", "upper_angle", "lower_angle"):
        level, low, high = (runs[friction].observables[name] for friction in FRICTIONS)
        # Three quarters of a revolution turn the bed over about twice: its angle is good to a few degrees.
        assert low > level + 5.0
        assert high > low + 5.0
    # The drum is narrow, so its ends carry some of the bed: it may pass the angle of friction, 31 degrees.
    assert 25.0 < runs[0.6].observables["dynamic_angle"] < 55.0
    assert runs[0.6].observables["dynamic_angle_sd"] < 10.0


def test_the_level_of_the_filling_encloses_its_part_of_the_drum():
    space = math.pi / 4 * DRUM.diameter**2 * DRUM.length
    for filling in (0.05, 0.35, 0.5):
        drum = replace(DRUM, filling=filling)
        # The level is interpolated in a table of 10,000 angles.
        assert drum.volume == pytest.approx(filling * space, rel=1e-6)
    assert replace(DRUM, filling=0.5).brim == pytest.approx(DRUM.diameter / 2, rel=1e-6)
    assert DRUM.volume_below(DRUM.diameter) == pytest.approx(space, rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"filling": 0.6}, "Drum.filling: must be at most 0.5, got 0.6"),
        ({"filling": 0.0}, "Drum.filling: must be positive and finite, got 0.0"),
        ({"start_up": -1.0}, "Drum.start_up: must be finite and 0 or more, got -1.0"),
        # w^2 r = g at 3.153 revolutions a second.
        ({"rotation_rate": 3.2}, "Drum.rotation_rate: must be below 3.153 1/s, .* got 3.2"),
    ],
)
def test_a_drum_that_cannot_be_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        replace(DRUM, **changes)
