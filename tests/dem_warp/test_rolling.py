"""Rolling resistance of every choice, and twisting resistance: torque, lever, limit, decay and creep."""

import math

import numpy as np
import pytest
import worlds
from worlds import GRAVITY, RADIUS, TIME_STEP, ball_mass, ball_on_plane, pair, record, run_for, solve, state

from dem_warp.laws.conventions import EDEM, RELATIVE, ContactLaws
from dem_warp.laws.elastic_plastic_rolling import ElasticPlasticRolling
from dem_warp.laws.rolling_choices import ROLLING
from dem_warp.laws.twisting import Twisting
from dem_warp.model import ContactCoefficients

MU = 0.05
WEIGHT = ball_mass() * GRAVITY
INERTIA = 0.4 * ball_mass() * RADIUS**2


def rolling(choice: str, **numbers: float) -> ContactLaws:
    return ContactLaws(rolling=choice, **worlds.ALONG.get(choice, {}), **numbers)


def spun(
    laws: ContactLaws, spin: tuple[float, float, float], steps: int, friction: float = 0.0
) -> worlds.Record:
    """Record a ball that spins in its place on a plane; without friction the torque alone turns it."""
    contact = pair(restitution=0.2, friction=friction, rolling=MU, laws=laws)
    return record(solve(ball_on_plane(contact, spin=spin, laws=laws)), steps)


def overlap_of(laws: ContactLaws) -> float:
    return worlds.static_overlap(pair(laws=laws), WEIGHT)


def torques(seen: worlds.Record) -> np.ndarray:
    """Return the torque of each step [N m]: a sphere's spin takes it without gyroscopic terms."""
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


SPRINGS = {
    "epsd2": rolling("epsd2"),
    "rocky_3": rolling("rocky_3"),
    "yade": rolling("yade", rolling_spring=2000.0),
    "sds": rolling("sds", rolling_spring=2000.0, rolling_dashpot=0.05),
}


def expected_stiffness(choice: str) -> float:
    """Return the stiffness of the roll [N m/rad] that the choice's source gives a ball on a plane."""
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


HOLDING = ["relative_constant", "elastic_plastic", "epsd2", "rocky_3", "sds"]
WHOLE_STEP = ["own_spin_whole_step", "cdt", "edem_rvd"]


def below_the_rolling_angle(choice: str) -> tuple[float, float]:
    """Return way [m] and largest spin [rad/s] of a ball on half the rolling angle, after half a second."""
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
def test_a_resistance_that_holds_does_not_creep_below_the_rolling_angle(choice):
    way, spin = below_the_rolling_angle(choice)
    # epsd2 and rocky_3 have no dashpot: they swing about a place, by the angle that the torque winds up.
    wound = 0.5 * MU * RADIUS * WEIGHT / expected_stiffness("epsd2") * RADIUS
    swings = choice in ("epsd2", "rocky_3")
    assert abs(way) < (2.0 * wound if swings else 1e-12)
    assert spin < 1e-9 or swings


@pytest.mark.parametrize("choice", WHOLE_STEP)
def test_a_torque_that_acts_for_whole_steps_creeps_and_never_rests(choice):
    way, spin = below_the_rolling_angle(choice)
    kick = MU * RADIUS * WEIGHT * TIME_STEP / (INERTIA + ball_mass() * RADIUS**2)
    assert abs(way) > 1e-7
    assert 0.2 * kick < spin < 10.0 * kick


@pytest.mark.parametrize("choice", [c for c in ROLLING if rolling(c).forms.partner_turning == "opposite"])
def test_torques_on_two_balls_are_equal_and_opposite(choice):
    seen, without = (
        spun_pair(pair(restitution=0.5, friction=0.5, rolling=0.3, laws=laws), laws)
        for laws in (rolling(choice), EDEM)
    )
    momentum = moment_of_momentum(*seen)
    # Rounding of float64 over 400 steps.
    assert np.abs(momentum - momentum[0]).max() < 1e-12 * np.abs(momentum[0]).max()
    assert (np.abs(seen[2].spins[-1] - without[2].spins[-1]).max(axis=1) > 1e-3).all()


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


