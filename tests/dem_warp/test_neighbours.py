"""Neighbour lists: complete, in order, and without influence on the motion; and their entries."""

from dataclasses import replace

import numpy as np
import pytest
import worlds
from worlds import PILE_STEP, PILE_TUBE, PYRAMID, assert_same_bits, grains, pair, pile, run_for, solve, state

from dem_warp.entries import MAX_SPHERES_PER_GRAIN, max_partners, partner_bits
from dem_warp.solver import CHUNK, Solver
from dem_warp.types import WorldFlag
from dem_warp.walls import Plane

FALL = 0.1
"""Time in which a pile falls and most of it settles [s]."""

GRAINS = 16

SPHERES = PYRAMID.sphere_count


def listed(solver: Solver) -> list[tuple[int, int]]:
    """Return pairs (own sphere, partner) of a world's present list, in its order."""
    n, neighbours = solver.layout.grain_count, solver.neighbours
    counts = neighbours.count.numpy()[:n]
    entries = neighbours.entry.numpy().reshape(-1, neighbours.capacity)[:n]
    return [
        (g * SPHERES + (entry >> partner_bits(SPHERES)), entry % max_partners(SPHERES))
        for g in range(n)
        for entry in entries[g, : counts[g]].tolist()
    ]


def near(solver: Solver, skin: float, path: float | np.ndarray = 0.0) -> set[tuple[int, int]]:
    """Return the same pairs by brute force from the poses: spheres of later grains, then plane and tube.

    With paths that grains have come since, only those that were nearer than the skin before.
    """
    poses, sizes = state(solver), solver.worlds[0].grains.sizes
    centers, radii = worlds.spheres_of(PYRAMID, poses, sizes)
    owner = np.arange(len(radii)) // SPHERES
    gap = np.linalg.norm(centers[:, None] - centers[None], axis=2) - radii[:, None] - radii[None]
    path = np.broadcast_to(path, len(sizes))[owner]
    gap += path[:, None] + path[None]
    pairs = set(zip(*np.nonzero((gap < skin) & (owner[:, None] < owner[None])), strict=True))
    to_tube = np.abs(np.hypot(centers[:, 0], centers[:, 1]) - PILE_TUBE.radius)
    for number, distance in enumerate((centers[:, 2], to_tube)):
        pairs |= {(i, len(radii) + number) for i in np.flatnonzero(distance - radii + path < skin)}
    return {(int(i), int(j)) for i, j in pairs}


@pytest.fixture(scope="module")
def settled():
    solver = solve(pile(count=GRAINS), precision="mixed")
    run_for(solver, FALL)
    assert solver.flags.numpy()[0] == 0
    speeds = np.linalg.norm(state(solver)["velocities"], axis=1)
    assert np.median(speeds) < 0.01
    assert 3 < solver.rebuilds.numpy()[0] < FALL / PILE_STEP / 2
    return state(solver)


def test_the_lists_are_those_of_brute_force():
    for seed, precision in ((1, "double"), (2, "mixed")):
        rng = np.random.default_rng(seed)
        # A random cloud, dense enough that clumps overlap; no pair lies within rounding of the skin.
        bodies = grains(
            rng.uniform([-0.009, -0.009, 0.0], [0.009, 0.009, 0.018], (50, 3)),
            orientations=rng.normal(size=(50, 4)),
            sizes=rng.uniform(0.8, 1.2, 50),
        )
        setup = worlds.world(
            bodies,
            pair(),
            PILE_STEP,
            walls=(Plane(), PILE_TUBE),
            shapes=(PYRAMID,),
            skin=8e-4,
            speed_limit=50.0,
        )
        solver = solve(setup, precision=precision)
        found = listed(solver)
        assert solver.flags.numpy()[0] == 0
        assert len(found) > 600
        assert set(found) == near(solver, 8e-4)
        # In order of own sphere and partner, each once.
        assert found == sorted(set(found))


