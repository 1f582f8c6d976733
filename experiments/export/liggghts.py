"""Terms of LIGGGHTS: ``hertz`` with ``tangential history`` and ``rolling_friction cdt``."""

from __future__ import annotations

from dem_warp import Material
from experiments.export.contact import Contact, Term
from experiments.export.exporter import Exporter

LAWS = "hertz tangential history rolling_friction cdt"

_HERTZ = "LIGGGHTS(R)-PUBLIC 3.8, gran model hertz"
_CDT = "LIGGGHTS(R)-PUBLIC 3.8, gran model rolling_friction cdt"


def material_terms(material: Material) -> tuple[Term, ...]:
    """Terms of a material, ``property/global NAME peratomtype``."""
    return (
        Term("youngsModulus", material.youngs_modulus, "Pa", "2 G (1 + v)", _HERTZ),
        Term("poissonsRatio", material.poisson_ratio, "1", "v", _HERTZ),
    )


def contact_terms(contact: Contact) -> tuple[Term, ...]:
    """Terms of a contact, ``property/global NAME peratomtypepair``.

    Raises
    ------
    ValueError
        When the tangential spring is not damped, as that of these laws is.
    """
    if not contact.coefficients.tangential_damping:
        raise ValueError(f"contact: {LAWS!r} damps the tangential spring, got one without damping")
    surface = contact.surface
    return (
        Term("coefficientRestitution", surface.restitution, "1", "e", _HERTZ),
        Term("coefficientFriction", surface.static_friction, "1", "mu", _HERTZ),
        Term("coefficientRollingFriction", surface.rolling_friction, "1", "mu_r", _CDT),
    )


LIGGGHTS = Exporter(
    "LIGGGHTS",
    LAWS,
    "Its resistance to rolling acts for whole steps and may reverse a spin.",
    material_terms,
    contact_terms,
)
