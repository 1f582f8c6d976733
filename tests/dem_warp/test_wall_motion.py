"""Walls that move: where they stand, how they carry, turn and shake a sphere, and what rests on them."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from worlds import (
    GRAIN,
    GRAVITY,
    PYRAMID,
    RADIUS,
    assert_same_bits,
    ball_mass,
    downhill,
    grains,
    pair,
    run_for,
    solve,
    state,
    static_overlap,
    world,
)

from dem_warp.materials import rayleigh_time
from dem_warp.types import WorldFlag
from dem_warp.walls import Cone, Cylinder, Disc, Motion, Plane

TIME_STEP = 0.25 * rayleigh_time(RADIUS, GRAIN)
CHUNK_TIME = 256 * TIME_STEP
CONTACT = pair(restitution=0.1)
OVERLAP = static_overlap(CONTACT, ball_mass() * GRAVITY)
SLANT = math.sqrt(0.5)


def test_a_rising_plane_carries_a_ball_at_its_static_overlap():
    rise = 0.05
    setup = world(
        grains([0.0, 0.0, RADIUS - OVERLAP]), CONTACT, TIME_STEP, walls=(Plane(),), gravity=downhill(0.0)
    )
    solver = solve(setup)
    solver.advance(2)
    solver.move_wall(0, 0, Motion(velocity=(0.0, 0.0, rise)))
    solver.advance(20)
    lifted = 20 * 256 * TIME_STEP * rise
    end = state(solver)
    assert lifted > 0.5 * RADIUS
    # In the frame of the plane the ball rests: the damped bounce of the start has died out.
    assert end["positions"][0, 2] - lifted == pytest.approx(RADIUS - OVERLAP, abs=1e-6 * OVERLAP)
    assert end["velocities"][0, 2] == pytest.approx(rise, rel=1e-9)


def test_a_plane_that_turns_back_starts_from_where_it_stands():
    solver = solve(
        world(
            grains([0.0, 0.0, RADIUS - OVERLAP]),
            CONTACT,
            TIME_STEP,
            walls=(Plane(),),
            gravity=downhill(0.0),
        )
    )
    chunk = 256 * TIME_STEP
    height = 0.0
    for chunks, velocity in ((3, 0.0), (5, 0.02), (4, -0.01), (10, 0.0)):
        solver.move_wall(0, 0, Motion(velocity=(0.0, 0.0, velocity)))
        solver.advance(chunks)
        height += chunks * chunk * velocity
    assert state(solver)["positions"][0, 2] == pytest.approx(height + RADIUS - OVERLAP, abs=1e-6 * OVERLAP)


def test_a_moving_belt_takes_a_ball_along():
    belt = 0.1
    contact = pair(restitution=0.2, friction=0.3)
    overlap = static_overlap(contact, ball_mass() * GRAVITY)
    solver = solve(
        world(
            grains([0.0, 0.0, RADIUS - overlap]),
            contact,
            TIME_STEP,
            walls=(Plane(),),
            gravity=downhill(0.0),
        )
    )
    solver.move_wall(0, 0, Motion(velocity=(belt, 0.0, 0.0)))
    run_for(solver, 0.08)
    # In the belt's frame a ball slides at first and rolls at 5/7 of its speed in the end: 2/7 in the
    # laboratory's, up to the overlap in the lever.
    arm = RADIUS - 0.5 * overlap
    expected = belt * (1.0 - 1.0 / (1.0 + 0.4 * (RADIUS / arm) ** 2))
    end = state(solver)
    assert end["velocities"][0, 0] == pytest.approx(expected, rel=1e-6)
    assert end["spins"][0, 1] * arm == pytest.approx(expected - belt, rel=1e-6)


def test_the_place_of_a_wall_is_a_closed_form_of_its_motions():
    first = Motion(
        velocity=(0.1, 0.0, -0.02), spin=(3.0, -1.0, 2.0), amplitude=(0.0, 2e-3, 0.0), frequency=9.0
    )
    second = Motion(spin=(0.0, 0.0, -5.0), amplitude=(1e-3, 0.0, 1e-3), frequency=40.0)
    plate = Disc((0.01, 0.02, 0.03), (0.0, 1.0, 0.0), radius=0.01)
    solver = solve(world(grains([0.0, 0.0, -0.05]), CONTACT, TIME_STEP, walls=(plate,)))
    solver.advance(1)
    place, turn = np.array(plate.point), Rotation.identity()
    for motion, chunks in ((first, 7), (second, 5)):
        solver.move_wall(0, 0, motion)
        solver.advance(chunks)
        time = chunks * CHUNK_TIME
        swing = math.sin(2.0 * math.pi * motion.frequency * time)
        place = place + np.multiply(motion.velocity, time) + np.multiply(motion.amplitude, swing)
        turn = Rotation.from_rotvec(np.multiply(motion.spin, time)) * turn
        found, rotation = solver.wall_pose(0, 0)
        # A few roundings of float64 on 0.1 m and 1 rad, however many steps there were.
        np.testing.assert_allclose(found, place, rtol=0.0, atol=1e-16)
        assert (Rotation.from_quat(rotation) * turn.inv()).magnitude() < 1e-14


@pytest.mark.parametrize(
    ("wall", "nearest", "outward"),
    [
        pytest.param(Plane(), (0.03, 0.0, 0.0), (0.0, 0.0, 1.0), id="plane"),
        pytest.param(
            Disc((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.05), (0.03, 0.0, 0.0), (0.0, 0.0, 1.0), id="disc"
        ),
        pytest.param(Cylinder((0.0, 0.0, 0.0), 0.03, 0.05), (0.03, 0.0, 0.02), (-1.0, 0.0, 0.0), id="drum"),
        pytest.param(
            Cone((0.0, 0.0, 0.0), 0.01, 0.05, 0.04), (0.03, 0.0, 0.02), (-SLANT, 0.0, SLANT), id="cone"
        ),
    ],
)
def test_a_wall_that_spins_about_its_own_axis_drags_by_friction_only(wall, nearest, outward):
    # The ball's weight presses it against a wall that then runs away under it in +y at 0.9 m/s: as long as it
    # slides, mu g is its acceleration, and nothing else about the wall has changed.
    friction = 0.3
    contact = pair(restitution=0.1, friction=friction)
    place = np.add(nearest, np.multiply(RADIUS - OVERLAP, outward))
    gravity = tuple(np.multiply(-GRAVITY, outward))
    solver = solve(world(grains(place), contact, TIME_STEP, walls=(wall,), gravity=gravity))
    solver.advance(2)
    solver.move_wall(0, 0, Motion(spin=(0.0, 0.0, 30.0)))
    rebuilds = solver.rebuilds.numpy()[0]
    solver.advance(1)
    end = state(solver)
    # The spring takes up the drag within the first of 256 steps. In the drum, whose wall curves with 25 mm to
    # the ball's centre, its weight holds it back by g t^2 / (6 * 25 mm) = 0.8 % of the drag.
    speed = friction * GRAVITY * CHUNK_TIME
    assert end["velocities"][0, 1] == pytest.approx(speed, rel=0.01)
    # Its torque mu m g R spins up a ball of 2/5 m R^2.
    arm = RADIUS - 0.5 * OVERLAP
    spin = speed * arm / (0.4 * RADIUS**2)
    assert np.linalg.norm(end["spins"][0]) == pytest.approx(spin, rel=1.0 / 256.0)
    assert solver.rebuilds.numpy()[0] == rebuilds


def test_a_turntable_takes_a_grain_along_at_its_own_speed():
    rate, place = 3.0, [0.03, 0.0, 0.0018]
    contact = pair(restitution=0.1, friction=0.2)
    table = Disc((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), radius=0.06)
    setup = world(
        grains(place),
        contact,
        1e-5,
        walls=(table,),
        shapes=(PYRAMID,),
        gravity=downhill(0.0),
        speed_limit=5.0,
    )
    solver = solve(setup)
    run_for(solver, 0.02)
    solver.move_wall(0, 0, Motion(spin=(0.0, 0.0, rate)))
    run_for(solver, 0.1)
    end = state(solver)
    # The grain on its three feet sticks to the table, where friction holds seven times the centripetal pull:
    # the two go around as one body.
    around = np.cross([0.0, 0.0, rate], end["positions"][0])
    assert end["positions"][0, 1] > 0.005
    np.testing.assert_allclose(end["velocities"][0], around, atol=1e-3 * rate * 0.03)
    np.testing.assert_allclose(end["spins"][0], [0.0, 0.0, rate], atol=2e-2 * rate)


def test_a_drum_turns_a_ball_at_its_bottom():
    # The ball stays in place when its surface runs along with the drum's.
    rate, inner = 4.0, 0.03
    contact = pair(restitution=0.1, friction=0.5)
    drum = Cylinder((0.0, -0.02, 0.0), inner, 0.04, direction=(0.0, 1.0, 0.0))
    bottom = [0.0, 0.0, -(inner - RADIUS + OVERLAP)]
    spin = rate * (inner + 0.5 * OVERLAP) / (RADIUS - 0.5 * OVERLAP)
    ball = grains(bottom, spins=[0.0, spin, 0.0])
    solver = solve(world(ball, contact, TIME_STEP, walls=(drum,), gravity=downhill(0.0)))
    solver.move_wall(0, 0, Motion(spin=(0.0, rate, 0.0)))
    run_for(solver, 0.1)
    end = state(solver)
    np.testing.assert_allclose(end["positions"][0], bottom, atol=1e-9)
    np.testing.assert_allclose(end["spins"][0], [0.0, spin, 0.0], rtol=1e-9, atol=1e-6)


def shaken(acceleration: float, periods: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Phase and gap [m] of a ball over a floor that shakes at 50 Hz with a peak acceleration [m/s2].

    Seen sixteen times a period after it has got used to the floor; and the floor's amplitude [m].
    """
    frequency = 50.0
    chunks = 16
    step = 1.0 / (frequency * 256 * chunks)
    amplitude = acceleration / (2.0 * math.pi * frequency) ** 2
    ball = grains([0.0, 0.0, RADIUS - OVERLAP])
    solver = solve(world(ball, pair(restitution=1e-3), step, walls=(Plane(),), gravity=downhill(0.0)))
    solver.move_wall(0, 0, Motion(amplitude=(0.0, 0.0, amplitude), frequency=frequency))
    solver.advance(5 * chunks)
    phases, gaps = [], []
    for n in range(periods * chunks):
        solver.advance(1)
        phase = 2.0 * math.pi * (n + 1) / chunks
        height = amplitude * math.sin(phase)
        phases.append(phase)
        gaps.append(state(solver)["positions"][0, 2] - RADIUS - height)
    return np.array(phases), np.array(gaps), amplitude


