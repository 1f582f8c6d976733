"""Sliding, rolling and rest on a plane, against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from worlds import (
    GRAIN,
    GRAVITY,
    PYRAMID,
    RADIUS,
    TIME_STEP,
    ball_mass,
    ball_on_plane,
    downhill,
    grains,
    pair,
    record,
    run_for,
    solve,
    state,
    static_overlap,
    world,
)

from dem_warp.laws.conventions import ContactLaws
from dem_warp.materials import rayleigh_time
from dem_warp.model import ContactCoefficients, WorldSetup
from dem_warp.walls import Plane

SPEED = 0.1


def lever(contact: ContactCoefficients) -> float:
    """Distance from the centre of a resting ball to its contact: half the overlap above the plane [m]."""
    return RADIUS - 0.5 * static_overlap(contact, ball_mass() * GRAVITY)


def test_a_ball_sinks_in_by_the_static_overlap():
    contact = pair(restitution=0.2)
    bodies = grains([0.0, 0.0, RADIUS])
    solver = solve(world(bodies, contact, TIME_STEP, walls=(Plane(),), gravity=downhill(0.0)))
    run_for(solver, 0.2)
    end = state(solver)
    overlap = RADIUS - end["positions"][0, 2]
    # At rest the force is the weight; the damped oscillation has died out to rounding.
    assert overlap == pytest.approx(static_overlap(contact, ball_mass() * GRAVITY), rel=1e-9)
    assert np.abs(end["velocities"]).max() < 1e-12


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


@pytest.mark.parametrize("damped", [True, False])
def test_the_tangential_spring_swings_on_where_it_is_not_damped(damped):
    laws = ContactLaws(tangential_damping="tsuji" if damped else "none")
    contact = pair(restitution=0.9, friction=10.0, laws=laws)
    solver = solve(ball_on_plane(contact, velocity=(1e-3 * SPEED, 0.0, 0.0)))
    seen = record(solver, 4000)
    slip = seen.velocities[:, 0, 0] - lever(contact) * seen.spins[:, 0, 1]
    # The contact point swings on S_t with the mass 1 / (1/m + L^2/I), 2/7 m for a solid ball; the damping is
    # that of the contact, c = 2 sqrt(5/6) |beta| sqrt(S_t m).
    overlap = static_overlap(contact, ball_mass() * GRAVITY)
    stiffness = 8.0 * contact.shear_modulus * math.sqrt(RADIUS * overlap)
    inverse_mass = (1.0 + 2.5 * (lever(contact) / RADIUS) ** 2) / ball_mass()
    decay = 0.5 * damped * contact.damping * math.sqrt(stiffness * ball_mass()) * inverse_mass
    cycle = round(2.0 * math.pi / math.sqrt(stiffness * inverse_mass - decay**2) / TIME_STEP)
    first, last = (np.abs(part).max() for part in (slip[:cycle], slip[3 * cycle : 4 * cycle]))
    # A peak is read within half a step, (0.18 / 2)^2 / 2, and a cycle is taken as whole steps, 35 for 35.4.
    assert last / first == pytest.approx(math.exp(-3.0 * cycle * decay * TIME_STEP), rel=0.02)


def test_rolling_friction_stops_a_ball_where_the_law_says():
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
    overlap = static_overlap(contact, weight * math.cos(math.radians(slope)))
    stiffness = 8.0 * contact.shear_modulus * math.sqrt(RADIUS * overlap)
    assert late["positions"][0, 1] == pytest.approx(
        weight * math.sin(math.radians(slope)) / stiffness, rel=1e-6
    )


def test_a_ball_rolls_down_a_slope_above_the_rolling_angle():
    rolling = 0.05
    contact = pair(restitution=0.2, friction=0.8, rolling=rolling)
    slope = math.radians(10.0)
    solver = solve(ball_on_plane(contact, 10.0))
    solver.advance(20)
    elapsed = 20 * 256 * TIME_STEP
    drive = GRAVITY * (math.sin(slope) - rolling * math.cos(slope))
    # a = drive / (1 + 2/5) for a solid ball. The tangential spring swings at the start: 1e-3 of the final
    # speed.
    assert state(solver)["velocities"][0, 1] == pytest.approx(drive / 1.4 * elapsed, rel=2e-3)


def test_rolling_friction_stops_a_spin_and_never_reverses_it():
    rolling = 0.1
    contact = pair(restitution=0.2, friction=0.0, rolling=rolling)
    spin = 5.0
    solver = solve(ball_on_plane(contact, spin=(0.0, 0.0, spin)))
    # The law is directional but knows no axis: it brakes a twist as it brakes a roll.
    rate = rolling * ball_mass() * GRAVITY * lever(contact) / (0.4 * ball_mass() * RADIUS**2)
    steps = int(spin / rate / TIME_STEP)
    seen = record(solver, steps + 50).spins[:, 0, 2]
    # A constant torque: a straight line, whose slope wavers by the integration of the overlap.
    assert seen[steps // 2] == pytest.approx(spin - rate * (steps // 2) * TIME_STEP, rel=1e-6)
    assert (np.diff(seen) <= 0.0).all()
    assert (seen >= 0.0).all()
    assert (seen[-40:] == 0.0).all()


def test_rolling_friction_that_acts_for_whole_steps_turns_a_slow_spin_back_and_forth():
    rolling = 0.1
    contact = pair(restitution=0.2, friction=0.0, rolling=rolling)
    step = rolling * ball_mass() * GRAVITY * lever(contact) / (0.4 * ball_mass() * RADIUS**2) * TIME_STEP
    spin = 0.3 * step
    setup = replace(ball_on_plane(contact, spin=(0.0, 0.0, spin)), rolling_holds=False)
    seen = record(solve(setup), 20).spins[:, 0, 2]
    # To 0.3 - 1 and back, for ever; the torque wavers with the integration of the overlap, 1e-6.
    assert seen[0::2] == pytest.approx(spin, rel=1e-5)
    assert seen[1::2] == pytest.approx(spin - step, rel=1e-5)


def pyramid_on_slope(friction: float, slope: float) -> WorldSetup:
    """A nine-sphere grain on its three feet, at rest."""
    foot = -(PYRAMID.centers[:, 2] - PYRAMID.radii).min()
    contact = pair(restitution=0.2, friction=friction)
    bodies = grains([0.0, 0.0, foot])
    time_step = 0.25 * rayleigh_time(float(PYRAMID.radii.min()), GRAIN)
    return world(
        bodies, contact, time_step, walls=(Plane(),), gravity=downhill(slope), shapes=(PYRAMID,), skin=1e-3
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
