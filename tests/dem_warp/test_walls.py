"""Planes, plates, cylinders and cones: rest, passage and bounces of a sphere, and walls that move."""

import math

import numpy as np
import pytest
import worlds
from scipy.spatial.transform import Rotation
from worlds import GRAVITY, RADIUS, TIME_STEP, ball_mass, downhill, grains, pair, run_for, solve, state, world

from dem_warp.types import WorldFlag
from dem_warp.walls import Cone, Cylinder, Disc, Mesh, Motion, Plane

CONTACT = pair(restitution=0.1)
OVERLAP = worlds.static_overlap(CONTACT, ball_mass() * GRAVITY)
TUBE = Cylinder(point=(0.01, -0.01, 0.0), radius=0.03, length=0.05)
PLATE = Disc(point=(0.01, -0.01, 0.0), normal=(0.0, 0.0, 2.0), radius=0.03, inner_radius=0.004)
FUNNEL = Cone(point=(0.01, -0.01, 0.0), radius=0.01, upper_radius=0.03, length=0.02)
SLANT = math.sqrt(0.5)


@pytest.mark.parametrize(
    ("wall", "nearest", "outward"),
    [
        pytest.param(TUBE, (-0.03, 0.0, 0.02), (1.0, 0.0, 0.0), id="inside a tube"),
        pytest.param(TUBE, (0.03, 0.0, 0.02), (1.0, 0.0, 0.0), id="outside a tube"),
        pytest.param(TUBE, (0.03, 0.0, 0.05), (0.0, 0.0, 1.0), id="on the upper rim of a tube"),
        pytest.param(TUBE, (0.0, 0.03, 0.05), (0.0, -SLANT, SLANT), id="inside the upper rim"),
        pytest.param(TUBE, (-0.03, 0.0, 0.0), (0.0, 0.0, -1.0), id="below the lower rim"),
        pytest.param(PLATE, (0.0, 0.02, 0.0), (0.0, 0.0, 1.0), id="on a plate"),
        pytest.param(PLATE, (0.0, 0.03, 0.0), (0.0, SLANT, -SLANT), id="below the rim of a plate"),
        pytest.param(PLATE, (0.004, 0.0, 0.0), (-0.6, 0.0, 0.8), id="over the rim of a hole"),
        pytest.param(FUNNEL, (0.02, 0.0, 0.01), (-SLANT, 0.0, SLANT), id="inside a cone"),
        pytest.param(FUNNEL, (0.0, -0.02, 0.01), (0.0, -SLANT, -SLANT), id="outside a cone"),
        pytest.param(FUNNEL, (0.03, 0.0, 0.02), (SLANT, 0.0, SLANT), id="beyond the upper rim of a cone"),
        pytest.param(FUNNEL, (-0.01, 0.0, 0.0), (0.0, 0.0, -1.0), id="below the lower rim of a cone"),
    ],
)
def test_a_ball_rests_on_every_side_of_a_wall(wall, nearest, outward):
    # The nearest point of the wall and the direction from there to the ball give its place at rest: a radius
    # off, less the static overlap of a flat wall. On a convex side it balances, for a tenth of its time of
    # fall.
    foot = np.add(wall.point, nearest)
    end = worlds.settle(CONTACT, wall, foot + np.multiply(RADIUS, outward), np.negative(outward))
    overlap = RADIUS - np.linalg.norm(end - foot)
    assert overlap == pytest.approx(OVERLAP, rel=1e-6)
    np.testing.assert_allclose(end, foot + np.multiply(RADIUS - OVERLAP, outward), atol=1e-6 * OVERLAP)


def test_a_ball_passes_through_an_open_end_and_through_the_hole_of_a_plate():
    plate = Disc(TUBE.point, (0.0, 0.0, 1.0), radius=0.03, inner_radius=1.01 * RADIUS)
    start = grains(np.add(TUBE.point, [0.0, 0.0, 0.07]))
    solver = solve(world(start, CONTACT, TIME_STEP, walls=(TUBE, plate), gravity=downhill(0.0)))
    fall = math.ceil(0.15 / (256 * TIME_STEP))
    solver.advance(fall)
    n = fall * 256
    # Free fall of the scheme, to rounding: nothing touched.
    expected = 0.07 - GRAVITY * TIME_STEP**2 * n * (n + 1) / 2.0
    assert expected < -RADIUS
    np.testing.assert_allclose(
        state(solver)["positions"][0], np.add(TUBE.point, [0.0, 0.0, expected]), atol=1e-13
    )


