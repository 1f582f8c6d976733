"""Yade: ``FrictMat``, ``Ip2_FrictMat_FrictMat_MindlinPhys`` and ``Law2_ScGeom_MindlinPhys_Mindlin``."""

from __future__ import annotations

import math
from dataclasses import replace

from dem_warp import Material
from experiments.export.contact import Contact, Term, contacts_of, values
from experiments.export.exporter import ExportedTest, Exporter, Translation
from experiments.export.laws import LawsOfCode, mechanism_warnings
from experiments.export.lift import Lift
from experiments.export.lift_rows import lift_warnings
from experiments.export.yade_input import translate_lift

CONVENTIONS = LawsOfCode(
    "Yade",
    {
        "normal": {"hertz": "hertzian=True on facets"},
        "restitution": {"thornton": "betan", "closed_form": "betan", "polynomial": "betan"},
        "normal_damping": {"tsuji": "betan"},
        "attraction": {"clamped": ""},
        "tangential_damping": {"tsuji": "betas", "none": "betas = 0", "normal": "betas", "deme": "betas"},
        "tangential_history": {"force": ""},
        "sliding": {"spring_free": ""},
        "friction_load": {"push": "", "size": ""},
        "rolling": {"yade": "includeMoment, MindlinPhys.kr and .maxBendPl"},
    },
    {},
)

_MATERIAL = "Yade documentation, FrictMat"
_PHYSICS = "Yade documentation, Ip2_FrictMat_FrictMat_MindlinPhys"
_BENDING = "Yade documentation, MindlinPhys; pkg/dem/HertzMindlin.cpp"


def material_terms(material: Material) -> tuple[Term, ...]:
    """Terms of a material."""
    return (
        Term("young", material.youngs_modulus, "Pa", "2 G (1 + v)", _MATERIAL),
        Term("poisson", material.poisson_ratio, "1", "v", _MATERIAL),
    )


def contact_terms(contact: Contact) -> tuple[Term, ...]:
    """Terms of a contact: those of the functor, and those of every contact's ``MindlinPhys``."""
    law = contact.coefficients
    return (
        *matched_terms(contact),
        Term("maxBendPl", law.rolling_friction, "1", "mu_r, times R*", _BENDING),
        Term("kr", law.rolling_spring, "N m/rad", "k R*^2", _BENDING),
    )


def matched_terms(contact: Contact) -> tuple[Term, ...]:
    """Terms of the functor, by ``MatchMaker``; ratios are of the critical damping 2 sqrt(S m*)."""
    law = contact.coefficients
    ratio = law.damping / 2.0
    return (
        Term("frictAngle", math.atan(law.static_friction), "rad", "atan mu", _PHYSICS),
        Term("betan", ratio, "1", "sqrt(5/6) |beta|", _PHYSICS),
        Term("betas", ratio * law.tangential_damping, "1", "sqrt(5/6) |beta|", _PHYSICS),
    )


def translate(test: ExportedTest) -> Translation:
    """Write the program of a lifted cylinder.

    Raises
    ------
    InputError
        When the test is another one.
    """
    lift, laws = Lift(test), test.case.laws
    case = replace(lift.case, mechanisms=(), laws=CONVENTIONS.nearest_laws(laws))
    scene = lift.scene
    warnings = (
        CONVENTIONS.warnings(laws)
        + mechanism_warnings(test.case, "Yade")
        + lift_warnings(lift, ends_in_time=True)
    )
    among, tube = contacts_of(case, lift.largest_radius, max(t.mass for t in lift.templates))
    plate = replace(tube, coefficients=scene.contacts(case)[2])
    materials = [values(material_terms(each)) for each in (among.first, tube.second, plate.second)]
    contacts = [values(contact_terms(each)) for each in (among, tube, plate)]
    return translate_lift(lift, materials, contacts, warnings, CONVENTIONS.translated(laws))


YADE = Exporter(
    "Yade",
    "MindlinPhys, Law2_ScGeom_MindlinPhys_Mindlin",
    "No attraction; forces are remembered, not displacements; rolling is resisted by a spring, undamped.",
    material_terms,
    contact_terms,
    translate,
    CONVENTIONS,
)
