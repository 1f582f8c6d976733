"""DEM-Engine (package ``deme``): its frictional Hertzian model."""

from __future__ import annotations

import math
from dataclasses import replace

from dem_warp import Material
from experiments.export.contact import Contact, Term, contacts_of, values
from experiments.export.deme_input import translate_lift
from experiments.export.exporter import ExportedTest, Exporter, Translation
from experiments.export.laws import LawsOfCode, mechanism_warnings
from experiments.export.lift import Lift
from experiments.export.lift_rows import lift_warnings

CONVENTIONS = LawsOfCode(
    "DEM-Engine",
    {
        "normal": {"overlap_circle": ""},
        "restitution": {"closed_form": "CoR"},
        "normal_damping": {"tsuji": ""},
        "attraction": {"free": ""},
        "tangential_damping": {"deme": ""},
        "tangential_history": {"displacement": ""},
        "sliding": {"sum": ""},
        "friction_load": {"size": ""},
        "rolling": {"deme": "Crr"},
    },
    {},
)

_MODEL = "DEM-Engine 3.0.19, FullHertzianForceModel.cu"


def material_terms(material: Material) -> tuple[Term, ...]:
    """Terms of a material."""
    return (
        Term("E", material.youngs_modulus, "Pa", "2 G (1 + v)", _MODEL),
        Term("nu", material.poisson_ratio, "1", "v", _MODEL),
    )


def contact_terms(contact: Contact) -> tuple[Term, ...]:
    """Terms of a contact, by ``SetMaterialPropertyPair``."""
    surface, law = contact.surface, contact.coefficients
    return (
        Term("CoR", surface.restitution, "1", "e", _MODEL),
        Term("mu", law.static_friction, "1", "mu", _MODEL),
        Term("Crr", law.rolling_friction, "1", "mu_r", _MODEL),
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
        + mechanism_warnings(test.case, "DEM-Engine")
        + lift_warnings(lift, ends_in_time=True)
    )
    among, tube = contacts_of(case, lift.largest_radius, max(t.mass for t in lift.templates))
    plate = replace(tube, coefficients=scene.contacts(case)[2])
    # its contact radius is that of the circle of overlap, sqrt(2) times Hertz's where spheres are equal
    stiffening = math.sqrt(2.0) if laws.normal == "hertz" else 1.0
    materials = [
        {"E": terms["E"] / stiffening, "nu": terms["nu"], "CoR": 0.5, "mu": 0.0, "Crr": 0.0}
        for terms in (values(material_terms(each)) for each in (among.first, tube.second, plate.second))
    ]
    contacts = [values(contact_terms(each)) for each in (among, tube, plate)]
    return translate_lift(lift, materials, contacts, warnings, CONVENTIONS.translated(laws))


DEME = Exporter(
    "DEM-Engine",
    "FullHertzianForceModel",
    "The contact radius is that of the overlap's circle; rolling resists what rotation moves surfaces at.",
    material_terms,
    contact_terms,
    translate,
    CONVENTIONS,
    "Tubes on an endless plate were run in DEM-Engine 3.0.19; a round plate has not been run in DEM-Engine.",
)