def test_a_ball_rides_on_a_floor_that_shakes_gently():
    _, gaps, _ = shaken(0.5 * GRAVITY, 3)
    # It is pressed on with 0.5 to 1.5 of its weight: the static overlaps of these forces bound the gap.
    assert gaps.max() < -(0.5 ** (2.0 / 3.0)) * OVERLAP * 0.99
    assert gaps.min() > -(1.5 ** (2.0 / 3.0)) * OVERLAP * 1.01


def test_a_ball_leaves_a_floor_that_shakes_hard():
    phases, gaps, amplitude = shaken(1.8 * GRAVITY, 3)
    # A ball that does not bounce leaves where the floor falls with g, sin(phase) = 1 / 1.8, and flies
    # parabolically until it meets the floor again, within the period.
    start = math.asin(1.0 / 1.8)
    t = np.mod(phases - start, 2.0 * math.pi) / (2.0 * math.pi * 50.0)
    speed = amplitude * 2.0 * math.pi * 50.0 * math.cos(start)
    flight = amplitude * math.sin(start) + speed * t - 0.5 * GRAVITY * t**2 - amplitude * np.sin(phases)
    # Seen sixteen times a period, and for a ball that lands with a thousandth of its speed left.
    assert gaps.max() == pytest.approx(flight.max(), rel=0.05)