def test_gears_roll_freely_with_the_torque_of_deme():
    laws = rolling("deme")
    contact = pair(restitution=0.2, rolling=MU, laws=laws)
    bodies = [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0 * RADIUS]]
    step = worlds.Impact.of(contact, 0.5 * RADIUS, 0.5 * ball_mass(), 0.1).duration / 100.0
    ends = {}
    for name, spin in (("same", 20.0), ("gears", -20.0)):
        met = worlds.grains(
            bodies, velocities=[[0, 0, 0.05], [0, 0, -0.05]], spins=[[20.0, 0, 0], [spin, 0, 0]]
        )
        seen = record(solve(worlds.world(met, contact, step, laws=laws)), 150)
        ends[name] = seen.spins[-1, :, 0]
    # Gears roll on each other without a torque; of equal spins both are slowed alike, not one by the other.
    np.testing.assert_allclose(ends["gears"], [20.0, -20.0], rtol=1e-12)
    assert ends["same"][0] == pytest.approx(ends["same"][1], rel=1e-12)
    assert ends["same"][0] < 19.9


def test_rvd_takes_the_mean_of_two_spins_of_any_sizes_and_turns_both_alike():
    laws = rolling("edem_rvd")
    contact = pair(rolling=MU, laws=laws)
    sizes, overlap, step = np.array([1.0, 0.6]), 1e-5, 1e-7
    place = [0.0, 0.0, 1.6 * RADIUS - overlap]
    spins = [[30.0, 0.0, 5.0], [0.0, 40.0, 0.0]]
    bodies = worlds.grains([[0.0, 0.0, 0.0], place], spins=spins, sizes=sizes)
    seen = record(solve(worlds.world(bodies, contact, step, laws=laws)), 1)
    reduced = 0.375 * RADIUS
    force = 4.0 / 3.0 * contact.modulus * math.sqrt(reduced) * overlap**1.5
    inertia = INERTIA * sizes[:, None] ** 5
    torque = inertia * np.diff(seen.spins, axis=0)[0] / step
    expected = MU * reduced * force * np.array([-0.6, -0.8, 0.0])
    # rounding of float64 in a difference of spins, and of a sphere's three moments
    np.testing.assert_allclose(torque, [expected, expected], rtol=0.0, atol=1e-6 * MU * reduced * force)


DAMPING = 0.3


def springy() -> ContactCoefficients:
    """Return the contact with the rolling stiffness that the source of the law recommends."""
    law = ElasticPlasticRolling(rolling_stiffness=2.25, rolling_damping=DAMPING)
    return pair(restitution=0.2, friction=0.8, rolling=MU, mechanisms=(law,))


def damped_swing(stiffness: float, inertia: float, damping: float, steps: int) -> np.ndarray:
    """Return phases, complex, of an oscillator of a damping ratio at its first steps.

    The real part plus `lag(damping)` times the imaginary is the deflection of one that starts deflected by 1,
    minus it is the speed of one that starts at the speed 1.
    """
    rate = complex(-damping, math.sqrt(1.0 - damping**2)) * math.sqrt(stiffness / inertia)
    return np.exp(rate * TIME_STEP * np.arange(steps))


def lag(damping: float) -> float:
    """Return the weight of the sine in a damped swing."""
    return damping / math.sqrt(1.0 - damping**2)


class RollingBall:
    """Closed form of a ball that rolls on a plane, which a part of its weight presses it to."""

    def __init__(self, contact: ContactCoefficients, slope: float = 0.0) -> None:
        weight = ball_mass() * GRAVITY
        angle = math.radians(slope)
        overlap = worlds.static_overlap(contact, weight * math.cos(angle))
        self.lever = RADIUS - 0.5 * overlap
        self.driving_torque = weight * math.sin(angle) * self.lever
        self.limit = contact.rolling_friction * RADIUS * weight * math.cos(angle)
        self.stiffness = 4.5 * contact.modulus * math.sqrt(RADIUS * overlap)
        self.stiffness *= (contact.rolling_friction * RADIUS) ** 2
        self.tangential_stiffness = 8.0 * contact.shear_modulus * math.sqrt(RADIUS * overlap)
        self.inertia = INERTIA + ball_mass() * self.lever**2


