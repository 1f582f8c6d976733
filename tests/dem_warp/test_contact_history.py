"""A contact keeps its tangential spring: over rebuilds of its list, and over changes of a wall's motion."""

import numpy as np
import pytest
from worlds import GRAIN, GRAVITY, RADIUS, grains, pair, solve, world

from dem_warp.entries import max_partners
from dem_warp.kernels.stale import ALL
from dem_warp.materials import rayleigh_time
from dem_warp.solver import Solver
from dem_warp.walls import Motion, Plane

SPEED = 1e-4
"""Speed of the belt [m/s]: so slow that the contacts stick."""

BELT, STEPS = 0, 256


def column() -> Solver:
    """A ball on a ball on a belt, in the overlaps of their impact, the belt about to move."""
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
    """Write the neighbour lists anew."""
    solver.stale.fill_(ALL)
    solver._rebuild(0)


def springs(solver: Solver) -> dict[tuple[int, int], np.ndarray]:
    """Tangential displacement [m] and stamp of every contact that has touched, by grain and partner."""
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
    """The motion without any rebuild."""
    return take_steps(column(), STEPS)


@pytest.mark.parametrize("every", [2, 32])
def test_forces_are_the_same_with_rebuilds_and_without(undisturbed, every):
    assert np.abs(np.diff(undisturbed[:, :, 0], axis=0)).max() > 0.0
    np.testing.assert_array_equal(take_steps(column(), STEPS, every), undisturbed)


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
    # Two steps carry it on by no more than the surfaces' way; begun anew, that would be all that there is.
    surface_speed = SPEED + motion[:, 0].max() + RADIUS * motion[:, 4].max()
    way = 2.0 * surface_speed * solver.worlds[0].time_step
    take_steps(solver, 2)
    after, was = springs(solver)[0, 2][0], before[0, 2][0]
    assert 0.0 < abs(after - was) < way < 0.2 * abs(was)


def test_a_spring_that_were_lost_would_be_felt(undisturbed):
    solver = column()
    take_steps(solver, 64)
    solver.neighbours.history.zero_()
    assert not np.array_equal(take_steps(solver, 64), undisturbed[64:128])
