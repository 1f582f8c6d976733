"""Planes and cylinders: where a sphere rests on them, and how they carry it when they move."""

import math

import numpy as np
import pytest
from worlds import (
    GRAIN,
    GRAVITY,
    RADIUS,
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
from dem_warp.walls import Cylinder, Plane

TIME_STEP = 0.25 * rayleigh_time(RADIUS, GRAIN)
CONTACT = pair(restitution=0.1)
OVERLAP = static_overlap(CONTACT, ball_mass() * GRAVITY)
TUBE = Cylinder(point=(0.01, -0.01, 0.0), radius=0.03, length=0.05)
SLANT = math.sqrt(0.5)


def settle(wall, place, down, time=0.06):
    """Where a ball comes to rest on a wall that lies `down` from its place."""
    gravity = tuple(GRAVITY * np.asarray(down, dtype=float))
    solver = solve(world(grains(place), CONTACT, TIME_STEP, walls=(wall,), gravity=gravity))
    run_for(solver, time)
    end = state(solver)
    assert np.abs(end["velocities"]).max() < 1e-9
    return end["positions"][0]


@pytest.mark.parametrize(
    ("nearest", "outward"),
    [
        pytest.param((-0.03, 0.0, 0.02), (1.0, 0.0, 0.0), id="inside"),
        pytest.param((0.03, 0.0, 0.02), (1.0, 0.0, 0.0), id="outside"),
        pytest.param((0.0, -0.03, 0.0), (0.0, -1.0, 0.0), id="outside at the height of the lower rim"),
        pytest.param((0.03, 0.0, 0.05), (0.0, 0.0, 1.0), id="on the upper rim"),
        pytest.param((0.0, 0.03, 0.05), (0.0, SLANT, SLANT), id="outside the upper rim"),
        pytest.param((0.0, 0.03, 0.05), (0.0, -SLANT, SLANT), id="inside the upper rim"),
        pytest.param((-0.03, 0.0, 0.0), (0.0, 0.0, -1.0), id="below the lower rim"),
    ],
)
def test_a_ball_rests_on_every_side_of_a_tube(nearest, outward):
    # The nearest point of the tube and the direction from there to the ball give its place at rest: a radius
    # off, less the static overlap of a flat wall. On a convex side it balances, for a tenth of its time of
    # fall.
    foot = np.add(TUBE.point, nearest)
    end = settle(TUBE, foot + np.multiply(RADIUS, outward), np.negative(outward))
    overlap = RADIUS - np.linalg.norm(end - foot)
    assert overlap == pytest.approx(OVERLAP, rel=1e-6)
    np.testing.assert_allclose(end, foot + np.multiply(RADIUS - OVERLAP, outward), atol=1e-6 * OVERLAP)


def test_a_tube_may_lean():
    axis = np.array([0.0, 0.6, 0.8])
    tube = Cylinder(point=(0.0, 0.0, 0.0), radius=0.02, length=0.06, direction=(0.0, 3.0, 4.0))
    across = np.array([0.0, 0.8, -0.6])
    foot = 0.03 * axis + 0.02 * across
    end = settle(tube, foot - RADIUS * across, across)
    np.testing.assert_allclose(end, foot - (RADIUS - OVERLAP) * across, atol=1e-6 * OVERLAP)


def test_a_ball_passes_through_an_open_end():
    solver = solve(
        world(
            grains(np.add(TUBE.point, [0.0, 0.0, 0.07])),
            CONTACT,
            TIME_STEP,
            walls=(TUBE,),
            gravity=downhill(0.0),
        )
    )
    fall = math.ceil(0.15 / (256 * TIME_STEP))
    solver.advance(fall)
    n = fall * 256
    # Free fall of the scheme, to rounding: nothing touched.
    expected = 0.07 - GRAVITY * TIME_STEP**2 * n * (n + 1) / 2.0
    assert expected < -RADIUS
    np.testing.assert_allclose(
        state(solver)["positions"][0], np.add(TUBE.point, [0.0, 0.0, expected]), atol=1e-13
    )


def test_a_rising_plane_carries_a_ball_at_its_static_overlap():
    rise = 0.05
    setup = world(
        grains([0.0, 0.0, RADIUS - OVERLAP]), CONTACT, TIME_STEP, walls=(Plane(),), gravity=downhill(0.0)
    )
    solver = solve(setup)
    solver.advance(2)
    solver.move_wall(0, 0, (0.0, 0.0, rise))
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
        solver.move_wall(0, 0, (0.0, 0.0, velocity))
        solver.advance(chunks)
        height += chunks * chunk * velocity
    assert state(solver)["positions"][0, 2] == pytest.approx(height + RADIUS - OVERLAP, abs=1e-6 * OVERLAP)


def test_a_tube_moves_alone_among_worlds():
    def resting():
        return world(
            grains([0.0, 0.0, RADIUS - OVERLAP]),
            CONTACT,
            TIME_STEP,
            walls=(Plane(),),
            gravity=downhill(0.0),
        )

    solver = solve(resting(), resting())
    solver.move_wall(1, 0, (0.0, 0.0, 0.05))
    solver.advance(8)
    still, moved = (state(solver, w)["positions"][0, 2] for w in range(2))
    assert still == pytest.approx(RADIUS - OVERLAP, abs=1e-9 * OVERLAP)
    assert moved > RADIUS + 0.04 * 8 * 256 * TIME_STEP


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
    solver.move_wall(0, 0, (belt, 0.0, 0.0))
    run_for(solver, 0.08)
    # In the belt's frame a ball slides at first and rolls at 5/7 of its speed in the end: 2/7 in the
    # laboratory's, up to the overlap in the lever.
    arm = RADIUS - 0.5 * overlap
    expected = belt * (1.0 - 1.0 / (1.0 + 0.4 * (RADIUS / arm) ** 2))
    end = state(solver)
    assert end["velocities"][0, 0] == pytest.approx(expected, rel=1e-6)
    assert end["spins"][0, 1] * arm == pytest.approx(expected - belt, rel=1e-6)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Plane(normal=(0.0, 0.0, 0.0)), r"normal: must be .* non-zero length, got \(0.0, 0.0, 0.0\)"),
        (lambda: Plane(normal=(0.0, math.nan, 1.0)), "normal: must be a finite vector"),
        (lambda: Cylinder((0.0, 0.0, 0.0), -0.01, 0.1), r"radius: must be positive .* got -0.01"),
        (lambda: Cylinder((0.0, 0.0, 0.0), 0.01, math.inf), r"length: must be positive .* got inf"),
        (lambda: Cylinder((0.0, 0.0, 0.0), 0.01, 0.1, (0.0, 0.0, 0.0)), "direction: must be a finite vector"),
    ],
)
def test_a_wall_refuses_bad_geometry(build, message):
    with pytest.raises(ValueError, match=message):
        build()
