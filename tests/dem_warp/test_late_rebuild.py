"""Neighbour lists that a grain outruns: its world takes the steps again, or ends with the reason."""

from dataclasses import replace
from itertools import pairwise

import pytest
from worlds import PYRAMID, SMALL_TUBE, assert_same_result, run_batch, small_case

from dem_warp import Case, batch, cycles, simulate, solver
from dem_warp.rollback import Rollback
from dem_warp.scenes.walled_scene import default_skin
from dem_warp.types import CheckRate

FEW = replace(SMALL_TUBE, grain_count=24)
"""Three layers, in which grains outrun their lists in the rain and at the lift, two dozen times."""


def few(seed: int = 1, **numerics: float) -> Case:
    return small_case(seed, FEW, **numerics)


@pytest.fixture(scope="module")
def heap():
    """Simulate a heap with a skin that no grain outruns."""
    return simulate([few()], device="cpu", workers=1)[0]


@pytest.fixture
def restored(monkeypatch):
    worlds, restore = [], Rollback.restore

    def note(self, world):
        worlds.append(world)
        restore(self, world)

    monkeypatch.setattr(batch.Rollback, "restore", note)
    return worlds


def test_steps_are_taken_again_with_a_closer_look_first(heap, monkeypatch):
    # Looks at every other step see two stretches of this thin skin too late as well (measured).
    cares, advance = [], solver.Solver.advance

    def note(self, chunks):
        cares.append(self.check_rate)
        advance(self, chunks)

    monkeypatch.setattr(solver.Solver, "advance", note)
    [result] = simulate([few(skin=2e-4)], device="cpu", workers=1)
    assert_same_result(result, heap)
    assert set(cares) == set(CheckRate)
    assert all(now <= before + 1 for before, now in pairwise(cares))


def test_a_world_that_is_taken_back_changes_no_other(heap, restored, monkeypatch):
    # Cycles as long as the fastest grain takes for four skins: falling grains outrun their lists, less often
    # with the wider skin, whose world goes on while the other takes its steps again.
    monkeypatch.setattr(cycles, "SKIN_PER_SERIAL_CYCLE", 4.0)
    cases = [few(), few(seed=2, skin=2.5e-3)]
    results = run_batch(cases)
    assert restored.count(0) > restored.count(1)
    assert_same_result(results[0], heap)
    assert_same_result(results[1], simulate(cases[1:], device="cpu", workers=1)[0])


def test_a_skin_that_is_too_thin_ends_with_its_reason():
    # 0.5 m/s times two steps of some microseconds is more than the grains may come.
    [result] = simulate([few(skin=1e-6)], device="cpu", workers=1)
    assert result.status == "failed"
    assert "too fast for the neighbour lists" in result.reason
    assert "raise numerics.skin" in result.reason


def test_a_long_fall_with_long_steps_has_the_skin_that_it_needs():
    # 0.2 m, and so soft that two steps of two falling grains are longer than a sphere's radius.
    fall = few(modulus_scale=1600.0)
    fall = replace(fall, scene=replace(FEW, height=0.2, lift_speed=1.0))
    radius, path = float(PYRAMID.radii.mean()), 4.0 * fall.scene.top_speed * fall.time_step
    assert radius < path < default_skin(fall) < 3.0 * radius
    assert simulate([fall], device="cpu", workers=1)[0].status == "finished"
    thin = replace(fall, numerics=replace(fall.numerics, skin=radius))
    assert "raise numerics.skin" in simulate([thin], device="cpu", workers=1)[0].reason
