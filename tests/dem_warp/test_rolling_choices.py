"""Each choice of rolling resistance against closed forms: torque, lever, limit, decay, creep."""

import math

import numpy as np
import pytest
from test_rolling_and_twisting import moment_of_momentum
from worlds import (
    BALL,
    GRAVITY,
    RADIUS,
    TIME_STEP,
    Impact,
    Record,
    ball_mass,
    ball_on_plane,
    grains,
    pair,
    record,
    run_for,
    solve,
    state,
    static_overlap,
    world,
)

from dem_warp.laws.conventions import EDEM, RELATIVE, ContactLaws
from dem_warp.laws.elastic_plastic_rolling import ElasticPlasticRolling
from dem_warp.laws.rolling_choices import ROLLING

MU = 0.05
WEIGHT = ball_mass() * GRAVITY
INERTIA = 0.4 * ball_mass() * RADIUS**2


def rolling(choice: str, **numbers: float) -> ContactLaws:
    return ContactLaws(rolling=choice, **numbers)


def spun(laws: ContactLaws, spin: tuple[float, float, float], steps: int, friction: float = 0.0) -> Record:
    """Motion of a ball that spins where it stands on a plane; without friction, by the torque alone."""
    contact = pair(restitution=0.2, friction=friction, rolling=MU, laws=laws)
    return record(solve(ball_on_plane(contact, spin=spin, laws=laws)), steps)


def overlap_of(laws: ContactLaws) -> float:
    return static_overlap(pair(laws=laws), WEIGHT)


def torques(seen: Record) -> np.ndarray:
    """Torque of each step [N m]: a sphere's spin takes it without gyroscopic terms."""
    return INERTIA * np.diff(seen.spins[:, 0], axis=0) / TIME_STEP


@pytest.mark.parametrize("choice", ["cdt", "relative_constant", "edem_rvd"])
def test_a_constant_torque_has_the_reduced_radius_as_its_lever(choice):
    seen = spun(rolling(choice), (0.0, 50.0, 0.0), 40)
    # Weight and elastic force agree while the ball rests: to the rounding of 40 steps of float64.
    np.testing.assert_allclose(torques(seen)[:, 1], -MU * RADIUS * WEIGHT, rtol=1e-9)


def test_cdt_takes_the_direction_of_the_whole_rotation_and_leaves_its_normal_part_out():
    seen = spun(rolling("cdt"), (30.0, 0.0, 40.0), 1)
    size = MU * RADIUS * WEIGHT
    np.testing.assert_allclose(torques(seen)[0], [-0.6 * size, 0.0, 0.0], rtol=0.0, atol=1e-9 * size)


def test_cdt_acts_for_whole_steps_and_reverses_a_slow_roll():
    kick = MU * RADIUS * WEIGHT * TIME_STEP / INERTIA
    seen = spun(rolling("cdt"), (0.0, 0.25 * kick, 0.0), 6).spins[:, 0, 1]
    np.testing.assert_allclose(seen / kick, [0.25, -0.75, 0.25, -0.75, 0.25, -0.75, 0.25], rtol=1e-6)


SPRINGS = {
    "epsd2": rolling("epsd2"),
    "rocky_3": rolling("rocky_3"),
    "yade": rolling("yade", rolling_spring=2000.0),
    "sds": rolling("sds", rolling_spring=2000.0, rolling_dashpot=0.05),
}


def expected_stiffness(choice: str) -> float:
    """Stiffness of the roll [N m/rad] that the choice's source gives a ball on a plane."""
    contact, overlap = pair(), overlap_of(EDEM)
    tangential = 8.0 * contact.shear_modulus * math.sqrt(RADIUS * overlap)
    lever = RADIUS - 0.5 * overlap
    springs = {"epsd2": tangential * RADIUS**2, "rocky_3": tangential * lever**2}
    return springs.get(choice, 2000.0 * RADIUS**2)


@pytest.mark.parametrize("choice", SPRINGS)
def test_a_spring_against_the_roll_swings_with_its_own_stiffness_and_damping(choice):
    stiffness = expected_stiffness(choice) * TIME_STEP**2 / INERTIA
    dashpot = 0.05 * RADIUS**2 * TIME_STEP / INERTIA if choice == "sds" else 0.0
    # half the limit at the widest swing
    spin = 0.5 * MU * RADIUS * WEIGHT * TIME_STEP / INERTIA / math.sqrt(stiffness)
    seen = spun(SPRINGS[choice], (0.0, spin, 0.0), 300).spins[:, 0, 1]
    # An oscillator whose place is known a step before its speed; rounding of 300 steps.
    closed, angle = [spin], 0.0
    for _ in range(300):
        angle += closed[-1]
        closed.append(closed[-1] - stiffness * angle - dashpot * closed[-1])
    np.testing.assert_allclose(seen / spin, np.array(closed) / spin, rtol=0.0, atol=1e-9)
    assert (seen.min() < -0.5 * spin) or choice == "sds"


