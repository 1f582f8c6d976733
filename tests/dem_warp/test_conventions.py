"""Conventions of contact laws: what they refuse, dampings and restitution, sliding, and histories."""

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import warp as wp
import worlds
from worlds import RADIUS, Impact, Record, ball_mass, grains, pair, record, small_case, solve, world

from dem_warp.laws.contact_law import contact_law, memory_size
from dem_warp.laws.conventions import BASE_FORMS, EDEM, PRESETS, RELATIVE, ContactLaws, laws_named
from dem_warp.laws.tangential import coulomb_spring, free_spring, sum_spring
from dem_warp.materials import DAMPINGS
from dem_warp.parameters import choices_of
from dem_warp.types import MIXED, Build
from dem_warp.walls import Plane

SPEED = 0.1


def test_sets_of_laws_are_different_and_know_their_names():
    assert len(set(PRESETS.values())) == len(PRESETS)
    assert all(laws.name == name for name, laws in PRESETS.items())
    assert replace(EDEM, attraction="clamped").name == "own"
    assert laws_named("relative") is RELATIVE


def test_cases_of_different_laws_have_different_identities_and_the_base_law_keeps_its_own():
    cases = [replace(small_case(), laws=laws) for laws in PRESETS.values()]
    texts = [json.dumps(case.to_dict(), sort_keys=True) for case in cases]
    assert len(set(texts)) == len(texts)
    base = small_case().to_dict()
    assert "laws" not in base
    # words of cases that were stored before laws had names
    words = {"clamp_attraction": False, "tangential_damping": True, "rolling_holds": True}
    assert words.items() <= base["numerics"].items()


def test_an_unused_choice_adds_nothing_to_the_kernels():
    numbers = ContactLaws(
        normal="overlap_circle",
        restitution="thornton",
        attraction="clamped",
        tangential_damping="deme",
        rolling="own_spin_whole_step",
    )
    assert numbers.forms == EDEM.forms == BASE_FORMS
    assert contact_law((), EDEM.forms) is contact_law((), numbers.forms)
    assert memory_size((), BASE_FORMS) == 0
    base, other = (Build(MIXED, 9, 2, False, forms=laws.forms) for laws in (EDEM, RELATIVE))
    assert base.name == "mixed_serial_9_2"
    assert other.name == "mixed_serial_9_2_elastic_plastic"
    assert other.without_forces == base


@pytest.mark.parametrize(
    "law", ["normal_damping", "tangential_history", "sliding", "friction_load", "rolling"]
)
def test_every_form_has_its_own_law(law):
    known = [name for name in choices_of(ContactLaws)[law] if name != "own_spin_whole_step"]
    assert len({contact_law((), BASE_FORMS._replace(**{law: name})) for name in known}) == len(known)


def falling(laws: ContactLaws, restitution: float, steps: int, **more: Any) -> tuple[Any, float, Record]:
    """Return contact, step [s] and motion of a ball that falls on a plane with `SPEED`."""
    contact = pair(restitution=restitution, laws=laws, **more)
    step = Impact.of(contact, RADIUS, ball_mass(), SPEED).duration / steps
    place = [0.0, 0.0, RADIUS + 1e-12]
    bodies = grains(place, velocities=[0.0, 0.0, -SPEED])
    return contact, step, record(solve(world(bodies, contact, step, walls=(Plane(),), laws=laws)), 4 * steps)


@pytest.mark.parametrize("restitution", DAMPINGS)
@pytest.mark.parametrize("chosen", [0.2, 0.5])
def test_an_impact_has_the_restitution_of_its_damping(restitution, chosen):
    # Thornton's fit is for a damping that never attracts, the others for one that may.
    attraction = "clamped" if restitution == "thornton" else "free"
    laws = ContactLaws(restitution=restitution, attraction=attraction)
    expected = chosen
    if restitution == "polynomial":
        # the closed form's restitution of LAMMPS' damping, which is smaller: 0.61 for 0.5
        beta = DAMPINGS[restitution](chosen) / (2.0 * math.sqrt(5.0 / 6.0))
        expected = math.exp(-math.pi * beta / math.sqrt(1.0 - beta**2))
        assert expected > chosen + 0.02
    speed = falling(laws, chosen, 400)[2].velocities[-1, 0, 2] / SPEED
    # first order in the step, and 0.5 % of Thornton's fit
    assert speed == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize("restitution", DAMPINGS)