def test_a_ball_on_a_slope_swings_about_the_angle_of_its_spring_and_comes_to_rest():
    contact = springy()
    # The first swing needs twice the driving torque at the most; the spring slides at 2.5 times.
    slope = math.degrees(math.atan(0.4 * MU))
    expected = RollingBall(contact, slope)
    rest = expected.driving_torque / expected.stiffness
    solver = solve(ball_on_plane(contact, slope))
    seen = record(solver, 1500)
    rolled = -np.cumsum(seen.spins[:-1, 0, 0]) * TIME_STEP
    phase = damped_swing(expected.stiffness, expected.inertia, DAMPING, len(rolled))
    closed = 1.0 - (phase.real + lag(DAMPING) * phase.imag)
    assert closed.max() > 1.3
    # The tangential spring in series gives way too, k_r / (S_t L^2) = 0.7 % as far; measured: 0.6 %.
    np.testing.assert_allclose(rolled / rest, closed, rtol=0.0, atol=0.01)
    run_for(solver, 0.6)
    end = state(solver)
    # At rest torques balance, and the tangential spring adds to the place, not to the angle. The last of the
    # swing has died out to exp(-0.3 x 90).
    assert -2.0 * math.asin(end["orientations"][0, 0]) == pytest.approx(rest, rel=1e-8)
    assert np.abs(end["velocities"]).max() < 1e-12


def test_a_rolling_ball_stops_after_the_work_of_its_energy_and_swings_back():
    speed = 0.1
    contact = springy()
    expected = RollingBall(contact)
    spin = speed / expected.lever
    solver = solve(ball_on_plane(contact, velocity=(speed, 0.0, 0.0), spin=(0.0, spin, 0.0)))
    path = record(solver, math.ceil(1.1 * expected.inertia * spin / expected.limit / TIME_STEP)).positions
    farthest = 0.5 * expected.inertia * spin**2 / expected.limit * expected.lever
    # While the spring winds up, over 1e-3 of the path, the dashpot fills up what it leaves of the limit: so
    # the limit acts from the first step to the last.
    assert path[:, 0, 0].max() == pytest.approx(farthest, rel=3e-4)
    # Then the spring unwinds, to nothing, and with it the tangential spring that had slowed the ball.
    run_for(solver, 0.6)
    braking = ball_mass() * expected.limit * expected.lever / expected.inertia
    back = expected.limit / expected.stiffness * expected.lever + braking / expected.tangential_stiffness
    assert back / farthest > 1e-3
    assert path[:, 0, 0].max() - state(solver)["positions"][0, 0] == pytest.approx(back, rel=1e-8)


def spun_pair(
    contact: ContactCoefficients, laws: ContactLaws = EDEM
) -> tuple[np.ndarray, np.ndarray, worlds.Record]:
    """Return masses and radii of two unequal balls that meet off-centre and spinning, and their motion."""
    sizes = np.array([1.0, 0.6])
    masses, radii = ball_mass() * sizes**3, RADIUS * sizes
    bodies = worlds.grains(
        [[0.0, 0.0, 0.0], [0.001, 0.002, 1.55 * RADIUS]],
        velocities=[[0.0, 0.0, 0.05], [0.02, 0.0, -0.05]],
        spins=[[1.0, -2.0, 30.0], [0.0, 40.0, 0.0]],
        sizes=sizes,
    )
    step = worlds.Impact.of(contact, 0.375 * RADIUS, masses[1], 0.1).duration / 100.0
    return (
        masses,
        radii,
        record(solve(worlds.world(bodies, contact, step, shapes=(worlds.BALL,), laws=laws)), 400),
    )


def moment_of_momentum(masses: np.ndarray, radii: np.ndarray, seen: worlds.Record) -> np.ndarray:
    """Return angular momentum of all balls about the origin, step by step, (steps + 1, 3) [kg m2/s]."""
    orbital = np.cross(seen.positions, seen.velocities) * masses[:, None]
    return (orbital + 0.4 * (masses * radii**2)[:, None] * seen.spins).sum(axis=1)


