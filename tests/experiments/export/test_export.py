"""Contact terms of other codes: closed forms of the same contact, in their words."""

import math
from dataclasses import replace

import numpy as np
import pytest

from dem_warp import PRESETS
from dem_warp.case import Case
from experiments.export import EXPORTERS, Contact, Translation, contacts_of, values
from experiments.export.lammps_exporter import TSUJI, granular_words
from experiments.studyfile import load_study

RADIUS, MASS = 1.5e-3, 2e-5
WORDS = EXPORTERS["lammps"].conventions.words(PRESETS["lammps"])


@pytest.fixture(scope="module")
def case() -> Case:
    return load_study(scale="soft").case({"A": 0.2, "C": 0.3, "D": 0.6, "E": 0.46, "F": 0.38}, 1)


@pytest.fixture(scope="module")
def contacts(case: Case) -> tuple[Contact, Contact]:
    return contacts_of(case, RADIUS, MASS)


def test_reduced_size_and_mass_are_halves_between_equal_grains(contacts: tuple[Contact, Contact]) -> None:
    assert [(contact.radius, contact.mass) for contact in contacts] == [
        (RADIUS / 2, MASS / 2),
        (RADIUS, MASS),
    ]


def test_lammps_gets_both_springs_and_both_dampings(contacts: tuple[Contact, Contact]) -> None:
    for contact in contacts:
        a, b, terms = contact.first, contact.second, values(EXPORTERS["lammps"].contact_terms(contact))
        compliance = sum((1.0 - m.poisson_ratio**2) / m.youngs_modulus for m in (a, b))
        shear = sum((2.0 - m.poisson_ratio) / m.shear_modulus for m in (a, b))
        # Without v LAMMPS takes E* for half of E.
        assert (terms["E"] / 2.0, terms["nu"]) == (pytest.approx(1.0 / compliance), 0.0)
        assert terms["k_t"] == pytest.approx(8.0 / shear)
        log = math.log(contact.surface.restitution)
        # 2 sqrt(5/6) |beta| sqrt(2 E* ...) is a sqrt(4/3 E* ...), a being the polynomial.
        ours = 2.0 * math.sqrt(5.0 / 6.0) * abs(log) / math.hypot(log, math.pi)
        assert np.polyval(TSUJI, terms["e"]) == pytest.approx(math.sqrt(1.5) * ours)
        assert terms["mu_s"] == contact.surface.static_friction
        words = granular_words(contact, WORDS).split()
        assert [words[0], words[4:6], words[9:11], words[-1]] == [
            "hertz/material", ["tangential", "mindlin"], ["rolling", "sds"], "tsuji",
        ]  # fmt: skip
        numbers = [float(words[i]) for i in (1, 2, 3, 6, 7, 8, 11, 12, 13)]
        assert numbers == list(terms.values())


@pytest.mark.parametrize("restitution", [1.0, 0.999, 0.5, 0.11, 0.1, 0.01])
def test_lammps_comes_to_any_damping(contacts: tuple[Contact, Contact], restitution: float) -> None:
    # LAMMPS takes any number for a restitution; its polynomial ends in 0 at 1 but for 3e-4
    log = math.log(restitution)
    damping = 2.0 * math.sqrt(5.0 / 6.0) * abs(log) / math.hypot(log, math.pi)
    law = replace(contacts[0].coefficients, damping=damping)
    terms = values(EXPORTERS["lammps"].contact_terms(replace(contacts[0], coefficients=law)))
    assert np.polyval(TSUJI, terms["e"]) == pytest.approx(math.sqrt(1.5) * damping, abs=3.1e-4)
    assert (terms["e"] < 0.0) is (restitution <= 0.11)


def test_liggghts_and_yade_get_the_values_of_the_pair(contacts: tuple[Contact, Contact]) -> None:
    for contact in contacts:
        surface = contact.surface
        liggghts = values(EXPORTERS["liggghts"].contact_terms(contact))
        assert list(liggghts.values()) == [
            surface.restitution, surface.static_friction, surface.rolling_friction,
        ]  # fmt: skip
        yade = values(EXPORTERS["yade"].contact_terms(contact))
        log = math.log(surface.restitution)
        ratio = math.sqrt(5.0 / 6.0) * abs(log) / math.hypot(log, math.pi)
        assert math.tan(yade["frictAngle"]) == pytest.approx(surface.static_friction)
        assert (yade["betan"], yade["betas"]) == (pytest.approx(ratio), pytest.approx(ratio))
        material = values(EXPORTERS["yade"].material_terms(contact.first))
        assert material["young"] == pytest.approx(2.0 * contact.first.shear_modulus * 1.2)


def test_an_undamped_tangential_spring_stays_one(contacts: tuple[Contact, Contact]) -> None:
    law = replace(contacts[0].coefficients, tangential_damping=0.0)
    undamped = replace(contacts[0], coefficients=law)
    assert values(EXPORTERS["lammps"].contact_terms(undamped))["x_gamma,t"] == 0.0
    assert values(EXPORTERS["yade"].contact_terms(undamped))["betas"] == 0.0


def test_what_no_other_code_has_is_refused(case: Case) -> None:
    changes = {"mechanism": {"micro_slip": {"micro_slip": 1.0}}}
    with_more = load_study(scale="soft", changes=changes).case({}, 1)
    with pytest.raises(ValueError, match=r"terms for the base law alone, got \['micro_slip'\]"):
        contacts_of(with_more, RADIUS, MASS)


def test_warnings_of_a_translation_are_several_texts() -> None:
    with pytest.raises(ValueError, match="warnings: must be a tuple of texts, got 'the code lacks the tube'"):
        Translation({"lift.in": ""}, "lift.in", (), "", (), "the code lacks the tube")  # type: ignore[arg-type]