def test_dampings_fall_with_the_restitution(restitution):
    values = [DAMPINGS[restitution](e) for e in np.linspace(0.1, 1.0, 19)]
    assert (np.diff(values) < 0.0).all()
    assert values[-1] == pytest.approx(0.0, abs=2e-3)  # the polynomial ends at 1.6e-3


@pytest.mark.parametrize("damping", ["mass_velocity", "viscoelastic"])
def test_a_damping_by_its_rate_is_the_rate_times_mass_and_contact_radius(damping):
    rate = 200.0
    laws = ContactLaws(normal_damping=damping, tangential_damping="none", damping_rate=rate)
    contact, step, seen = falling(laws, 0.2, 200)
    height, speed = seen.positions[:-1, 0, 2], seen.velocities[:-1, 0, 2]
    overlap = np.maximum(RADIUS - height, 0.0)
    force = ball_mass() * np.diff(seen.velocities[:, 0, 2]) / step
    elastic = 4.0 / 3.0 * contact.modulus * math.sqrt(RADIUS) * overlap**1.5
    factor = 1.0 if damping == "mass_velocity" else np.sqrt(RADIUS * overlap) / 1e-3
    touching = overlap > 1e-3 * overlap.max()
    expected = elastic - rate * factor * ball_mass() * speed
    # rounding of float64 in a difference of speeds
    np.testing.assert_allclose(force[touching], expected[touching], rtol=0.0, atol=1e-8 * elastic.max())


def test_tangential_dampings_are_those_of_their_codes():
    base, lammps, deme, none = (
        pair(restitution=0.4, laws=ContactLaws(tangential_damping=choice))
        for choice in ("tsuji", "normal", "deme", "none")
    )
    # c_t = t D sqrt(S_t m), S_t = 8 G* a, against c_n = D sqrt(S_n m), S_n = 2 E* a
    assert lammps.tangential_damping * math.sqrt(8.0 * base.shear_modulus) == pytest.approx(
        math.sqrt(2.0 * base.modulus), rel=1e-12
    )
    # 2 sqrt(5/3) |beta| over 2 sqrt(5/6) |beta|
    assert deme.tangential_damping == pytest.approx(math.sqrt((5.0 / 3.0) / (5.0 / 6.0)), rel=1e-12)
    assert (base.tangential_damping, none.tangential_damping) == (1.0, 0.0)


def test_the_overlap_circle_has_twice_hertz_s_area():
    hertz, circle = pair(), pair(laws=ContactLaws(normal="overlap_circle"))
    # F = 4/3 E* a d with a = sqrt(2 R* d) in place of sqrt(R* d)
    assert worlds.static_overlap(circle, 1.0) == pytest.approx(
        worlds.static_overlap(hertz, 1.0) * 2.0 ** (-1.0 / 3.0)
    )
    assert circle.shear_modulus / hertz.shear_modulus == pytest.approx(math.sqrt(2.0))


@wp.kernel
def slide(
    stretch: wp.array(dtype=wp.vec3d), velocity: wp.vec3d, limit: wp.float64, out: wp.array(dtype=wp.vec3d)
):
    i = wp.tid()
    stiffness, rate = wp.float64(2.0), wp.float64(3.0)
    force, left = coulomb_spring(stretch[i], stiffness, rate, velocity, limit)
    out[6 * i] = force
    out[6 * i + 1] = left
    force, left = free_spring(stretch[i], stiffness, rate, velocity, limit)
    out[6 * i + 2] = force
    out[6 * i + 3] = left
    force, left = sum_spring(stretch[i], stiffness, rate, velocity, limit)
    out[6 * i + 4] = force
    out[6 * i + 5] = left


