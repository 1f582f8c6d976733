"""Sliding, rolling and rest on a plane, with every law of friction, against closed forms."""

import math

import numpy as np
import pytest
import worlds
from worlds import GRAVITY, PYRAMID, RADIUS, TIME_STEP, ball_mass, ball_on_plane, pair, run_for, solve, state

from dem_warp.laws.conventions import ContactLaws
from dem_warp.laws.kinetic_friction import KineticFriction
from dem_warp.laws.mechanism import Mechanism
from dem_warp.laws.rate_weakening import RateWeakening
from dem_warp.materials import rayleigh_time
from dem_warp.model import ContactCoefficients, WorldSetup
from dem_warp.solver import CHUNK, Solver
from dem_warp.walls import Motion, Plane

SPEED = 0.1


def lever(contact: ContactCoefficients) -> float:
    """Return the distance from a resting ball's centre to its contact, half an overlap above the plane."""
    return RADIUS - 0.5 * worlds.static_overlap(contact, ball_mass() * GRAVITY)


def test_a_sliding_ball_comes_to_roll():
    contact = pair(restitution=0.5, friction=0.2)
    solver = solve(ball_on_plane(contact, velocity=(SPEED, 0.0, 0.0)))
    run_for(solver, 0.05)
    end = state(solver)
    # Without rolling friction the moment of momentum about the contact is kept: v = v0 / (1 + 2 R^2 / (5
    # L^2)), which is 5/7 v0 up to the overlap, L = R - d / 2; the tangential spring's last swing is damped
    # within some hundred steps.
    rolling = SPEED / (1.0 + 0.4 * (RADIUS / lever(contact)) ** 2)
    assert rolling == pytest.approx(5.0 / 7.0 * SPEED, rel=1e-3)
    assert end["velocities"][0, 0] == pytest.approx(rolling, rel=1e-6)
    assert end["spins"][0, 1] * lever(contact) == pytest.approx(rolling, rel=1e-6)


def test_a_moving_belt_takes_a_ball_along():
    belt, contact = 0.3, pair(restitution=0.2, friction=0.3)
    solver = solve(ball_on_plane(contact))
    solver.move_wall(0, 0, Motion(velocity=(belt, 0.0, 0.0)))
    solver.advance(1)
    # It slides at first: mu g, taken up by the spring within the first of 256 steps.
    sliding = 0.3 * GRAVITY * CHUNK * TIME_STEP
    assert state(solver)["velocities"][0, 0] == pytest.approx(sliding, rel=0.01)
    run_for(solver, 0.08)
    # In the belt's frame it rolls at 5/7 of its first speed in the end: 2/7 in the laboratory's, up to the
    # overlap in the lever.
    arm, end = lever(contact), state(solver)
    rolling = belt * (1.0 - 1.0 / (1.0 + 0.4 * (RADIUS / arm) ** 2))
    assert end["velocities"][0, 0] == pytest.approx(rolling, rel=1e-6)
    assert end["spins"][0, 1] * arm == pytest.approx(rolling - belt, rel=1e-6)


@pytest.mark.parametrize("damped", [True, False])
def test_the_tangential_spring_swings_with_its_damping(damped):
    laws = ContactLaws(tangential_damping="tsuji" if damped else "none")
    contact = pair(restitution=0.9, friction=10.0, laws=laws)
    solver = solve(ball_on_plane(contact, velocity=(1e-3 * SPEED, 0.0, 0.0)))
    seen = worlds.record(solver, 4000)
    slip = seen.velocities[:, 0, 0] - lever(contact) * seen.spins[:, 0, 1]
    # The contact point swings on S_t with the mass 1 / (1/m + L^2/I), 2/7 m for a solid ball; the damping is
    # that of the contact, c = 2 sqrt(5/6) |beta| sqrt(S_t m).
    overlap = worlds.static_overlap(contact, ball_mass() * GRAVITY)
    stiffness = 8.0 * contact.shear_modulus * math.sqrt(RADIUS * overlap)
    inverse_mass = (1.0 + 2.5 * (lever(contact) / RADIUS) ** 2) / ball_mass()
    decay = 0.5 * damped * contact.damping * math.sqrt(stiffness * ball_mass()) * inverse_mass
    cycle = round(2.0 * math.pi / math.sqrt(stiffness * inverse_mass - decay**2) / TIME_STEP)
    first, last = (np.abs(part).max() for part in (slip[:cycle], slip[3 * cycle : 4 * cycle]))
    # A peak is read within half a step, (0.18 / 2)^2 / 2, and a cycle is taken as whole steps, 35 for 35.4.
    assert last / first == pytest.approx(math.exp(-3.0 * cycle * decay * TIME_STEP), rel=0.02)