@pytest.mark.parametrize(
    "motion",
    [
        pytest.param(Motion(spin=(0.0, 6.0, 0.0)), id="tilts"),
        pytest.param(Motion(amplitude=(0.0, 0.0, 0.012), frequency=4.0), id="shakes"),
        pytest.param(Motion(velocity=(0.0, 0.0, 0.2)), id="rises"),
    ],
)
def test_a_wall_that_comes_from_afar_meets_a_ball_in_time(motion):
    # The ball lies beyond the thin skin; under the wide one it is in the list from the start.
    plate = Disc((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), radius=0.05)
    ends = []
    for skin in (1e-4, 0.05):
        ball = grains([-0.03, 0.0, RADIUS + 0.005])
        solver = solve(world(ball, CONTACT, TIME_STEP, walls=(plate,), skin=skin))
        solver.move_wall(0, 0, motion)
        run_for(solver, 0.06)
        assert WorldFlag(int(solver.flags.numpy()[0])) == WorldFlag(0)
        ends.append(state(solver))
    assert ends[0]["velocities"][0, 2] > 0.1
    assert_same_bits(*ends)


def test_a_wall_too_fast_for_its_cycle_is_flagged():
    # At 40 m/s it passes its half of the skin within two steps.
    setup = world(grains([0.0, 0.0, 0.05]), CONTACT, TIME_STEP, walls=(Plane(),), skin=1e-3)
    solver = solve(setup)
    solver.move_wall(0, 0, Motion(velocity=(0.0, 0.0, -40.0)))
    solver.advance(1)
    assert solver.flags.numpy()[0] & WorldFlag.LATE_REBUILD


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Motion(velocity=(0.0, math.nan, 0.0)), "Motion.velocity: must be three finite numbers"),
        (lambda: Motion(spin=(1.0, 2.0)), r"Motion.spin: must be three finite numbers, got \(1.0, 2.0\)"),
        (lambda: Motion(frequency=-1.0), "Motion.frequency: must be finite and 0 or more .Hz., got -1.0"),
        (lambda: Motion(amplitude=(0.0, 0.0, 1e-3)), "Motion.frequency: must be positive with amplitude"),
    ],
)
def test_a_motion_refuses_bad_values(build, message):
    with pytest.raises(ValueError, match=message):
        build()