def test_coulomb_s_limit_holds_for_the_spring_for_both_or_for_their_sum():
    # springs of 0.4, 2 and 4 N, a dashpot of 3 N, a limit of 3.5 N
    stretch = wp.array([[0.2, 0, 0], [1.0, 0, 0], [2.0, 0, 0]], dtype=wp.vec3d, device="cpu")
    out = wp.full(18, wp.vec3d(np.nan), dtype=wp.vec3d, device="cpu")
    wp.launch(slide, 3, inputs=[stretch, wp.vec3d(1.0, 0.0, 0.0), wp.float64(3.5), out], device="cpu")
    seen = out.numpy()[:, 0].reshape(3, 3, 2)
    spring = [[-3.4, 0.2], [-3.5, 1.0], [-3.5, 1.75]]
    free = [[-3.4, 0.2], [-5.0, 1.0], [-3.5, 1.75]]
    total = [[-3.4, 0.2], [-3.5, 0.25], [-3.5, 0.25]]
    np.testing.assert_allclose(seen, np.stack([spring, free, total], axis=1), rtol=1e-14)


def test_friction_follows_the_size_of_a_force_that_attracts():
    ends = {}
    for load in ("push", "size"):
        laws = worlds.along(friction_load=load)
        contact = pair(restitution=0.05, friction=0.3, laws=laws)
        step = Impact.of(contact, RADIUS, ball_mass(), SPEED).duration / 400.0
        bodies = grains([0.0, 0.0, RADIUS], velocities=[10.0 * SPEED, 0.0, -SPEED])
        seen = record(solve(world(bodies, contact, step, walls=(Plane(),), laws=laws)), 4000)
        kicks = np.diff(seen.velocities[:, 0], axis=0)
        attracted = kicks[:, 2] < 0.0
        assert attracted.any()
        ends[load] = np.abs(kicks[attracted, 0]) / -kicks[attracted, 2]
    assert ends["push"].max() == 0.0
    # full sliding: the limit is reached in every step
    np.testing.assert_allclose(ends["size"], 0.3, rtol=1e-6)


def oblique(history: str) -> tuple[Any, float, Record]:
    laws = replace(worlds.along(tangential_history=history), tangential_damping="none")
    contact = pair(friction=1e6, laws=laws)
    step = Impact.of(contact, RADIUS, ball_mass(), SPEED).duration / 200.0
    bodies = grains([0.0, 0.0, RADIUS], velocities=[0.5 * SPEED, 0.0, -SPEED])
    return contact, step, record(solve(world(bodies, contact, step, walls=(Plane(),), laws=laws)), 240)


def remembered(history: str, stiffness: np.ndarray, radius: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Return the spring force of each step from stiffness, contact radius and the surfaces' motion."""
    forces, memory, before = [], 0.0, 0.0
    for k, a, move in zip(stiffness, radius, moved, strict=True):
        if "rescaled" in history and a < before:
            memory *= a / before
        memory += move if history.endswith("displacement") else -k * move
        forces.append(-k * memory if history.endswith("displacement") else memory)
        before = a
    return np.array(forces)


@pytest.mark.parametrize("history", choices_of(ContactLaws)["tangential_history"])
def test_a_history_is_that_of_the_displacement_or_of_the_force(history):
    contact, step, seen = oblique(history)
    overlap = RADIUS - seen.positions[:-1, 0, 2]
    touching = overlap > 0.0
    radius = np.sqrt(RADIUS * overlap[touching])
    lever = RADIUS - 0.5 * overlap[touching]
    slip = seen.velocities[:-1, 0, 0][touching] - lever * seen.spins[:-1, 0, 1][touching]
    expected = remembered(history, 8.0 * contact.shear_modulus * radius, radius, slip * step)
    force = ball_mass() * np.diff(seen.velocities[:, 0, 0])[touching] / step
    # rounding of float64 in a difference of speeds
    np.testing.assert_allclose(force, expected, rtol=0.0, atol=1e-8 * np.abs(expected).max())
    for other in set(choices_of(ContactLaws)["tangential_history"]) - {history}:
        wrong = remembered(other, 8.0 * contact.shear_modulus * radius, radius, slip * step)
        assert np.abs(wrong - expected).max() > 0.01 * np.abs(expected).max()
