"""A world's bits depend on its setup alone; what goes wrong in one world is flagged there only."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import GRAIN, GRAVITY, RADIUS, assert_same_bits, grains, pair, solve, state, world

from dem_warp.materials import rayleigh_time
from dem_warp.model import WorldSetup
from dem_warp.types import WorldFlag
from dem_warp.walls import Cylinder, Plane

TIME_STEP = 0.25 * rayleigh_time(0.8 * RADIUS, GRAIN)
CHUNKS = 12


def heap(seed: int, count: int = 24, fraction: float = 1.0, friction: float = 0.4) -> WorldSetup:
    """Return balls that fall in a tube."""
    rng = np.random.default_rng(seed)
    columns = 1.2 * RADIUS * np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
    layers = np.arange(count)
    places = np.column_stack([columns[layers % 4], RADIUS * (1.2 + 2.3 * (layers // 4))])
    bodies = grains(
        places + rng.uniform(-0.05, 0.05, (count, 3)) * RADIUS,
        velocities=rng.normal(size=(count, 3)) * 0.1,
        sizes=rng.uniform(0.8, 1.1, count),
    )
    return world(
        bodies,
        pair(restitution=0.3, friction=friction, rolling=0.02),
        TIME_STEP * fraction,
        walls=(Plane(), Cylinder((0.0, 0.0, 0.0), 3.0 * RADIUS, 0.1)),
        gravity=(0.0, 0.0, -GRAVITY),
    )


def exploding() -> WorldSetup:
    bodies = grains([[0.0, 0.0, 0.02], [0.0, 0.0001, 0.0201]])
    return replace(heap(0), grains=bodies)


def run(*setups: WorldSetup, chunks: int = CHUNKS):
    solver = solve(*setups, precision="mixed")
    solver.advance(chunks)
    return solver


@pytest.fixture(scope="module")
def alone():
    """Return the final state of one heap that ran by itself."""
    solver = run(heap(1))
    assert solver.flags.numpy().tolist() == [0]
    return state(solver)


def test_other_worlds_of_a_batch_change_nothing(alone):
    others = [heap(2, count=31), heap(3, count=7, fraction=0.6), heap(4, friction=0.0)]
    for place in (1, 3):
        batch = [*others[:place], heap(1), *others[place:]]
        solver = run(*batch)
        assert_same_bits(state(solver, place), alone)
        assert not np.array_equal(state(solver, (place + 1) % 4)["positions"][:7], alone["positions"][:7])


def test_a_diverging_world_is_flagged_and_changes_nothing(alone):
    solver = run(exploding(), heap(1), exploding())
    flags = [WorldFlag(int(flag)) for flag in solver.flags.numpy()]
    assert WorldFlag.DIVERGED in flags[0]
    assert WorldFlag.DIVERGED in flags[2]
    assert flags[1] == WorldFlag(0)
    assert_same_bits(state(solver, 1), alone)


def test_an_overflowing_world_is_flagged_and_changes_nothing(alone):
    crowd = replace(heap(0), grains=grains(np.random.default_rng(0).normal(size=(24, 3)) * 1e-3))
    solver = solve(crowd, heap(1), precision="mixed", capacity=16)
    solver.advance(CHUNKS)
    assert WorldFlag.NEIGHBOUR_OVERFLOW in WorldFlag(int(solver.flags.numpy()[0]))
    assert solver.flags.numpy()[1] == 0
    assert_same_bits(state(solver, 1), alone)


def test_stopping_a_world_freezes_it_and_changes_no_other(alone):
    solver = solve(heap(2), heap(1), precision="mixed")
    solver.advance(4)
    frozen = state(solver, 0)
    solver.stop(0)
    solver.advance(CHUNKS - 4)
    assert_same_bits(state(solver, 0), frozen)
    assert_same_bits(state(solver, 1), alone)
    assert [view.step for view in solver.view([0, 1])] == [4 * 256, CHUNKS * 256]


def test_chunks_may_be_taken_in_any_parts(alone):
    solver = solve(heap(1), precision="mixed")
    for chunks in (1, 5, 2, 4):
        solver.advance(chunks)
    assert_same_bits(state(solver), alone)


def test_a_grain_that_leaves_the_domain_is_taken_out():
    bodies = grains(
        [[0.0, 0.0, 0.02], [0.05, 0.0, 0.02], [-0.05, 0.0, 0.02]],
        velocities=[[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [-0.01, 0.0, 0.0]],
    )
    domain = ((-0.06, -0.06, -0.06), (0.06, 0.06, 0.06))
    solver = run(world(bodies, pair(), TIME_STEP, domain=domain), chunks=16)
    assert solver.worlds[0].time_step * 16 * 256 * 0.5 > 0.01
    assert solver.view([0])[0].alive.tolist() == [True, False, True]
    assert state(solver)["slots"].tolist() == [0, 2]
    assert solver.flags.numpy()[0] == 0


def test_an_overview_is_of_the_living_grains_alone():
    solver = solve(heap(1), heap(2), precision="mixed")
    solver.advance(2)
    solver.remove(1, np.array([0, 3]))
    [second, first] = solver.view([1, 0])
    for view, living in ((second, len(second.alive) - 2), (first, len(first.alive))):
        speeds = np.linalg.norm(view.velocities[view.alive].astype(float), axis=1)
        assert len(speeds) == living
        # Speeds are summed in single precision.
        assert view.rms_speed == pytest.approx(np.sqrt(np.mean(speeds**2)), rel=1e-5)
        assert view.fastest == pytest.approx(speeds.max(), rel=1e-6)
        assert view.highest == view.positions[view.alive, 2].max()
    solver.remove(0, np.arange(len(first.alive)))
    [empty] = solver.view([0])
    assert (empty.rms_speed, empty.fastest, empty.highest) == (0.0, 0.0, -np.inf)


def test_a_removed_grain_touches_nothing_more():
    # One ball on another that stands on the plane; without it, the upper one falls through its place.
    bodies = grains([[0.0, 0.0, RADIUS], [0.0, 0.0, 3.0 * RADIUS]])
    setup = replace(heap(0), grains=bodies)
    solver = solve(setup, precision="mixed")
    solver.advance(2)
    assert state(solver)["positions"][1, 2] > 2.99 * RADIUS
    solver.remove(0, np.array([0]))
    solver.advance(CHUNKS)
    end = state(solver)
    assert end["slots"].tolist() == [1]
    # It fell to the plane: at most its radius and the height of a bounce, e^2 = 9 % of the fall, above it.
    assert end["positions"][0, 2] < 1.2 * RADIUS
