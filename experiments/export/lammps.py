"""LAMMPS: ``pair_style granular`` with Hertz, Mindlin's spring with history and any of its dampings."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from experiments.export.contact import Contact, Term, contacts_of, values
from experiments.export.exporter import ExportedTest, Exporter, Translation
from experiments.export.lammps_input import translate_lift
from experiments.export.laws import LawsOfCode, mechanism_warnings
from experiments.export.lift import Lift

CONVENTIONS = LawsOfCode(
    "LAMMPS",
    {
        "normal": {"hertz": "hertz/material"},
        "restitution": {"polynomial": "", "closed_form": "", "thornton": ""},
        "normal_damping": {
            "tsuji": "damping tsuji",
            "mass_velocity": "damping mass_velocity",
            "viscoelastic": "damping viscoelastic",
        },
        "attraction": {"free": "", "clamped": "limit_damping"},
        "tangential_damping": {"normal": "", "tsuji": "", "none": "", "deme": ""},
        "tangential_history": {
            "displacement": "mindlin",
            "force": "mindlin/force",
            "rescaled_displacement": "mindlin_rescale",
            "rescaled_force": "mindlin_rescale/force",
        },
        "sliding": {"sum": ""},
        "friction_load": {"size": ""},
        "rolling": {"sds": "rolling sds"},
    },
    {},
)
"""LAMMPS has all restitutions and tangential dampings: it is given the numbers that come to them."""

TSUJI = (4.8218, -18.022, 27.467, -22.348, 11.087, -4.2783, 1.2728)
"""Polynomial of the restitution that LAMMPS makes the coefficient of Tsuji's damping from."""

ROLLING_OVERLAP = 0.01
"""The spring that resists rolling is as stiff as a tangential one at this overlap, in radii."""

_SOURCE = "LAMMPS documentation, pair_style granular"


def contact_terms(contact: Contact) -> tuple[Term, ...]:
    """Terms of a contact, in the order of LAMMPS' words for it.

    Poisson's ratio is put in as 0. From E and v LAMMPS makes E* = E / 2 (1 - v^2), of walls
    E / 2 (1 - v) in some versions; without v both are E / 2.

    Raises
    ------
    ValueError
        If LAMMPS' polynomial does not reach the damping, see `tsuji_restitution`.
    """
    law = contact.coefficients
    spring = 8.0 * law.shear_modulus
    rolling = law.rolling_spring or spring * contact.radius * math.sqrt(2.0 * ROLLING_OVERLAP)
    # the tangential damping is given as a multiple of the normal one
    normal, share, multiple = _rate(contact), law.tangential_damping, "that of the laws"
    if contact.normal_damping == "tsuji":
        number = tsuji_restitution(law.damping)
        normal = Term("e", number, "1", "polynomial(e) = sqrt(3/2) x damping", _SOURCE)
        share, multiple = 2.0 * math.sqrt(law.shear_modulus / law.modulus) * share, "2 sqrt(G* / E*)"
    damping = law.rolling_dashpot or math.sqrt(rolling * contact.mass)
    stiffness = "8 G* R* sqrt(2 x overlap / R), at an overlap of 0.01 R"
    return (
        Term("E", 2.0 * law.modulus, "Pa", "2 E*", _SOURCE),
        normal,
        Term("nu", 0.0, "1", "0", _SOURCE),
        Term("k_t", spring, "Pa", "8 G*", _SOURCE),
        Term("x_gamma,t", share, "1", multiple, _SOURCE),
        Term("mu_s", law.static_friction, "1", "mu", _SOURCE),
        Term("k_roll", rolling, "N/m", stiffness, _SOURCE),
        Term("gamma_roll", damping, "kg/s", "sqrt(k_roll m*), half the critical damping", _SOURCE),
        Term("mu_roll", law.rolling_friction, "1", "mu_r", _SOURCE),
    )


def _rate(contact: Contact) -> Term:
    """Rate of a damping that the restitution takes no part in."""
    rate, source = contact.coefficients.damping, _SOURCE
    if contact.normal_damping == "viscoelastic":
        # ours is that of an area of 1 mm
        return Term("eta_n0", 1e3 * rate, "1/(m s)", "damping_rate / 1 mm", source)
    return Term("eta_n0", rate, "1/s", "damping_rate", source)


def granular_words(
    contact: Contact, words: Mapping[str, str] | None = None, surface_energy: float = 0.0
) -> str:
    """LAMMPS' words for a contact, after ``pair_coeff * *`` or ``wall/gran granular``.

    `words` are those for each law; left out, Mindlin's spring remembers its displacement and damping may
    attract. With a surface energy [J/m2] the contact adheres after Derjaguin, Muller and Toporov.
    """
    words = words or {"tangential_history": "mindlin", "attraction": "", "normal_damping": "damping tsuji"}
    terms = values(contact_terms(contact))
    damping = terms["e"] if "e" in terms else terms["eta_n0"]
    normal = f"hertz/material {terms['E']!r} {damping!r} 0"
    if surface_energy > 0.0:
        normal = f"dmt {terms['E']!r} {damping!r} 0 {surface_energy!r}"
    return (
        f"{normal} "
        f"tangential {words['tangential_history']} {terms['k_t']!r} {terms['x_gamma,t']!r} {terms['mu_s']!r} "
        f"rolling sds {terms['k_roll']!r} {terms['gamma_roll']!r} {terms['mu_roll']!r} "
        f"{words['attraction']} {words['normal_damping']}"
    ).replace("  ", " ")


def translate(test: ExportedTest) -> Translation:
    """Write the input of a lifted cylinder.

    Raises
    ------
    InputError
        When the test is another one.
    """
    lift, laws = Lift(test), test.case.laws
    words = CONVENTIONS.words(laws)
    case = replace(lift.case, mechanisms=(), laws=CONVENTIONS.nearest_laws(laws))
    among, tube = contacts_of(case, lift.largest_radius, max(t.mass for t in lift.templates))
    plate = replace(tube, coefficients=lift.scene.contacts(case)[2])
    contacts = [granular_words(contact, words) for contact in (among, tube, plate)]
    warnings = CONVENTIONS.warnings(laws) + mechanism_warnings(test.case, "LAMMPS")
    return translate_lift(lift, contacts, warnings, CONVENTIONS.translated(laws))


def tsuji_restitution(damping: float) -> float:
    """The number for a restitution from which LAMMPS comes to a given damping.

    LAMMPS damps with a sqrt(m* 4/3 E* sqrt(R* d)), a being a polynomial of it; dem-warp with a
    coefficient times sqrt(m* 2 E* sqrt(R* d)). At 0 the polynomial is 1.27, which damps as a restitution of
    0.11 does here: more is reached below 0. At 1 it is 3e-4, the least.

    Raises
    ------
    ValueError
        If the polynomial does not reach so far: for no restitution above 0.
    """
    from scipy.optimize import brentq

    def above(number: float) -> float:
        return float(np.polyval(TSUJI, number)) - math.sqrt(1.5) * damping

    if above(1.0) >= 0.0:
        return 1.0
    ends = (0.0, 1.0) if above(0.0) >= 0.0 else (-1.0, 0.0)
    return float(brentq(above, *ends))


LAMMPS = Exporter(
    "LAMMPS",
    "pair_style granular: hertz/material, tangential mindlin, rolling sds, damping",
    "Its resistance to rolling is a spring of its own with a slider; only the limit is the case's.",
    lambda material: (),  # LAMMPS has all terms by contact
    contact_terms,
    translate,
    CONVENTIONS,
)
