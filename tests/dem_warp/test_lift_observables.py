"""Other measurements of a lifted cylinder: loads, the falling surface, the place of the mass."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import worlds
from worlds import GRAVITY, SMALL_TUBE, assert_measured_as_declared, ball_mass, run_for, small_case, solve

from dem_warp import Case, CaseResult, simulate
from dem_warp.device import resolve_device
from dem_warp.model import WorldSetup
from dem_warp.view import WorldView, overviews
from dem_warp.walls import Plane

WEIGHT = ball_mass() * GRAVITY
SLANT = math.sqrt(0.5)


def with_friction(friction: float, **options: Any) -> Case:
    """Return the small case, its scene with options and some friction on tube and plate."""
    case = small_case(scene=replace(SMALL_TUBE, **options))
    return replace(case, grain_wall=replace(case.grain_wall, static_friction=friction))


def simulated(case: Case) -> CaseResult:
    [result] = simulate([case], device="cpu", workers=1)
    assert (result.status, result.reason) == ("finished", "")
    return result


def loads(setup: WorldSetup, settled: float, precision: str = "mixed") -> np.ndarray:
    """Return the mean force on each wall [N] over 0.05 s, once a world has settled for a time [s]."""
    solver = solve(replace(setup, weighed=(0, 1)), precision=precision)
    run_for(solver, settled)
    [before] = solver.view([0])
    run_for(solver, 0.05)
    [after] = solver.view([0])
    return (after.impulses - before.impulses) / (after.time - before.time)


def test_each_side_of_a_groove_carries_half_of_a_ball():
    walls = Plane(normal=(SLANT, 0.0, SLANT)), Plane(normal=(-SLANT, 0.0, SLANT))
    place = [0.0, 0.0, worlds.RADIUS / SLANT]
    groove = worlds.world(
        worlds.grains(place),
        worlds.pair(restitution=0.1),
        worlds.TIME_STEP,
        walls=walls,
        gravity=(0.0, 0.0, -GRAVITY),
    )
    # At rest; a count is 2**-29 of the weight at the most, and rounds a force of that order.
    pushed = -0.5 * WEIGHT * np.array([[1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]])
    assert loads(groove, 0.3, "double") == pytest.approx(pushed, rel=1e-8, abs=1e-8 * WEIGHT)


def test_floor_and_tube_carry_the_grains_between_them():
    bed = worlds.pile(count=16)
    weight = bed.masses.sum() * GRAVITY
    floor, tube = loads(bed, 0.4)
    # The grains still tremble by some 2e-5 of g, the sum of what the boundaries do not balance.
    assert floor + tube == pytest.approx([0.0, 0.0, -weight], rel=1e-4, abs=1e-4 * weight)
    # Each of them carries far more than that.
    assert abs(tube[2]) > 0.01 * weight


@pytest.mark.parametrize("precision", ["double", "mixed"])
def test_an_impact_gives_the_floor_the_momentum_of_the_ball(precision):
    fall = worlds.grains([0.0, 0.0, 1.2 * worlds.RADIUS], velocities=(0.3, 0.0, -1.0))
    setup = worlds.world(fall, worlds.pair(restitution=0.4, friction=0.3), worlds.TIME_STEP, walls=(Plane(),))
    solver = solve(setup, precision=precision)
    run_for(solver, 0.01)
    [after] = solver.view([0])
    lost = ball_mass() * (fall.velocities[0] - after.velocities[0].astype(float))
    assert lost[2] < -ball_mass() < 0.0 < lost[0]
    # Both sum the same forces: in double to its rounding; in mixed a speed is rounded by 6e-8 in every step,
    # which adds up at random to less than 1e-5 in the thousand steps of the contact.
    error = {"double": 1e-8, "mixed": 1e-5}[precision]
    assert after.impulses[0] == pytest.approx(lost, rel=error, abs=error * ball_mass())


def test_a_world_without_a_weighed_wall_has_the_same_bits():
    weighed, not_weighed = (
        solve(replace(worlds.pile(), weighed=walls), precision="mixed") for walls in ((0, 1), ())
    )
    for solver in (weighed, not_weighed):
        solver.advance(8)
    assert weighed.impulses()[0, 0, 2] < 0.0
    assert not_weighed.impulses().shape == (1, 0, 3)
    worlds.assert_same_bits(worlds.state(weighed), worlds.state(not_weighed))


def test_a_tube_without_friction_draws_no_grains_along(heap):
    # Its lower rim alone can push at grains, few of them at a time, and it passes them sideways.
    smooth = simulated(with_friction(0.0, plate_friction=0.4))
    assert abs(smooth.observables["wall_drag"]) < 0.05 * heap.observables["wall_drag"]


def test_a_tube_with_friction_carries_less_than_janssen_allows(heap):
    # Janssen's share of a column on which all friction is used up, and the walls bear the vertical stress.
    slenderness = heap.observables["fill_height"] / SMALL_TUBE.diameter
    x = 4.0 * small_case().grain_wall.static_friction * slenderness
    assert 0.01 < heap.observables["wall_drag"] < 1.0 + math.expm1(-x) / x


def test_the_mass_of_a_heap_is_that_of_its_grains(heap):
    masses = heap.sizes**3 / (heap.sizes**3).sum()
    # The simulator's masses are in float32.
    assert heap.observables["centre_height"] == pytest.approx(masses @ heap.positions[:, 2], rel=1e-6)
    beyond = np.hypot(*heap.positions.T[:2]) > SMALL_TUBE.diameter
    assert 0.0 < heap.observables["rolled_fraction"] == pytest.approx(masses[beyond].sum(), abs=1e-6)


def test_a_heap_has_every_observable_and_its_surface_falls_in_order(heap):
    assert_measured_as_declared(small_case(), heap)
    seen = heap.observables
    assert 0.0 < seen["t75"] < seen["t55"] < seen["time_to_rest"]


def test_grains_that_all_leave_are_no_heap_and_have_no_centre():
    case = with_friction(0.1, grain_count=1, tilt=2.0 * math.atan(0.1))
    [result] = simulate([case], device="cpu", workers=1)
    assert result.status == "failed"
    assert "no grain is left on the plate" in result.reason
    assert_measured_as_declared(case, result, absent=frozenset({"centre_height"}))
    assert result.observables["rolled_fraction"] == 1.0


def test_a_bed_that_stays_has_no_times_of_falling():
    case = small_case(scene=replace(SMALL_TUBE, grain_count=1))
    assert_measured_as_declared(case, simulated(case), absent=frozenset({"t75", "t55"}))


FALL_TIME = 0.3137
"""Time in which the layer of `fallen` would come down to the plate [s]."""


def fallen(given: Callable[[float], float]) -> dict[str, float]:
    """Observe a layer that falls evenly in the tube until it is below 55 %.

    `given` is its impulse on the tube until a time [weight s]; grains outside have no part in it.
    """
    height, case = 0.8 * SMALL_TUBE.height, small_case()
    [setup] = case.scene.prepare([case], resolve_device("cpu"))
    controller = case.scene.controller(case, setup, 256)
    rng, count = np.random.default_rng(3), 60
    place = rng.uniform(-1.0, 1.0, (count, 2)) * SLANT * SMALL_TUBE.diameter / 2
    place[40:] += SMALL_TUBE.diameter
    alive, moving = np.ones(count, dtype=bool), np.ones((count, 3))
    masses = np.full(count, worlds.GRAIN.density * 1e-8)

    def view(step: int) -> WorldView:
        time = step * setup.time_step
        level = height * (1.0 - time / FALL_TIME) - 0.5 * case.grains.grain_reach
        positions = np.column_stack([place, np.where(np.arange(count) < 40, level, 0.0)])
        impulses = np.array([[0.0, 0.0, -float(masses.sum()) * GRAVITY * given(time)]])
        overview = [each.item() for each in overviews(positions[None], moving[None], alive[None])]
        return WorldView(step, time, alive, alive, positions, moving, masses, impulses, *overview)

    seen, step = controller.state.observables, 0
    seen |= {"fill_height": height, "grain_count": float(count)}
    controller.begin(view(0), alive)
    while "t55" not in seen:
        step += controller.period
        controller.look(view(step))
    return seen


def test_a_surface_that_falls_evenly_is_timed_between_two_looks():
    seen = fallen(lambda time: 0.0)
    # Straight between two looks is exact for a straight fall.
    assert seen["t75"] == pytest.approx(0.25 * FALL_TIME, rel=1e-9)
    assert seen["t55"] == pytest.approx(0.45 * FALL_TIME, rel=1e-9)


def test_a_load_that_swings_between_two_looks_counts_by_its_mean():
    swing = 2.0 * math.pi * 500.0  # several times within a look
    seen = fallen(lambda time: 7.0 + 0.3 * time + 0.3 * (1.0 - math.cos(swing * time)) / swing)
    # The part of a swing that the last two looks cut off, over the time to t75.
    assert seen["wall_drag"] == pytest.approx(0.3, abs=0.3 * 2.0 / swing / (0.25 * FALL_TIME))