def test_rolling_friction_stops_a_ball_at_the_distance_of_the_law():
    rolling = 0.05
    contact = pair(restitution=0.5, friction=0.5, rolling=rolling)
    arm = lever(contact)
    solver = solve(ball_on_plane(contact, velocity=(SPEED, 0.0, 0.0), spin=(0.0, SPEED / arm, 0.0)))
    # m a = -f and (2/5) m R^2 a / L = f L - mu_r m g L.
    deceleration = rolling * GRAVITY / (1.0 + 0.4 * (RADIUS / arm) ** 2)
    run_for(solver, 1.2 * SPEED / deceleration)
    end = state(solver)
    # The tangential spring gives way by mu_r m g / S_t, and swings once when the ball stops: 1e-4 of the
    # path.
    assert end["positions"][0, 0] == pytest.approx(0.5 * SPEED**2 / deceleration, rel=2e-4)
    assert np.abs(end["velocities"]).max() < 1e-9
    assert np.abs(end["spins"]).max() < 1e-7


def test_a_ball_stays_on_a_slope_below_the_rolling_angle():
    rolling = 0.2
    contact = pair(restitution=0.2, friction=0.8, rolling=rolling)
    slope = math.degrees(math.atan(0.5 * rolling))
    solver = solve(ball_on_plane(contact, slope))
    run_for(solver, 0.25)
    early = state(solver)
    run_for(solver, 0.25)
    late = state(solver)
    # No creep: the same place after as long again, to the rounding of a position.
    assert np.abs(late["positions"] - early["positions"]).max() < 1e-15
    assert np.abs(late["velocities"]).max() < 1e-12
    assert np.abs(late["spins"]).max() < 1e-9
    # It hangs on the tangential spring, S_t = 8 G* sqrt(R d), which carries the weight's part along the
    # slope.
    weight = ball_mass() * GRAVITY
    overlap = worlds.static_overlap(contact, weight * math.cos(math.radians(slope)))
    stiffness = 8.0 * contact.shear_modulus * math.sqrt(RADIUS * overlap)
    assert late["positions"][0, 1] == pytest.approx(
        weight * math.sin(math.radians(slope)) / stiffness, rel=1e-6
    )