@pytest.mark.parametrize("choice", SPRINGS)
def test_a_spring_against_the_roll_gives_way_at_its_limit(choice):
    lever = RADIUS - 0.5 * overlap_of(EDEM) if choice == "rocky_3" else RADIUS
    seen = spun(SPRINGS[choice], (0.0, 50.0, 0.0), 60)
    np.testing.assert_allclose(torques(seen)[20:, 1], -MU * lever * WEIGHT, rtol=1e-9)


def test_left_out_the_spring_of_sds_is_the_tangential_one_at_an_overlap_of_a_hundredth():
    contact = pair(rolling=MU, laws=rolling("sds"))
    spring = 8.0 * contact.shear_modulus * RADIUS * math.sqrt(0.02)
    assert contact.parameters["rolling_stiffness"] == pytest.approx(spring, rel=1e-12)
    assert contact.parameters["rolling_damping"] == pytest.approx(math.sqrt(spring * ball_mass()), rel=1e-12)


def test_the_relative_law_is_the_mechanism_of_its_name():
    law = ElasticPlasticRolling(rolling_stiffness=2.25, rolling_damping=0.3)
    contacts = [
        (pair(restitution=0.2, friction=0.8, rolling=MU, mechanisms=(law,)), EDEM),
        (pair(restitution=0.2, friction=0.8, rolling=MU, laws=RELATIVE), RELATIVE),
    ]
    ends = []
    for contact, laws in contacts:
        solver = solve(ball_on_plane(contact, velocity=(0.1, 0.0, 0.0), spin=(0.0, 30.0, 5.0), laws=laws))
        run_for(solver, 0.05)
        ends.append(state(solver))
    # two kernels: rounding
    for name in ("positions", "orientations", "velocities", "spins"):
        np.testing.assert_allclose(ends[0][name], ends[1][name], rtol=1e-9, atol=1e-14)


HOLDING = ["own_spin", "relative_constant", "elastic_plastic", "epsd2", "rocky_3", "sds"]
WHOLE_STEP = ["own_spin_whole_step", "cdt", "edem_rvd"]


def stands_below_the_rolling_angle(choice: str) -> tuple[float, float]:
    """Way [m] and largest spin [rad/s] of a ball on half the rolling angle in the second half of a second."""
    laws = rolling(choice)
    contact = pair(restitution=0.2, friction=0.8, rolling=MU, laws=laws)
    solver = solve(ball_on_plane(contact, math.degrees(math.atan(0.5 * MU)), laws=laws))
    run_for(solver, 0.5)
    early = state(solver)["positions"][0, 1]
    run_for(solver, 0.5)
    late = state(solver)["positions"][0, 1]
    spins = record(solver, 50).spins[:, 0]
    return float(late - early), float(np.abs(spins).max())


@pytest.mark.parametrize("choice", HOLDING)
def test_what_holds_does_not_creep_below_the_rolling_angle(choice):
    way, spin = stands_below_the_rolling_angle(choice)
    # epsd2 and rocky_3 have no dashpot: they swing about a place, by the angle that the torque winds up.
    wound = 0.5 * MU * RADIUS * WEIGHT / expected_stiffness("epsd2") * RADIUS
    swings = choice in ("epsd2", "rocky_3")
    assert abs(way) < (2.0 * wound if swings else 1e-12)
    assert spin < 1e-9 or swings


@pytest.mark.parametrize("choice", WHOLE_STEP)
def test_what_acts_for_whole_steps_creeps_and_never_rests(choice):
    way, spin = stands_below_the_rolling_angle(choice)
    kick = MU * RADIUS * WEIGHT * TIME_STEP / (INERTIA + ball_mass() * RADIUS**2)
    assert abs(way) > 1e-7
    assert 0.2 * kick < spin < 10.0 * kick


