"""What holds for every mechanism: its null, its checks, how several stand together."""

import numpy as np
import pytest
from worlds import assert_same_bits, oblique_impact, pair, pile, solve, state, world

from dem_warp.laws.contact_law import contact_law
from dem_warp.laws.library import MECHANISMS, PARAMETERS
from dem_warp.laws.linear_cohesion import LinearCohesion
from dem_warp.laws.mechanism import Mechanism
from dem_warp.model import WorldSetup

KINDS = list(MECHANISMS.values())


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


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_null_mechanism_leaves_the_base_law(kind: type[Mechanism]):
    """To rounding, in another compiled kernel; in the same one, whatever its other parameters, to the bit."""
    others = {name: 0.5 for name in kind.parameter_names() if name != kind.strength}
    null, other_null = (with_mechanism(oblique_impact(), kind(**values)) for values in ({}, others))
    base, first, second = solve(oblique_impact()), solve(null), solve(other_null)
    for solver in (base, first, second):
        solver.advance(2)
    assert_same_bits(state(first), state(second))
    for name, expected in state(base).items():
        # An impact of 100 steps, each rounded in float64.
        np.testing.assert_allclose(state(first)[name], expected, rtol=1e-12, atol=1e-15, err_msg=name)


def test_parameters_of_mechanisms_have_names_of_their_own():
    assert len(set(PARAMETERS)) == len(PARAMETERS)


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


def test_one_batch_holds_one_set_of_mechanisms():
    with pytest.raises(ValueError, match=r"worlds of one batch must have the same mechanisms"):
        solve(oblique_impact(), with_mechanism(oblique_impact(), LinearCohesion()))


def test_one_law_of_rolling_resistance_at_a_time():
    kinds = tuple(type(name, (LinearCohesion,), {"name": name, "rolling": lambda *_: 0.0}) for name in "ab")
    with pytest.raises(ValueError, match=r"at most one law of rolling resistance"):
        contact_law(kinds)