def test_rolling_friction_stops_a_spin_and_never_reverses_it():
    rolling = 0.1
    contact = pair(restitution=0.2, friction=0.0, rolling=rolling)
    spin = 5.0
    solver = solve(ball_on_plane(contact, spin=(0.0, 0.0, spin)))
    # The law is directional but knows no axis: it brakes a twist as it brakes a roll.
    rate = rolling * ball_mass() * GRAVITY * lever(contact) / (0.4 * ball_mass() * RADIUS**2)
    steps = int(spin / rate / TIME_STEP)
    seen = worlds.record(solver, steps + 50).spins[:, 0, 2]
    # A constant torque: a straight line, whose slope wavers by the integration of the overlap.
    assert seen[steps // 2] == pytest.approx(spin - rate * (steps // 2) * TIME_STEP, rel=1e-6)
    assert (np.diff(seen) <= 0.0).all()
    assert (seen >= 0.0).all()
    assert (seen[-40:] == 0.0).all()


def pyramid_on_slope(friction: float, slope: float) -> WorldSetup:
    foot = -(PYRAMID.centers[:, 2] - PYRAMID.radii).min()
    contact = pair(restitution=0.2, friction=friction)
    bodies = worlds.grains([0.0, 0.0, foot])
    time_step = 0.25 * rayleigh_time(float(PYRAMID.radii.min()), worlds.GRAIN)
    return worlds.world(
        bodies,
        contact,
        time_step,
        walls=(Plane(),),
        gravity=worlds.downhill(slope),
        shapes=(PYRAMID,),
        skin=1e-3,
    )


def test_a_clump_sticks_below_the_friction_angle_and_slides_above():
    friction = 0.2
    angle = math.degrees(math.atan(friction))
    below, above, steep = slopes = angle - 0.1, angle + 0.1, angle + 4.0
    solver = solve(*(pyramid_on_slope(friction, slope) for slope in slopes))
    run_for(solver, 0.1)
    early = [state(solver, w) for w in range(3)]
    run_for(solver, 0.1)
    late = [state(solver, w) for w in range(3)]
    # Standing on three feet it does not move at all; 0.2 degree higher it gathers speed.
    assert np.abs(late[0]["velocities"]).max() < 1e-12
    assert np.abs(late[0]["positions"] - early[0]["positions"]).max() < 1e-15
    elapsed = (math.ceil(0.1 / solver.worlds[0].time_step / 256)) * 256 * solver.worlds[0].time_step
    for w, slope in ((1, above), (2, steep)):
        gain = late[w]["velocities"][0, 1] - early[w]["velocities"][0, 1]
        radians = math.radians(slope)
        expected = GRAVITY * (math.sin(radians) - friction * math.cos(radians)) * elapsed
        # All three feet slide, so friction is mu times the whole weight, however the feet share it.
        assert gain == pytest.approx(expected, rel=1e-3)
    assert below < angle < above


FRICTION = 0.5
NEVER_TURNS = 1e3


def block(law: Mechanism, incline: float, speed: float = 0.0, friction: float = FRICTION) -> WorldSetup:
    """Return a block on a slope of an incline, the tangent of its angle, with a speed downhill [m/s].

    It is damped so that the weight, which comes at once, swings it only 0.5 % over the spring's rest.
    """
    contact = pair(restitution=1e-4, friction=friction, rolling=NEVER_TURNS, mechanisms=(law,))
    return ball_on_plane(contact, math.degrees(math.atan(incline)), velocity=(0.0, speed, 0.0))


def downhill_pull(incline: float, friction: float) -> float:
    """Return the acceleration g (sin - mu cos) [m/s2] of a block that slides down."""
    return GRAVITY * (incline - friction) / math.hypot(1.0, incline)


def gain(solver: Solver, incline: float, chunks: int) -> float:
    """Tilt the slope to an incline; return the change of the speed [m/s] in some chunks after the first."""
    setup = solver.model.world.numpy()
    setup["gravity"] = worlds.downhill(math.degrees(math.atan(incline)))
    solver.model.world.assign(setup)
    solver.advance(1)
    before = state(solver)["velocities"][0, 1]
    solver.advance(chunks)
    return float(state(solver)["velocities"][0, 1] - before)


def test_a_block_slips_above_the_static_angle_and_slides_on_down_to_the_kinetic_one():
    kinetic, chunks = 0.3, 4
    time = chunks * CHUNK * TIME_STEP
    solver = solve(block(KineticFriction(friction_drop=1.0 - kinetic / FRICTION), 0.0))
    tilts = (0.1, 0.2, 0.3, 0.4, 0.45, 0.49)
    assert [abs(gain(solver, incline, chunks)) < 1e-12 for incline in tilts] == [True] * 6
    for incline in (0.51, 0.4, 0.31, 0.29, 0.2):
        # A constant force of rounded terms: 1e-16 of the speed, 0.1 m/s, in each of 1000 steps.
        assert gain(solver, incline, chunks) == pytest.approx(
            time * downhill_pull(incline, kinetic), abs=1e-13
        )
    # Brought to rest it sticks as it did at first.
    gain(solver, 0.0, 8)
    assert [abs(gain(solver, incline, chunks)) < 1e-12 for incline in tilts] == [True] * 6


def test_friction_that_weakens_follows_the_closed_form_on_either_side_of_the_critical_speed():
    weakening, weakening_speed, incline = 0.6, 0.1, 0.35
    law = RateWeakening(weakening=weakening, weakening_speed=weakening_speed)
    # mu(v) = tan(slope): slower blocks stop, faster ones run away.
    strong, weak = FRICTION * weakening, FRICTION * (1.0 - weakening)
    critical = -weakening_speed * math.log((incline - weak) / strong)
    speeds = critical * np.array([0.5, 1.0, 2.0])
    steps = 1000
    seen = worlds.record(solve(*(block(law, incline, speed) for speed in speeds)), steps).velocities[:, :, 1]
    # dv/dt = a - b exp(-v / v0) is linear in exp(v / v0).
    drive = downhill_pull(incline, weak)
    drag = drive - downhill_pull(incline, weak + strong)
    time = TIME_STEP * np.arange(steps + 1)[:, None]
    rise = np.exp(drive * time / weakening_speed)
    grown = np.exp(speeds / weakening_speed) * rise + drag / drive * (1.0 - rise)
    closed = weakening_speed * np.log(np.maximum(grown, 1.0))
    # The spring is wound up after a step or two, which costs mu g dt, 1e-4 m/s, at the most; measured: 2e-5.
    np.testing.assert_allclose(seen[closed > 0.0], closed[closed > 0.0], rtol=0.0, atol=5e-5)
    assert closed[-1, 0] == 0.0
    assert abs(seen[-1, 0]) < 5e-5
    assert seen[-1, 1] == pytest.approx(critical, rel=1e-12)
    assert seen[-1, 2] > 1.2 * speeds[2]