def test_a_motion_of_some_duration_leaves_the_wall_where_it_then_is():
    amplitude, frequency, step = 2e-3, 50.0, TIME_STEP
    solver = solve(
        world(grains([0.0, 0.0, RADIUS - OVERLAP]), CONTACT, step, walls=(Plane(),), gravity=downhill(0.0))
    )
    shake = Motion(amplitude=(0.0, 0.0, amplitude), frequency=frequency, duration=3.25 / frequency)
    solver.move_wall(0, 0, shake)
    heights = []
    for chunk in range(1, 41):
        solver.advance()
        time = min(chunk * CHUNK_TIME, shake.duration)
        heights.append(amplitude * math.sin(2.0 * math.pi * frequency * time))
        # The same closed form in float64.
        assert solver.wall_pose(0, 0)[0][2] == pytest.approx(heights[-1], abs=1e-12 * amplitude)
    assert 2.0 * shake.duration < 40 * CHUNK_TIME
    # After three vibrations and a quarter the plane stays at its highest point, where the ball comes to rest.
    assert heights[-1] == pytest.approx(amplitude, rel=1e-12)
    run_for(solver, 0.5)
    end = state(solver)
    assert end["positions"][0, 2] == pytest.approx(amplitude + RADIUS - OVERLAP, abs=1e-6 * OVERLAP)
    assert np.abs(end["velocities"]).max() < 1e-9
