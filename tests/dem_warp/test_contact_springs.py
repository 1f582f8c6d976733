"""Contacts keep their springs over rebuilds, and act alike on either grain, whichever works them out."""

from dataclasses import replace

import numpy as np
import pytest
from test_mechanisms import EVERY_LAW
from worlds import GRAIN, GRAVITY, PILE_STEP, PYRAMID, RADIUS, grains, pair, solve, state, world

from dem_warp.entries import max_partners
from dem_warp.kernels.stale import ALL
from dem_warp.materials import rayleigh_time
from dem_warp.model import WorldSetup
from dem_warp.solver import Solver
from dem_warp.walls import Motion, Plane

SPEED = 1e-4
"""Speed of the belt [m/s]: so slow that the contacts stick."""

BELT, STEPS = 0, 256


def column() -> Solver:
    """Return a ball on a ball on a belt, in the overlaps of their impact, the belt about to move."""
    overlap = 5e-6
    bodies = grains([[0.0, 0.0, RADIUS - overlap], [0.0, 0.0, 3.0 * RADIUS - 2.0 * overlap]])
    solver = solve(
        world(
            bodies,
            pair(restitution=0.4, friction=0.6, rolling=0.01),
            0.05 * rayleigh_time(RADIUS, GRAIN),
            walls=(Plane(),),
            gravity=(0.0, 0.0, -GRAVITY),
        ),
        precision="mixed",
    )
    solver.move_wall(0, BELT, Motion((SPEED, 0.0, 0.0)))
    return solver


def take_steps(solver: Solver, count: int, rebuild_every: int = 0) -> np.ndarray:
    """Take an even number of steps; velocity and spin of both balls after each, (count, 2, 6)."""
    seen = []
    for step in range(count):
        solver._cycle(1, step % 2)
        after = solver.grains[1 - step % 2]
        seen.append(np.column_stack([after.velocity.numpy()[:, :3], after.spin.numpy()[:, :3]]))
        if rebuild_every and (step + 1) % rebuild_every == 0:
            rebuild(solver)
    return np.array(seen)


def rebuild(solver: Solver) -> None:
    solver.stale.fill_(ALL)
    solver._rebuild(0)


def springs(solver: Solver) -> dict[tuple[int, int], np.ndarray]:
    """Return the displacement [m] and stamp of every contact that has touched, by grain and partner."""
    neighbours = solver.neighbours
    counts = neighbours.count.numpy()
    entries = neighbours.entry.numpy().reshape(-1, neighbours.capacity)
    histories = neighbours.history.numpy().reshape(-1, neighbours.capacity, 4)
    return {
        (g, int(entries[g, k]) % max_partners(solver.layout.sphere_count)): histories[g, k].copy()
        for g in range(2)
        for k in range(counts[g])
        if histories[g, k, :3].any()
    }


def assert_same_springs(a: dict[tuple[int, int], np.ndarray], b: dict[tuple[int, int], np.ndarray]) -> None:
    assert a.keys() == b.keys()
    for contact, spring in a.items():
        np.testing.assert_array_equal(spring, b[contact], err_msg=str(contact))


@pytest.fixture(scope="module")
def undisturbed() -> np.ndarray:
    return take_steps(column(), STEPS)


def test_forces_are_the_same_with_rebuilds_and_without(undisturbed):
    assert np.abs(np.diff(undisturbed[:, :, 0], axis=0)).max() > 0.0
    np.testing.assert_array_equal(take_steps(column(), STEPS, rebuild_every=2), undisturbed)


def test_a_rebuild_leaves_every_spring_as_it_is():
    solver = column()
    take_steps(solver, 64)
    before = springs(solver)
    # The lower ball, which is the first, with the upper one and with the belt.
    assert sorted(before) == [(0, 1), (0, 2)]
    rebuild(solver)
    assert_same_springs(springs(solver), before)
    rebuild(solver)
    assert_same_springs(springs(solver), before)


def test_a_belt_that_changes_its_speed_keeps_the_springs():
    solver = column()
    motion = np.abs(take_steps(solver, 64)[:, 0])
    before = springs(solver)
    solver.move_wall(0, BELT, Motion((-SPEED, 0.0, 0.0)))
    assert_same_springs(springs(solver), before)
    # Two steps add no more than the surfaces' way; a new spring would have nothing else.
    surface_speed = SPEED + motion[:, 0].max() + RADIUS * motion[:, 4].max()
    way = 2.0 * surface_speed * solver.worlds[0].time_step
    take_steps(solver, 2)
    after, was = springs(solver)[0, 2][0], before[0, 2][0]
    assert 0.0 < abs(after - was) < way < 0.2 * abs(was)


UPRIGHT, DOWN = (0.0, 0.0, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0)
ORDERS = [0, 1], [1, 0]
HELD = 10**6
"""Release step after the end of every test."""


def tips_that_meet(order: list[int], mechanisms=(), release_steps=(0, 0)) -> WorldSetup:
    """Return two unlike clumps, one upside down, that touch with one sphere each, off their tips."""
    bodies = grains(
        np.array([[0.0, 0.0, 0.0], [3e-4, 2e-4, 6.9e-3]])[order],
        orientations=np.array([UPRIGHT, DOWN])[order],
        velocities=np.array([[0.0, 0.0, 0.0], [0.05, -0.02, -0.3]])[order],
        spins=np.array([[0.0, 0.0, 0.0], [20.0, 10.0, -60.0]])[order],
        sizes=np.array([1.0, 0.85])[order],
    )
    bodies = replace(bodies, release_steps=np.array(release_steps)[order])
    contact = pair(restitution=0.5, friction=0.3, rolling=0.1, mechanisms=mechanisms)
    return world(bodies, contact, PILE_STEP, shapes=(PYRAMID,), skin=1e-3)


def ends(precision: str, **kind) -> list[dict[str, np.ndarray]]:
    """Return final states with either grain first, by grain."""
    found = []
    for order in ORDERS:
        solver = solve(tips_that_meet(order, **kind), precision=precision)
        solver.advance(3)
        assert solver.flags.numpy()[0] == 0
        found.append({name: array[order] for name, array in state(solver).items() if name != "slots"})
    return found


@pytest.mark.parametrize(
    ("precision", "mechanisms"), [("double", ()), ("mixed", EVERY_LAW)], ids=["base", "mechanisms"]
)
def test_the_order_of_two_grains_does_not_change_their_motion(precision, mechanisms):
    # The forces on both grains differ by their signs alone, and signs do not round.
    first, second = ends(precision, mechanisms=mechanisms)
    assert first["velocities"][0, 2] < -0.05
    assert np.abs(first["spins"][0]).min() > 0.1
    for name, array in first.items():
        np.testing.assert_array_equal(array, second[name], err_msg=name)


def test_a_grain_that_has_yet_to_be_released_is_in_the_way_of_others():
    # The clump that waits feels nothing; the other one bounces off it, whichever is the first.
    first, second = ends("mixed", release_steps=(HELD, 0))
    assert first["velocities"][1, 2] > 0.05
    assert not first["velocities"][0].any()
    assert not first["spins"][0].any()
    for name, array in first.items():
        np.testing.assert_array_equal(array, second[name], err_msg=name)