def spinning_pair(laws: ContactLaws) -> tuple[np.ndarray, np.ndarray, Record]:
    """Masses and radii of two unequal balls that meet off-centre and spinning, and their motion."""
    sizes = np.array([1.0, 0.6])
    masses, radii = ball_mass() * sizes**3, RADIUS * sizes
    contact = pair(restitution=0.5, friction=0.5, rolling=0.3, laws=laws)
    bodies = grains(
        [[0.0, 0.0, 0.0], [0.001, 0.002, 1.55 * RADIUS]],
        velocities=[[0.0, 0.0, 0.05], [0.02, 0.0, -0.05]],
        spins=[[1.0, -2.0, 30.0], [0.0, 40.0, 0.0]],
        sizes=sizes,
    )
    step = Impact.of(contact, 0.375 * RADIUS, masses[1], 0.1).duration / 100.0
    return masses, radii, record(solve(world(bodies, contact, step, shapes=(BALL,), laws=laws)), 400)


@pytest.mark.parametrize("choice", [c for c in ROLLING if rolling(c).forms.partner_turning == "opposite"])
def test_torques_on_two_balls_are_equal_and_opposite(choice):
    seen = spinning_pair(rolling(choice))
    momentum = moment_of_momentum(*seen)
    # Rounding of float64 over 400 steps.
    assert np.abs(momentum - momentum[0]).max() < 1e-12 * np.abs(momentum[0]).max()
    without = spinning_pair(EDEM)[2].spins[-1]
    assert (np.abs(seen[2].spins[-1] - without).max(axis=1) > 1e-3).all()


def test_the_torque_of_deme_waits_for_an_impact_s_time():
    laws = rolling("deme")
    contact = pair(restitution=0.2, rolling=MU, laws=laws)
    beta = abs(math.log(0.2)) / math.hypot(math.log(0.2), math.pi)
    stiffness = 4.0 / 3.0 * contact.modulus * math.sqrt(RADIUS)
    wait = math.pi * math.sqrt(ball_mass() / (stiffness * (1.0 - 1.25 * beta**2)))
    steps = math.floor(wait / TIME_STEP)
    seen = torques(spun(laws, (0.0, 50.0, 0.0), steps + 20))[:, 1]
    lever = RADIUS - 0.5 * overlap_of(EDEM)
    # On a GPU the roundings of a sum of nothing are left, some 1e-18 N m.
    assert np.abs(seen[:steps]).max() < 1e-15
    np.testing.assert_allclose(seen[steps:], -MU * lever * WEIGHT, rtol=1e-9)


@pytest.mark.parametrize("choice", ["deme", "edem_rvd"])
def test_gears_roll_freely_where_the_torque_is_of_what_the_spins_have_in_common(choice):
    laws = rolling(choice)
    contact = pair(restitution=0.2, rolling=MU, laws=laws)
    bodies = [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0 * RADIUS]]
    step = Impact.of(contact, 0.5 * RADIUS, 0.5 * ball_mass(), 0.1).duration / 100.0
    ends = {}
    for name, spin in (("same", 20.0), ("gears", -20.0)):
        met = grains(bodies, velocities=[[0, 0, 0.05], [0, 0, -0.05]], spins=[[20.0, 0, 0], [spin, 0, 0]])
        seen = record(solve(world(met, contact, step, laws=laws)), 150)
        ends[name] = seen.spins[-1, :, 0]
    # Gears roll on each other without a torque; of equal spins both are slowed alike, not one by the other.
    np.testing.assert_allclose(ends["gears"], [20.0, -20.0], rtol=1e-12)
    assert ends["same"][0] == pytest.approx(ends["same"][1], rel=1e-12)
    assert ends["same"][0] < 19.9


def test_rvd_takes_the_mean_of_two_spins_whatever_their_sizes_and_turns_both_alike():
    laws = rolling("edem_rvd")
    contact = pair(rolling=MU, laws=laws)
    sizes, overlap, step = np.array([1.0, 0.6]), 1e-5, 1e-7
    place = [0.0, 0.0, 1.6 * RADIUS - overlap]
    spins = [[30.0, 0.0, 5.0], [0.0, 40.0, 0.0]]
    bodies = grains([[0.0, 0.0, 0.0], place], spins=spins, sizes=sizes)
    seen = record(solve(world(bodies, contact, step, laws=laws)), 1)
    reduced = 0.375 * RADIUS
    force = 4.0 / 3.0 * contact.modulus * math.sqrt(reduced) * overlap**1.5
    inertia = INERTIA * sizes[:, None] ** 5
    torque = inertia * np.diff(seen.spins, axis=0)[0] / step
    expected = MU * reduced * force * np.array([-0.6, -0.8, 0.0])
    # rounding of float64 in a difference of spins, and of a sphere's three moments
    np.testing.assert_allclose(torque, [expected, expected], rtol=0.0, atol=1e-6 * MU * reduced * force)
