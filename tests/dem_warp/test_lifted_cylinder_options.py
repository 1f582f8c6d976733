"""Options of a lifted cylinder: a tilt, a plate of its own friction, a vibration, air."""

import math
from dataclasses import replace

import numpy as np
import pytest
from worlds import SMALL_TUBE, assert_same_result, grains, pair, run_for, small_case, solve, state, world

from dem_warp import CaseResult, simulate
from dem_warp.device import resolve_device

FRICTION = small_case().grain_wall.static_friction
SLIPPERY = 0.1
ABOVE, BELOW = math.atan(SLIPPERY) + 0.08, math.atan(SLIPPERY) - 0.04
"""Slopes on either side of the friction angle [rad]."""

ONE = replace(SMALL_TUBE, grain_count=1)


def run(**options: float) -> CaseResult:
    """One grain of three feet in a slippery lifted cylinder with options."""
    case = small_case(scene=replace(ONE, **options))
    slippery = replace(case, grain_wall=replace(case.grain_wall, static_friction=SLIPPERY))
    [result] = simulate([slippery], device="cpu", workers=1)
    # a heap of no grains is none
    assert result.status == ("failed" if result.observables["grains_lost"] else "finished")
    return result


@pytest.fixture(scope="module")
def pile() -> CaseResult:
    """A small heap without any of the options."""
    return simulate([small_case(scene=replace(SMALL_TUBE, grain_count=30))], device="cpu", workers=1)[0]


def test_a_tilt_turns_gravity_towards_x():
    gravity = np.array(replace(SMALL_TUBE, tilt=0.3).gravity)
    assert np.linalg.norm(gravity) == pytest.approx(9.81, rel=1e-15)
    assert math.atan2(gravity[0], -gravity[2]) == pytest.approx(0.3, rel=1e-15)
    assert gravity[1] == 0.0
    assert SMALL_TUBE.gravity == (0.0, 0.0, -9.81)


def test_a_grain_on_a_tilted_plate_stays_below_the_friction_angle_and_leaves_above():
    assert run(tilt=BELOW).observables["grains_lost"] == 0
    assert run(tilt=ABOVE).observables["grains_lost"] == 1


def test_the_friction_of_the_plate_is_the_plates_alone():
    def contacts(**options: float) -> dict[str, object]:
        case = small_case(scene=replace(SMALL_TUBE, **options))
        [setup] = case.scene.prepare([case], resolve_device("cpu"))
        plate, tube = (setup.contacts[contact] for _, contact in setup.walls)
        return {"grains": setup.contacts[0], "tube": tube, "plate": plate}

    base, rough = contacts(), contacts(plate_friction=0.9)
    assert base["plate"] == base["tube"]
    assert rough == base | {"plate": replace(base["plate"], static_friction=0.9)}
    assert contacts(plate_friction_excess=0.5) == rough


def test_a_plate_with_the_friction_of_the_tube_changes_no_bit(pile):
    scene = replace(SMALL_TUBE, grain_count=30, plate_friction=FRICTION, vibration_frequency=20.0)
    assert_same_result(simulate([small_case(scene=scene)], device="cpu", workers=1)[0], pile)


def test_a_vibration_flattens_the_heap_and_ends_before_it_rests(pile):
    scene = replace(SMALL_TUBE, grain_count=30, vibration_amplitude=1e-4, vibration_hold=0.2)
    [shaken] = simulate([small_case(scene=scene)], device="cpu", workers=1)
    assert shaken.status == "finished"
    # 50 vibrations a second, whole ones: 0.32 s for the height of the tube, 0.2 s more.
    assert scene.vibration_time == pytest.approx(0.52, rel=1e-12)
    assert shaken.observables["time_to_rest"] >= scene.vibration_time
    assert shaken.positions[:, 2].mean() < pile.positions[:, 2].mean()
    # The plate is back at z = 0: spheres sink in by less than a tenth of the smallest.
    assert (shaken.sphere_centers[:, 2] > 0.9 * shaken.sphere_radii).all()


def test_air_takes_velocity_at_its_rate():
    rate, speed, step = 5.0, 0.2, 1e-4
    still = replace(world(grains(np.zeros(3), velocities=[speed, 0.0, 0.0]), pair(), step), air_drag=rate)
    solver = solve(still)
    run_for(solver, 0.2)
    time = int(solver.grains[0].step.numpy()[0]) * step
    end = state(solver)
    # The decay of every step is exact: rounding of float64 over 2,000 steps.
    assert end["velocities"][0, 0] == pytest.approx(speed * math.exp(-rate * time), rel=1e-12)
    # The path is the sum over the steps, of first order in the step.
    path = speed / rate * -math.expm1(-rate * time)
    assert end["positions"][0, 0] == pytest.approx(path, rel=rate * step)


def test_air_holds_a_falling_grain_at_its_terminal_speed():
    rate, step = 200.0, 1e-5
    falling = world(grains(np.zeros(3)), pair(), step, gravity=(0.0, 0.0, -9.81))
    solver = solve(replace(falling, air_drag=rate))
    run_for(solver, 0.1)
    # e**-20 is left of the way to the terminal speed g / rate; a step of first order is off by rate * step.
    velocity = state(solver)["velocities"][0]
    np.testing.assert_allclose(velocity, [0.0, 0.0, -9.81 / rate], rtol=rate * step, atol=0.0)