def test_the_skin_and_the_cycle_do_not_change_the_motion(settled):
    solver = solve(pile(count=GRAINS, skin=2e-3), precision="mixed")
    solver.cycles.limit = 8
    run_for(solver, FALL)
    assert solver.flags.numpy()[0] == 0
    assert_same_bits(state(solver), settled)


def test_contacts_keep_their_history_over_hundreds_of_rebuilds(settled):
    # The fall and the impacts use this skin up within a few cycles of two steps; it is never late.
    solver = solve(pile(count=GRAINS, skin=1e-4), precision="mixed")
    solver.cycles.limit = 2
    run_for(solver, FALL)
    assert not solver.flags.numpy()[0] & WorldFlag.LATE_REBUILD
    assert solver.rebuilds.numpy()[0] > 500
    assert_same_bits(state(solver), settled)


def test_grains_that_wait_high_above_are_in_no_list():
    # Sixty grains come down in a column of 0.1 m, so close that each has others about it when it is released.
    case = worlds.small_case(scene=replace(worlds.SMALL_TUBE, grain_count=60, rain_rate=300.0))
    [setup] = case.scene.prepare([case], "cpu")
    solver, left_out = Solver([setup], "cpu"), []
    owner = np.arange(60 * SPHERES) // SPHERES
    while solver.grains[0].step.numpy()[0] < setup.grains.release_steps.max():
        solver.advance(1)
        free = (setup.grains.release_steps <= solver.grains[0].step.numpy()[0])[owner]
        afar = (solver.neighbours.near.afar.numpy() > 0)[owner]
        assert not (afar & free).any()
        travel = solver.neighbours.travel.numpy().astype(float)
        travel[afar[::SPHERES]] = 0.0
        pairs = {(i, j) for i, j in near(solver, setup.skin, travel) if j < len(owner)}
        assert {(i, j) for i, j in pairs if free[i] or free[j]} <= set(listed(solver))
        left_out.append(afar.mean())
    assert max(left_out) > 0.5
    assert min(left_out) == 0.0
    assert solver.flags.numpy()[0] == 0


def test_a_grain_that_outruns_its_skin_is_flagged():
    # At 15 m/s a grain passes its skin of 0.1 mm within 2 steps: no cycle is short enough.
    bodies = grains([0.0, 0.0, 0.05], velocities=[15.0, 0.0, 0.0])
    setup = worlds.world(bodies, pair(), PILE_STEP, shapes=(PYRAMID,), skin=1e-4)
    solver = solve(setup, precision="mixed")
    solver.advance(1)
    assert solver.flags.numpy()[0] == WorldFlag.LATE_REBUILD


def test_lists_that_are_partly_rebuilt_miss_no_pair(settled):
    skin, chunks = 6e-4, 40
    solver = solve(pile(count=GRAINS, skin=skin), precision="mixed")
    moved = []
    for _ in range(chunks):
        solver.advance(1)
        travel = solver.neighbours.travel.numpy().astype(float)
        assert near(solver, skin, travel) <= set(listed(solver))
        moved.append(solver.neighbours.near.moves.numpy().mean())
    # many rebuilds were of some grains alone
    assert solver.rebuilds.numpy()[0] > 20
    assert sum(0.0 < part < 0.3 for part in moved) >= 5
    run_for(solver, FALL - chunks * CHUNK * PILE_STEP)
    assert solver.flags.numpy()[0] == 0
    assert_same_bits(state(solver), settled)


@pytest.mark.parametrize("spheres", [1, 2, 3, 9, 128, 129, MAX_SPHERES_PER_GRAIN])
def test_the_last_sphere_and_the_last_partner_come_back_from_an_entry(spheres: int) -> None:
    own, partner = spheres - 1, max_partners(spheres) - 1
    entry = own << partner_bits(spheres) | partner
    assert 0 <= entry < 2**31
    assert divmod(entry, max_partners(spheres)) == (own, partner)


def test_three_million_clumps_of_nine_fit_into_a_world() -> None:
    assert max_partners(9) > 9 * 3_000_000
