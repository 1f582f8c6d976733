"""Terms of Yade: ``FrictMat`` and ``Ip2_FrictMat_FrictMat_MindlinPhys``."""

from __future__ import annotations

import math

from dem_warp import Material
from experiments.export.contact import Contact, Term
from experiments.export.exporter import Exporter

_MATERIAL = "Yade documentation, FrictMat"
_PHYSICS = "Yade documentation, Ip2_FrictMat_FrictMat_MindlinPhys"


def material_terms(material: Material) -> tuple[Term, ...]:
    """Terms of a material."""
    return (
        Term("young", material.youngs_modulus, "Pa", "2 G (1 + v)", _MATERIAL),
        Term("poisson", material.poisson_ratio, "1", "v", _MATERIAL),
    )


def contact_terms(contact: Contact) -> tuple[Term, ...]:
    """Terms of a contact, by ``MatchMaker``; ratios are of the critical damping 2 sqrt(S m*)."""
    law = contact.coefficients
    ratio = law.damping / 2.0
    return (
        Term("frictAngle", math.atan(law.static_friction), "rad", "atan mu", _PHYSICS),
        Term("betan", ratio, "1", "sqrt(5/6) |beta|", _PHYSICS),
        Term("betas", ratio * law.tangential_damping, "1", "sqrt(5/6) |beta|", _PHYSICS),
    )


YADE = Exporter(
    "Yade",
    "MindlinPhys, Law2_ScGeom_MindlinPhys_Mindlin",
    "Resistance to rolling is left out: Yade's is a spring without damping, in which grains go on to swing.",
    material_terms,
    contact_terms,
)
