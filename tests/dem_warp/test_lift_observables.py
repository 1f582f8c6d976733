"""What a lifted cylinder measures beside its heap: loads, the falling surface, where the mass lies."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from worlds import (
    GRAIN,
    GRAVITY,
    RADIUS,
    SMALL_TUBE,
    TIME_STEP,
    assert_measured_as_told,
    assert_same_bits,
    ball_mass,
    grains,
    pair,
    pile,
    run_for,
    small_case,
    solve,
    state,
    world,
)

from dem_warp import Case, CaseResult, simulate
from dem_warp.device import resolve_device
from dem_warp.solver import Solver, WorldView
from dem_warp.walls import Plane

WEIGHT = ball_mass() * GRAVITY
SLANT = math.sqrt(0.5)


def with_friction(friction: float, **options: Any) -> Case:
    """The small case, its scene with options and some friction on tube and plate."""
    case = small_case(scene=replace(SMALL_TUBE, **options))
    return replace(case, grain_wall=replace(case.grain_wall, static_friction=friction))


def simulated(case: Case) -> CaseResult:
    """Result of a case that finishes."""
    [result] = simulate([case], device="cpu", workers=1)
    assert (result.status, result.reason) == ("finished", "")
    return result


@pytest.fixture(scope="module")
def heap() -> CaseResult:
    """The small heap as it is."""
    return simulated(small_case())


def groove() -> Solver:
    """A ball at rest on two frictionless planes that fall towards each other at 45 degrees."""
    walls = Plane(normal=(SLANT, 0.0, SLANT)), Plane(normal=(-SLANT, 0.0, SLANT))
    place = [0.0, 0.0, RADIUS / SLANT]
    setup = world(grains(place), pair(restitution=0.1), TIME_STEP, walls=walls, gravity=(0.0, 0.0, -GRAVITY))
    solver = solve(setup)
    run_for(solver, 0.3)
    return solver


def test_each_side_of_a_groove_carries_its_part_of_a_ball():
    solver = groove()
    # At rest, so to the rounding of float64 over the difference of two speeds, 1e-16 of g a step.
    for wall, side in ((0, -1.0), (1, 1.0)):
        expected = WEIGHT * np.array([0.5 * side, 0.0, -0.5])
        np.testing.assert_allclose(solver.wall_loads(wall)[0], expected, rtol=0.0, atol=1e-8 * WEIGHT)


def test_weighing_changes_no_bit():
    weighed, left_alone = (solve(pile(), precision="mixed") for _ in range(2))
    for _ in range(8):
        for solver in (weighed, left_alone):
            solver.advance(8)
        weighed.wall_loads(0)
        weighed.wall_loads(1)
    assert_same_bits(state(weighed), state(left_alone))


def test_floor_and_tube_carry_what_is_poured_between_them():
    solver = solve(pile(), precision="mixed")
    run_for(solver, 0.6)
    weight = solver.worlds[0].masses.sum() * GRAVITY
    floor, tube = (solver.wall_loads(wall)[0] for wall in (0, 1))
    # The grains still tremble by some 2e-5 of g, the sum of what the boundaries do not balance.
    np.testing.assert_allclose(floor + tube, [0.0, 0.0, -weight], rtol=0.0, atol=1e-4 * weight)
    # What they carry apart is far more than that.
    assert np.abs(tube).max() > 0.01 * weight


def test_a_tube_without_friction_draws_no_grains_along(heap):
    # Its lower rim alone can push at grains, few of them at a time, and it passes them sideways.
    smooth = simulated(with_friction(0.0, plate_friction=0.4))
    assert abs(smooth.observables["wall_drag"]) < 0.05 * heap.observables["wall_drag"]


def test_a_tube_with_friction_carries_less_than_janssen_allows(heap):
    # Janssen's share of a column on which all friction is used up, and the walls bear the vertical stress.
    slenderness = heap.observables["fill_height"] / SMALL_TUBE.diameter
    x = 4.0 * small_case().grain_wall.static_friction * slenderness
    assert 0.01 < heap.observables["wall_drag"] < 1.0 + math.expm1(-x) / x


def test_a_heap_has_its_mass_where_its_grains_are(heap):
    masses = heap.sizes**3 / (heap.sizes**3).sum()
    # The simulator's masses are in float32.
    assert heap.observables["centre_height"] == pytest.approx(masses @ heap.positions[:, 2], rel=1e-6)
    beyond = np.hypot(*heap.positions.T[:2]) > SMALL_TUBE.diameter
    assert 0.0 < heap.observables["rolled_fraction"] == pytest.approx(masses[beyond].sum(), abs=1e-6)


def test_a_heap_has_every_observable_and_its_surface_falls_in_order(heap):
    assert_measured_as_told(small_case(), heap)
    seen = heap.observables
    assert 0.0 < seen["t75"] < seen["t55"] < seen["time_to_rest"]


def test_grains_that_all_leave_have_no_centre():
    case = with_friction(0.1, grain_count=1, tilt=2.0 * math.atan(0.1))
    result = simulated(case)
    assert_measured_as_told(case, result, absent=frozenset({"centre_height"}))
    assert result.observables["rolled_fraction"] == 1.0


def test_a_bed_that_stays_has_no_times_of_falling():
    case = small_case(scene=replace(SMALL_TUBE, grain_count=1))
    assert_measured_as_told(case, simulated(case), absent=frozenset({"t75", "t55"}))


def test_a_surface_that_falls_evenly_is_timed_between_two_looks():
    height, span = 0.8 * SMALL_TUBE.height, 0.3137
    case = small_case()
    [setup] = case.scene.prepare([case], resolve_device("cpu"))
    controller = case.scene.controller(case, setup, 256)
    # A layer in the tube, and grains outside that have no part in the surface.
    rng, count = np.random.default_rng(3), 60
    place = rng.uniform(-1.0, 1.0, (count, 2)) * SLANT * SMALL_TUBE.diameter / 2
    place[40:] += SMALL_TUBE.diameter
    alive, moving = np.ones(count, dtype=bool), np.ones((count, 3))
    masses = np.full(count, GRAIN.density * 1e-8)

    def look(step: int, level: float) -> None:
        heights = np.where(np.arange(count) < 40, level - 0.5 * case.grains.grain_reach, 0.0)
        time = step * setup.time_step
        positions = np.column_stack([place, heights])
        view = WorldView(step, time, alive, alive, positions, moving, masses, lambda wall: np.zeros(3))
        if step:
            controller.look(view)
        else:
            controller.course.observables |= {"fill_height": height, "grain_count": float(count)}
            controller.begin(view, alive)

    step = 0
    while "t55" not in controller.course.observables:
        look(step, height * (1.0 - step * setup.time_step / span))
        step += controller.period
    # Straight between two looks is exact for a straight fall.
    assert controller.course.observables["t75"] == pytest.approx(0.25 * span, rel=1e-9)
    assert controller.course.observables["t55"] == pytest.approx(0.45 * span, rel=1e-9)
