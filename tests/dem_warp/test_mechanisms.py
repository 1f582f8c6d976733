"""Rules of all mechanisms: checks, combinations, rest, rebuilds and precision, in two compiled builds."""

import math
from dataclasses import replace

import numpy as np
import pytest
import worlds
from worlds import BALL, PYRAMID, RADIUS, Impact, ball_mass, ball_on_plane, pair, pile, run_for, solve, state

from dem_warp.laws.capillary import CapillaryBridge
from dem_warp.laws.contact_law import contact_law
from dem_warp.laws.elastic_plastic_rolling import ElasticPlasticRolling
from dem_warp.laws.hysteretic_spring import HystereticSpring
from dem_warp.laws.kinetic_friction import KineticFriction
from dem_warp.laws.linear_cohesion import LinearCohesion
from dem_warp.laws.mechanism import Mechanism
from dem_warp.laws.micro_slip import MicroSlip
from dem_warp.laws.rate_weakening import RateWeakening
from dem_warp.laws.twisting import Twisting
from dem_warp.model import WorldSetup
from dem_warp.walls import Plane

KINDS = (
    LinearCohesion,
    ElasticPlasticRolling,
    Twisting,
    RateWeakening,
    KineticFriction,
    HystereticSpring,
    MicroSlip,
    CapillaryBridge,
)
EVERY_LAW = (
    LinearCohesion(cohesion_energy_density=2e3),
    ElasticPlasticRolling(rolling_stiffness=2.25, rolling_damping=0.3),
    Twisting(twisting_radius=1.0),
    RateWeakening(weakening=0.2, weakening_speed=0.1),
    KineticFriction(friction_drop=0.2),
    HystereticSpring(plasticity=0.3),
    MicroSlip(micro_slip=1.0),
    CapillaryBridge(surface_tension=0.072, bridge_volume=8e-12),
)


def only(*laws: Mechanism) -> tuple[Mechanism, ...]:
    """Return these laws, and every other at its null, so that one build serves."""
    given = {type(law): law for law in laws}
    return tuple(given.get(kind, kind()) for kind in KINDS)


def rich_pile(skin: float = 1e-3, seed: int = 1) -> WorldSetup:
    """Return nine-sphere grains that fall and stick; their bridges reach 0.2 mm."""
    contact = pair(restitution=0.3, friction=0.5, rolling=0.1, mechanisms=EVERY_LAW)
    return replace(pile(seed, GRAINS, skin), contacts=(contact, contact))


FALL = 0.05
"""Time in which a pile falls and takes in most of its impacts [s]."""

GRAINS = 12


def test_a_pile_with_all_mechanisms_comes_to_rest_and_its_contacts_outlast_rebuilds_in_any_batch():
    solver = solve(rich_pile(), precision="mixed")
    run_for(solver, FALL)
    midst = state(solver)
    assert np.abs(midst["velocities"]).max() > 0.02
    often = solve(rich_pile(seed=2), rich_pile(skin=3e-4), precision="mixed")
    often.cycles.limit = 2
    run_for(often, FALL)
    assert often.rebuilds.numpy()[1] > 100
    worlds.assert_same_bits(state(often, 1), midst)
    run_for(solver, 0.2)
    assert not solver.flags.numpy().any()
    assert not often.flags.numpy().any()
    end = state(solver)
    assert len(end["slots"]) == GRAINS
    # Fixed-point positions let a resting grain tremble by a count, 1e-10 m, in some steps.
    assert np.abs(end["velocities"]).max() < 1e-5


def balls() -> dict[str, WorldSetup]:
    _, rolling, twisting, weakening, kinetic, spring, micro_slip, _ = EVERY_LAW
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
    # The way that the ball has rolled, and the speeds at which it spins, slides and comes back.
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
    # so of the changes that they make. Measured: 1e-5.
    np.testing.assert_allclose(ends["mixed"], ends["double"], rtol=3e-5)


def test_a_mechanism_between_grains_does_not_act_on_walls():
    cohesion = LinearCohesion(cohesion_energy_density=1.0, between="grains")
    assert cohesion.acts_between("grains")
    assert not cohesion.acts_between("walls")


@pytest.mark.parametrize(
    ("hook", "message"),
    [
        ("rolling", r"at most one may replace the rolling resistance, got \['a', 'b'\]"),
        ("slider", r"at most one may replace the tangential spring, got \['a', 'b'\]"),
    ],
)
def test_one_mechanism_at_most_replaces_a_part_of_the_law(hook, message):
    kinds = tuple(type(name, (LinearCohesion,), {"name": name, hook: lambda *_: 0.0}) for name in "ab")
    with pytest.raises(ValueError, match=message):
        contact_law(kinds)


def test_a_bridge_outlasts_the_touch_and_a_dent_does_not():
    water = CapillaryBridge(surface_tension=0.07, bridge_volume=2e-11)
    contact, speed = pair(mechanisms=only(water, HystereticSpring(plasticity=0.5))), 0.03
    step = Impact.of(contact, RADIUS, ball_mass(), speed).duration / 200.0
    ball = worlds.grains([0.0, 0.0, RADIUS], velocities=[0.0, 0.0, -speed])
    seen = worlds.record(
        solve(worlds.world(ball, contact, step, walls=(Plane(),), shapes=(BALL, PYRAMID))), 4000
    )
    overlap = RADIUS - seen.positions[:-1, 0, 2]
    # It comes off the plane, swings back in its bridge, and touches again.
    first_flight = np.flatnonzero(overlap <= 0.0)[1]
    back = first_flight + np.flatnonzero(overlap[first_flight:] > 0.0)[0]
    deepest = back + np.argmax(overlap[back : back + 200])
    assert -water.reach(RADIUS, contact.modulus) < overlap.min() < -1e-5
    assert 0.0 < overlap[deepest] < overlap[:first_flight].max()
    # The second touch starts on Hertz's curve, as if it were the first. Rounding of 1e-16 in kicks of 1e-2.
    force = ball_mass() * np.diff(seen.velocities[:, 0, 2])[back:deepest] / step
    pull = 4.0 * math.pi * RADIUS * water.surface_tension
    hertz = 4.0 / 3.0 * contact.modulus * math.sqrt(RADIUS) * overlap[back:deepest] ** 1.5
    np.testing.assert_allclose(force, hertz - pull, rtol=0.0, atol=1e-9 * pull)
