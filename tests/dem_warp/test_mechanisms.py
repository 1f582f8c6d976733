"""Rules that hold for every mechanism: its null, its checks, how several stand together."""

import math

import numpy as np
import pytest
from worlds import (
    RADIUS,
    Impact,
    ball_mass,
    grains,
    oblique_impact,
    pair,
    pile,
    record,
    solve,
    world,
)

from dem_warp.laws.capillary import CapillaryBridge
from dem_warp.laws.contact_law import contact_law
from dem_warp.laws.hysteretic_spring import HystereticSpring
from dem_warp.laws.jkr import JKR
from dem_warp.laws.linear_cohesion import LinearCohesion
from dem_warp.laws.mechanism import Mechanism
from dem_warp.model import WorldSetup
from dem_warp.walls import Plane


def with_mechanism(setup: WorldSetup, *mechanisms: Mechanism) -> WorldSetup:
    """The same world whose contacts have mechanisms."""
    contact = pair(restitution=0.5, friction=0.3, rolling=0.05, mechanisms=mechanisms)
    return world(
        setup.grains,
        contact,
        setup.time_step,
        walls=[wall for wall, _ in setup.walls],
        shapes=setup.shapes,
        gravity=setup.gravity,
        skin=setup.skin,
    )


def test_mechanisms_stand_in_the_order_of_the_library():
    setup = with_mechanism(pile(count=4), LinearCohesion(cohesion_energy_density=1.0))
    assert setup.mechanisms == (LinearCohesion,)


def test_a_mechanism_between_grains_is_none_of_the_walls():
    cohesion = LinearCohesion(cohesion_energy_density=1.0, between="grains")
    assert cohesion.acts_between("grains")
    assert not cohesion.acts_between("walls")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"cohesion_energy_density": -1.0}, r"LinearCohesion.cohesion_energy_density: .* got -1.0"),
        ({"cohesion_energy_density": float("nan")}, r"must be finite"),
        ({"between": "friends"}, r"LinearCohesion.between: must be one of .* got 'friends'"),
    ],
)
def test_bad_parameters_are_refused(values, message):
    with pytest.raises(ValueError, match=message):
        LinearCohesion(**values)


def test_a_contact_takes_a_mechanism_once():
    with pytest.raises(ValueError, match=r"mechanisms: must be different"):
        pair(mechanisms=(LinearCohesion(), LinearCohesion()))


def test_mechanisms_that_build_on_different_springs_do_not_share_a_contact():
    with pytest.raises(ValueError, match=r"jkr excludes hysteretic_spring"):
        pair(mechanisms=(HystereticSpring(plasticity=0.1), JKR(work_of_adhesion=0.1)))


def test_one_batch_holds_one_set_of_mechanisms():
    with pytest.raises(ValueError, match=r"all in a batch must have the same mechanisms"):
        solve(oblique_impact(), with_mechanism(oblique_impact(), LinearCohesion()))


@pytest.mark.parametrize(
    ("hook", "message"),
    [
        ("rolling", r"at most one may replace the rolling resistance, got \['a', 'b'\]"),
        ("slider", r"at most one may replace the tangential spring, got \['a', 'b'\]"),
    ],
)
def test_what_a_mechanism_replaces_it_replaces_alone(hook, message):
    kinds = tuple(type(name, (LinearCohesion,), {"name": name, hook: lambda *_: 0.0}) for name in "ab")
    with pytest.raises(ValueError, match=message):
        contact_law(kinds)


def test_a_bridge_outlasts_the_touch_and_a_dent_does_not():
    spring, water = (
        HystereticSpring(plasticity=0.5),
        CapillaryBridge(surface_tension=0.07, bridge_volume=2e-11),
    )
    contact, speed = pair(mechanisms=(water, spring)), 0.03
    step = Impact.of(contact, RADIUS, ball_mass(), speed).duration / 200.0
    ball = grains([0.0, 0.0, RADIUS], velocities=[0.0, 0.0, -speed])
    seen = record(solve(world(ball, contact, step, walls=(Plane(),))), 4000)
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