@pytest.mark.parametrize(
    ("wall", "place", "velocity"),
    [
        pytest.param(PLATE, (0.04, -0.012, -0.012), (0.1, 0.02, 0.3), id="outer rim of a plate"),
        pytest.param(FUNNEL, (0.03, -0.01, 0.03), (0.2, -0.1, -0.2), id="inside of a cone"),
        pytest.param(Mesh.tube(0.03, 0.05, 11), (0.0, 0.0, 0.025), (0.9, 0.1, 0.0), id="a tube of triangles"),
        pytest.param(FUNNEL, (0.04, -0.012, 0.035), (0.05, 0.0, -0.3), id="upper rim of a cone"),
    ],
)
def test_an_elastic_impact_keeps_the_energy(wall, place, velocity):
    def impact(steps_a_unit):
        step = TIME_STEP / steps_a_unit
        solver = solve(world(grains(place, velocities=velocity), pair(), step, walls=(wall,)))
        run_for(solver, 0.05)
        return state(solver)["velocities"][0]

    speed = np.linalg.norm(velocity)
    lost = [abs(np.linalg.norm(impact(n)) / speed - 1.0) for n in (1, 4)]
    assert np.abs(impact(1) - velocity).max() > 0.1 * speed
    # Symplectic Euler returns the energy of an impact to second order of the steps in it, 17 and 68 here:
    # 1 / 17^2 = 3e-3, and a sixteenth of it. Measured: 4e-4 and 1.3e-5.
    assert lost[0] < 1e-3
    assert lost[1] < 1e-3 / 16.0


def test_the_wall_of_a_cone_carries_what_a_circling_ball_asks_for():
    # On a frictionless funnel of half angle a ball circles level at v^2 = g rho cot(a), rho the distance of
    # its centre from the axis, and the wall carries m g / sin(a).
    angle = math.radians(30.0)
    inward = np.array([-math.cos(angle), 0.0, math.sin(angle)])
    overlap = worlds.static_overlap(pair(), ball_mass() * GRAVITY / math.sin(angle))
    place = [0.04 * math.sin(angle), 0.0, 0.04 * math.cos(angle)] + (RADIUS - overlap) * inward
    speed = math.sqrt(GRAVITY * place[0] / math.tan(angle))
    funnel = Cone((0.0, 0.0, 0.0), 0.0, 0.05 * math.tan(angle), 0.05)
    ball = grains(place, velocities=[0.0, speed, 0.0])
    solver = solve(world(ball, pair(), TIME_STEP, walls=(funnel,), gravity=downhill(0.0)))
    run_for(solver, math.pi * place[0] / speed)
    [end], [velocity] = state(solver)["positions"], state(solver)["velocities"]
    # Symplectic Euler keeps the orbit to first order of the time step: g dt over the speed, 1e-4 of it.
    assert end[0] < -0.8 * place[0]
    assert [np.hypot(*end[:2]), end[2]] == pytest.approx([place[0], place[2]], rel=1e-3)
    assert np.linalg.norm(velocity) == pytest.approx(speed, rel=1e-3)


CHUNK_TIME = 256 * TIME_STEP


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


def shaken(acceleration: float, periods: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Return phase and gap [m] of a ball over a floor that shakes at 50 Hz with a peak acceleration [m/s2].

    They are seen sixteen times a period after the first five; the floor's amplitude [m] comes with them.
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
    worlds.assert_same_bits(*ends)


def test_a_wall_too_fast_for_its_cycle_is_flagged():
    # At 40 m/s it passes its half of the skin within two steps.
    setup = world(grains([0.0, 0.0, 0.05]), CONTACT, TIME_STEP, walls=(Plane(),), skin=1e-3)
    solver = solve(setup)
    solver.move_wall(0, 0, Motion(velocity=(0.0, 0.0, -40.0)))
    solver.advance(1)
    assert solver.flags.numpy()[0] & WorldFlag.LATE_REBUILD


def test_a_motion_of_some_duration_leaves_the_wall_in_its_last_place():
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
