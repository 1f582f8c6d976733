"""Planes, plates, cylinders and cones: where a sphere rests on them, and how it bounces off."""

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
from dem_warp.walls import Cone, Cylinder, Disc, Plane

TIME_STEP = 0.25 * rayleigh_time(RADIUS, GRAIN)
CONTACT = pair(restitution=0.1)
OVERLAP = static_overlap(CONTACT, ball_mass() * GRAVITY)
TUBE = Cylinder(point=(0.01, -0.01, 0.0), radius=0.03, length=0.05)
PLATE = Disc(point=(0.01, -0.01, 0.0), normal=(0.0, 0.0, 2.0), radius=0.03, inner_radius=0.004)
FUNNEL = Cone(point=(0.01, -0.01, 0.0), radius=0.01, upper_radius=0.03, length=0.02)
SLANT = math.sqrt(0.5)


def settle(wall, place, down, time=0.06):
    """Resting place of a ball on a wall that lies `down` from it."""
    gravity = tuple(GRAVITY * np.asarray(down, dtype=float))
    solver = solve(world(grains(place), CONTACT, TIME_STEP, walls=(wall,), gravity=gravity))
    run_for(solver, time)
    end = state(solver)
    assert np.abs(end["velocities"]).max() < 1e-9
    return end["positions"][0]


@pytest.mark.parametrize(
    ("wall", "nearest", "outward"),
    [
        pytest.param(TUBE, (-0.03, 0.0, 0.02), (1.0, 0.0, 0.0), id="inside a tube"),
        pytest.param(TUBE, (0.03, 0.0, 0.02), (1.0, 0.0, 0.0), id="outside a tube"),
        pytest.param(TUBE, (0.0, -0.03, 0.0), (0.0, -1.0, 0.0), id="outside at the height of the lower rim"),
        pytest.param(TUBE, (0.03, 0.0, 0.05), (0.0, 0.0, 1.0), id="on the upper rim of a tube"),
        pytest.param(TUBE, (0.0, 0.03, 0.05), (0.0, SLANT, SLANT), id="outside the upper rim"),
        pytest.param(TUBE, (0.0, 0.03, 0.05), (0.0, -SLANT, SLANT), id="inside the upper rim"),
        pytest.param(TUBE, (-0.03, 0.0, 0.0), (0.0, 0.0, -1.0), id="below the lower rim"),
        pytest.param(PLATE, (0.0, 0.02, 0.0), (0.0, 0.0, 1.0), id="on a plate"),
        pytest.param(PLATE, (-0.02, 0.0, 0.0), (0.0, 0.0, -1.0), id="under a plate"),
        pytest.param(PLATE, (0.03, 0.0, 0.0), (1.0, 0.0, 0.0), id="outside a plate"),
        pytest.param(PLATE, (0.0, 0.03, 0.0), (0.0, SLANT, -SLANT), id="below the rim of a plate"),
        pytest.param(PLATE, (0.004, 0.0, 0.0), (-0.6, 0.0, 0.8), id="over the rim of a hole"),
        pytest.param(FUNNEL, (0.02, 0.0, 0.01), (-SLANT, 0.0, SLANT), id="inside a cone"),
        pytest.param(FUNNEL, (0.0, -0.02, 0.01), (0.0, -SLANT, -SLANT), id="outside a cone"),
        pytest.param(FUNNEL, (0.03, 0.0, 0.02), (SLANT, 0.0, SLANT), id="beyond the upper rim of a cone"),
        pytest.param(FUNNEL, (0.0, 0.03, 0.02), (0.0, 0.0, 1.0), id="on the upper rim of a cone"),
        pytest.param(FUNNEL, (-0.01, 0.0, 0.0), (0.0, 0.0, -1.0), id="below the lower rim of a cone"),
    ],
)
def test_a_ball_rests_on_every_side_of_a_wall(wall, nearest, outward):
    # The nearest point of the wall and the direction from there to the ball give its place at rest: a radius
    # off, less the static overlap of a flat wall. On a convex side it balances, for a tenth of its time of
    # fall.
    foot = np.add(wall.point, nearest)
    end = settle(wall, foot + np.multiply(RADIUS, outward), np.negative(outward))
    overlap = RADIUS - np.linalg.norm(end - foot)
    assert overlap == pytest.approx(OVERLAP, rel=1e-6)
    np.testing.assert_allclose(end, foot + np.multiply(RADIUS - OVERLAP, outward), atol=1e-6 * OVERLAP)


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