def test_two_balls_feel_opposite_twists():
    with_law, without = (
        spun_pair(pair(restitution=0.5, friction=0.5, mechanisms=(law,)))
        for law in (Twisting(twisting_radius=3.0), Twisting())
    )
    momentum = moment_of_momentum(*with_law)
    # Rounding of float64 over 400 steps.
    assert np.abs(momentum - momentum[0]).max() < 1e-12 * np.abs(momentum[0]).max()
    change = with_law[2].spins[-1] - without[2].spins[-1]
    assert (np.abs(change).max(axis=1) > 0.1).all()


def twisted(contact: ContactCoefficients, patch: float) -> tuple[float, float]:
    """Return limit [N m] and stiffness [N m/rad] of the twist of a ball at rest on a plane."""
    overlap = worlds.static_overlap(contact, ball_mass() * GRAVITY)
    radius = patch * math.sqrt(RADIUS * overlap)
    limit = 2.0 / 3.0 * radius * contact.static_friction * ball_mass() * GRAVITY
    return limit, 4.0 * contact.shear_modulus * math.sqrt(RADIUS * overlap) * radius**2


def test_a_twisted_ball_is_slowed_by_the_limit_and_swings_when_it_has_stopped():
    patch, spin = 2.0, 5.0
    contact = pair(friction=0.5, mechanisms=(Twisting(twisting_radius=patch),))
    limit, stiffness = twisted(contact, patch)
    swing = math.sqrt(stiffness / INERTIA)
    wound = limit / stiffness
    # Winding up: a quarter swing cut short by the limit; then a constant torque.
    winding = math.asin(wound * swing / spin) / swing
    slowed = math.sqrt(spin**2 - (wound * swing) ** 2)
    stop = winding + slowed * INERTIA / limit
    seen = record(solve(ball_on_plane(contact, spin=(0.0, 0.0, spin))), math.ceil(1.2 * stop / TIME_STEP))
    rates = seen.spins[:, 0, 2]
    time = TIME_STEP * np.arange(len(rates))
    sliding = (time > 1.2 * winding) & (time < 0.99 * stop)
    line = slowed - limit / INERTIA * (time - winding)
    # A step more or less of the constant torque, 6e-4 of the spin.
    np.testing.assert_allclose(rates[sliding], line[sliding], rtol=0.0, atol=1e-3 * spin)
    first = np.flatnonzero(rates <= 0.0)[0]
    assert time[first] == pytest.approx(stop, abs=2.0 * TIME_STEP)
    # Undamped, the spring swings on: the spin's amplitude is that of the spring wound up to its limit.
    assert -rates.min() == pytest.approx(wound * swing, rel=1e-3)
    assert np.abs(seen.velocities[:, 0, :2]).max() < 1e-15


def test_a_twist_within_its_limit_is_damped_as_the_tangential_spring_is():
    spin = 0.1
    contact = pair(restitution=0.05, friction=0.5, mechanisms=(Twisting(twisting_radius=20.0),))
    limit, stiffness = twisted(contact, 20.0)
    swing = math.sqrt(stiffness / INERTIA)
    assert spin * math.sqrt(stiffness * INERTIA) < limit
    # The tangential spring's damping over its stiffness, at the swing's frequency.
    overlap = worlds.static_overlap(contact, ball_mass() * GRAVITY)
    tangential = 8.0 * contact.shear_modulus * math.sqrt(RADIUS * overlap)
    damping = 0.5 * contact.damping * math.sqrt(ball_mass() / tangential) * swing
    phase = damped_swing(stiffness, INERTIA, damping, 401)
    closed = phase.real - lag(damping) * phase.imag
    seen = record(solve(ball_on_plane(contact, spin=(0.0, 0.0, spin))), 400).spins[:, 0, 2]
    # The spring is wound by the spin of the step before: half a step of phase, 0.024; measured: 0.024.
    np.testing.assert_allclose(seen / spin, closed, rtol=0.0, atol=0.03)
