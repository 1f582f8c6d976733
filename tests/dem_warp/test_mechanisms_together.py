"""Several mechanisms in one case: precision, rebuilds, rest. All run in two compiled builds."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import (
    BALL,
    PYRAMID,
    assert_same_bits,
    ball_on_plane,
    pair,
    pile,
    run_for,
    solve,
    state,
)

from dem_warp.laws.elastic_plastic_rolling import ElasticPlasticRolling
from dem_warp.laws.hysteretic_spring import HystereticSpring
from dem_warp.laws.kinetic_friction import KineticFriction
from dem_warp.laws.linear_cohesion import LinearCohesion
from dem_warp.laws.mechanism import Mechanism
from dem_warp.laws.micro_slip import MicroSlip
from dem_warp.laws.rate_weakening import RateWeakening
from dem_warp.laws.twisting import Twisting
from dem_warp.model import WorldSetup
from dem_warp.snapshot import put_snapshot, take_snapshot

KINDS = (
    LinearCohesion,
    ElasticPlasticRolling,
    Twisting,
    RateWeakening,
    KineticFriction,
    HystereticSpring,
    MicroSlip,
)
ALL = (
    LinearCohesion(cohesion_energy_density=2e3),
    ElasticPlasticRolling(rolling_stiffness=2.25, rolling_damping=0.3),
    Twisting(twisting_radius=1.0),
    RateWeakening(weakening=0.2, weakening_speed=0.1),
    KineticFriction(friction_drop=0.2),
    HystereticSpring(plasticity=0.3),
    MicroSlip(micro_slip=1.0),
)


def only(*laws: Mechanism) -> tuple[Mechanism, ...]:
    """These laws, and every other at its null, so that one build serves."""
    given = {type(law): law for law in laws}
    return tuple(given.get(kind, kind()) for kind in KINDS)


def rich_pile(skin: float = 1e-3) -> WorldSetup:
    """A pile whose contacts have every mechanism of this file."""
    contact = pair(restitution=0.3, friction=0.5, rolling=0.1, mechanisms=ALL)
    return replace(pile(skin=skin), contacts=(contact, contact))


FALL = 0.1
"""The time in which a pile falls and takes in most of its impacts [s]."""


@pytest.fixture(scope="module", params=["mixed"])
def settled(request):
    """Precision, state in the midst of settling, and state at the end."""
    solver = solve(rich_pile(), precision=request.param)
    run_for(solver, FALL)
    midst = state(solver)
    run_for(solver, 0.25)
    assert solver.flags.numpy()[0] == 0
    return request.param, midst, state(solver)


def test_a_pile_with_all_of_them_comes_to_rest(settled):
    precision, midst, end = settled
    assert np.abs(midst["velocities"]).max() > 0.02
    # Fixed-point positions let a resting grain tremble by a count, 1e-10 m, in some steps.
    still = {"mixed": 1e-5, "double": 1e-9}[precision]
    assert len(end["slots"]) == 36
    assert np.abs(end["velocities"]).max() < still


def test_what_a_contact_remembers_goes_along_to_another_batch(settled):
    precision, midst, _ = settled
    larger = replace(rich_pile(), grains=pile(2, count=40).grains)
    first, second = solve(rich_pile(), precision=precision), solve(larger, rich_pile(), precision=precision)
    run_for(first, 0.5 * FALL)
    put_snapshot(second, 1, take_snapshot(first, 0))
    assert np.abs(second.neighbours.memory.numpy()).max() > 0.0
    run_for(second, FALL - first.view([0])[0].time)
    assert second.view([1])[0].step == first.view([0])[0].step + second.view([0])[0].step
    assert_same_bits(state(second, 1), midst)


def test_what_a_contact_remembers_survives_rebuilds(settled):
    precision, midst, _ = settled
    solver = solve(rich_pile(skin=3e-4), precision=precision)
    solver.cycle_limit = 2
    run_for(solver, FALL)
    assert solver.flags.numpy()[0] == 0
    assert solver.rebuilds.numpy()[0] > 500
    assert_same_bits(state(solver), midst)


def balls() -> dict[str, WorldSetup]:
    """A ball on a plane under each of the laws."""
    _, rolling, twisting, weakening, kinetic, spring, micro_slip = ALL
    never_turns = 1e3
    both = pair(0.2, 0.5, never_turns, mechanisms=only(weakening, kinetic))
    setups = {
        "rolling": ball_on_plane(pair(0.2, 0.8, 0.1, mechanisms=only(rolling)), 2.0),
        "twisting": ball_on_plane(pair(0.2, 0.5, mechanisms=only(twisting)), spin=(0.0, 0.0, 5.0)),
        "sliding": ball_on_plane(both, 20.0, velocity=(0.0, 0.1, 0.0)),
        "spring": ball_on_plane(pair(1.0, mechanisms=only(spring)), velocity=(0.0, 0.0, -0.1)),
        "micro-slip": ball_on_plane(pair(1.0, 0.5, mechanisms=only(micro_slip)), velocity=(0.0, 0.05, -0.1)),
    }
    return {name: replace(setup, shapes=(BALL, PYRAMID)) for name, setup in setups.items()}


def test_each_law_is_the_same_in_the_production_precision():
    # What each law decides: how far the ball has rolled, how fast it still spins, slides and comes back.
    decided = {
        "rolling": ("positions", 1),
        "twisting": ("spins", 2),
        "sliding": ("velocities", 1),
        "spring": ("velocities", 2),
        "micro-slip": ("velocities", 1),
    }
    ends = {}
    for precision in ("mixed", "double"):
        solver = solve(*balls().values(), precision=precision)
        solver.advance(2)
        ends[precision] = [state(solver, w)[what][0, i] for w, (what, i) in enumerate(decided.values())]
    assert list(balls()) == list(decided)
    # A position is wrong by half a count, 6e-11 m, of an overlap of 2e-6 m or more: 3e-5 of the forces, and
    # so of what they change. Measured: 1e-5.
    np.testing.assert_allclose(ends["mixed"], ends["double"], rtol=3e-5)
