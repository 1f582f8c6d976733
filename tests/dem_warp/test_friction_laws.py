"""Kinetic friction and friction that weakens with speed, against closed forms.

Their block is a ball on a slope whose rolling resistance never lets it turn.
"""

import math

import numpy as np
import pytest
from worlds import GRAVITY, TIME_STEP, ball_on_plane, downhill, pair, record, run_for, solve, state

from dem_warp.laws.kinetic_friction import KineticFriction
from dem_warp.laws.mechanism import Mechanism
from dem_warp.laws.rate_weakening import RateWeakening
from dem_warp.model import WorldSetup
from dem_warp.solver import CHUNK, Solver

FRICTION = 0.5
NEVER_TURNS = 1e3


def block(law: Mechanism, incline: float, speed: float = 0.0, friction: float = FRICTION) -> WorldSetup:
    """A block on a slope of an incline, the tangent of its angle, with a speed downhill [m/s].

    It is damped so that the weight, which comes at once, swings it only 0.5 % over the spring's rest.
    """
    contact = pair(restitution=1e-4, friction=friction, rolling=NEVER_TURNS, mechanisms=(law,))
    return ball_on_plane(contact, math.degrees(math.atan(incline)), velocity=(0.0, speed, 0.0))


def downhill_pull(incline: float, friction: float) -> float:
    """Acceleration g (sin - mu cos) [m/s2] of a block that slides down."""
    return GRAVITY * (incline - friction) / math.hypot(1.0, incline)


def gain(solver: Solver, incline: float, chunks: int) -> float:
    """Tilts the slope to an incline; change of the speed [m/s] after a chunk, in as many chunks."""
    setup = solver.model.world.numpy()
    setup["gravity"] = downhill(math.degrees(math.atan(incline)))
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


def test_a_block_that_has_stopped_is_held_by_static_friction():
    # Thrown uphill it stops, and stays: the incline is above the kinetic coefficient and below the static.
    speed, incline, kinetic = 0.2, 0.3, 0.2
    law = KineticFriction(friction_drop=1.0 - kinetic / FRICTION)
    solver = solve(block(law, incline, -speed), block(KineticFriction(), incline, -speed, friction=kinetic))
    run_for(solver, 0.1)
    held, slides_back = (state(solver, w) for w in range(2))
    path = 0.5 * speed**2 / downhill_pull(incline, -kinetic)
    # One step is braked by static friction, until the spring is wound up: 0.1 % of the speed. In the end the
    # spring swings back.
    assert held["positions"][0, 1] == pytest.approx(-path, rel=3e-3)
    assert np.abs(held["velocities"]).max() < 1e-12
    assert slides_back["velocities"][0, 1] > 0.04


def test_friction_that_weakens_follows_the_closed_form_on_either_side_of_the_critical_speed():
    weakening, weakening_speed, incline = 0.6, 0.1, 0.35
    law = RateWeakening(weakening=weakening, weakening_speed=weakening_speed)
    # mu(v) = tan(slope): slower blocks stop, faster ones run away.
    strong, weak = FRICTION * weakening, FRICTION * (1.0 - weakening)
    critical = -weakening_speed * math.log((incline - weak) / strong)
    speeds = critical * np.array([0.5, 1.0, 2.0])
    steps = 1000
    seen = record(solve(*(block(law, incline, speed) for speed in speeds)), steps).velocities[:, :, 1]
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