def test_a_ball_falls_through_the_hole_of_a_plate():
    plate = Disc((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), radius=0.03, inner_radius=1.01 * RADIUS)
    solver = solve(world(grains([0.0, 0.0, 0.01]), CONTACT, TIME_STEP, walls=(plate,), gravity=downhill(0.0)))
    fall = math.ceil(0.08 / (256 * TIME_STEP))
    solver.advance(fall)
    n = fall * 256
    expected = 0.01 - GRAVITY * TIME_STEP**2 * n * (n + 1) / 2.0
    assert expected < -RADIUS
    np.testing.assert_allclose(state(solver)["positions"][0], [0.0, 0.0, expected], atol=1e-13)


def test_the_wall_of_a_cone_carries_what_a_circling_ball_asks_for():
    # On a frictionless funnel of half angle a ball circles level at v^2 = g rho cot(a), rho the distance of
    # its centre from the axis, and the wall carries m g / sin(a).
    half_angle = math.radians(30.0)
    weight = ball_mass() * GRAVITY / math.sin(half_angle)
    overlap = static_overlap(pair(), weight)
    length = 0.05
    funnel = Cone((0.0, 0.0, 0.0), 0.0, length * math.tan(half_angle), length)
    foot = 0.04 * np.array([math.sin(half_angle), 0.0, math.cos(half_angle)])
    inward = np.array([-math.cos(half_angle), 0.0, math.sin(half_angle)])
    place = foot + (RADIUS - overlap) * inward
    speed = math.sqrt(GRAVITY * place[0] / math.tan(half_angle))
    ball = grains(place, velocities=[0.0, speed, 0.0])
    solver = solve(world(ball, pair(), TIME_STEP, walls=(funnel,), gravity=downhill(0.0)))
    run_for(solver, math.pi * place[0] / speed)
    end = state(solver)
    # Symplectic Euler keeps the orbit to first order of the time step: g dt over the speed, 1e-4 of it. The
    # overlap rings by as much of a centripetal push as one step is late.
    assert end["positions"][0, 0] < -0.8 * place[0]
    assert end["positions"][0, 2] == pytest.approx(place[2], rel=1e-3)
    assert np.linalg.norm(end["positions"][0, :2]) == pytest.approx(place[0], rel=1e-3)
    assert np.linalg.norm(end["velocities"][0]) == pytest.approx(speed, rel=1e-3)


@pytest.mark.parametrize(
    ("wall", "place", "velocity"),
    [
        pytest.param(PLATE, (0.04, -0.012, -0.012), (0.1, 0.02, 0.3), id="outer rim of a plate"),
        pytest.param(PLATE, (0.017, -0.01, 0.015), (0.0, 0.1, -0.3), id="hole of a plate"),
        pytest.param(FUNNEL, (0.03, -0.01, 0.03), (0.2, -0.1, -0.2), id="inside of a cone"),
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


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Plane(normal=(0.0, 0.0, 0.0)), r"normal: must be .* non-zero length, got \(0.0, 0.0, 0.0\)"),
        (lambda: Plane(normal=(0.0, math.nan, 1.0)), "normal: must be a finite vector"),
        (lambda: Cylinder((0.0, 0.0, 0.0), -0.01, 0.1), r"radius: must be positive .* got -0.01"),
        (lambda: Cylinder((0.0, 0.0, 0.0), 0.01, math.inf), r"length: must be positive .* got inf"),
        (lambda: Cylinder((0.0, 0.0, 0.0), 0.01, 0.1, (0.0, 0.0, 0.0)), "direction: must be a finite vector"),
        (lambda: Cylinder((0.0, math.inf, 0.0), 0.01, 0.1), "Cylinder.point: must be three finite numbers"),
        (
            lambda: Disc((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.01, 0.01),
            r"inner_radius: .* 0.01 \[m\], got 0.01",
        ),
        (lambda: Disc((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0), r"Disc.radius: must be positive .* got 0.0"),
        (lambda: Cone((0.0, 0.0, 0.0), 0.0, 0.0, 0.1), r"Cone.radius, upper_radius: must not both be 0"),
        (lambda: Cone((0.0, 0.0, 0.0), 0.1, 0.2, 0.0), r"Cone.length: must be positive .* got 0.0"),
    ],
)
def test_a_wall_refuses_bad_geometry(build, message):
    with pytest.raises(ValueError, match=message):
        build()
