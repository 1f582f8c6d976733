"""A contact is worked out by one of its two grains for both; which of them it is changes nothing."""

from dataclasses import replace

import numpy as np
import pytest
from test_mechanisms_together import ALL
from worlds import PILE_STEP, PYRAMID, grains, pair, solve, state, world

from dem_warp.model import WorldSetup

UPRIGHT, DOWN = (0.0, 0.0, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0)
ORDERS = [0, 1], [1, 0]
HELD = 10**6
"""A release step that no test comes to."""


def tips_that_meet(order: list[int], mechanisms=(), release_steps=(0, 0)) -> WorldSetup:
    """Two unlike clumps, one upside down, that strike each other aside of their tips; a sphere of each."""
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
    """Final states with the one and with the other grain first, by grain."""
    found = []
    for order in ORDERS:
        solver = solve(tips_that_meet(order, **kind), precision=precision)
        solver.advance(3)
        assert solver.flags.numpy()[0] == 0
        found.append({name: array[order] for name, array in state(solver).items() if name != "slots"})
    return found


@pytest.mark.parametrize("precision", ["mixed", "double"])
@pytest.mark.parametrize("mechanisms", [(), ALL], ids=["base", "mechanisms"])
def test_the_order_of_two_grains_does_not_change_their_motion(precision, mechanisms):
    # What one grain feels is what the other feels with the signs turned, and signs do not round.
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
