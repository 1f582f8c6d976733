"""Terms of LAMMPS: ``pair_style granular`` with Hertz, Mindlin's spring with history and Tsuji's damping."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from experiments.export.contact import Contact, Term, values
from experiments.export.exporter import Exporter

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
        If LAMMPS' polynomial does not reach the damping.
    """
    law = contact.coefficients
    spring = 8.0 * law.shear_modulus
    rolling = spring * contact.radius * math.sqrt(2.0 * ROLLING_OVERLAP)
    # the tangential damping is given as a multiple of the normal one
    share = 2.0 * math.sqrt(law.shear_modulus / law.modulus) * law.tangential_damping
    damping = math.sqrt(rolling * contact.mass)
    stiffness = "8 G* R* sqrt(2 x overlap / R), at an overlap of 0.01 R"
    return (
        Term("E", 2.0 * law.modulus, "Pa", "2 E*", _SOURCE),
        Term("e", tsuji_restitution(law.damping), "1", "polynomial(e) = sqrt(3/2) x damping", _SOURCE),
        Term("nu", 0.0, "1", "0", _SOURCE),
        Term("k_t", spring, "Pa", "8 G*", _SOURCE),
        Term("x_gamma,t", share, "1", "2 sqrt(G* / E*)", _SOURCE),
        Term("mu_s", law.static_friction, "1", "mu", _SOURCE),
        Term("k_roll", rolling, "N/m", stiffness, _SOURCE),
        Term("gamma_roll", damping, "kg/s", "sqrt(k_roll m*), half the critical damping", _SOURCE),
        Term("mu_roll", law.rolling_friction, "1", "mu_r", _SOURCE),
    )


def granular_words(contact: Contact) -> str:
    """LAMMPS' words for a contact, after ``pair_coeff * *`` or ``wall/gran granular``."""
    terms = values(contact_terms(contact))
    return (
        f"hertz/material {terms['E']!r} {terms['e']!r} 0 "
        f"tangential mindlin {terms['k_t']!r} {terms['x_gamma,t']!r} {terms['mu_s']!r} "
        f"rolling sds {terms['k_roll']!r} {terms['gamma_roll']!r} {terms['mu_roll']!r} damping tsuji"
    )


def tsuji_restitution(damping: float) -> float:
    """The restitution from which LAMMPS comes to a given damping.

    LAMMPS damps with a sqrt(m* 4/3 E* sqrt(R* d)), a being a polynomial of it; dem-warp with a
    coefficient times sqrt(m* 2 E* sqrt(R* d)).

    Raises
    ------
    ValueError
        If the polynomial does not reach so far.
    """
    return float(brentq(lambda e: np.polyval(TSUJI, e) - math.sqrt(1.5) * damping, 0.0, 1.0))


LAMMPS = Exporter(
    "LAMMPS",
    "pair_style granular: hertz/material, tangential mindlin, rolling sds, damping tsuji",
    "Its resistance to rolling is a spring of its own with a slider; only the limit is the case's.",
    lambda material: (),  # LAMMPS has all terms by contact
    contact_terms,
)
