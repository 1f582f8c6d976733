"""EDEM: a sheet of values under the names of its dialogs. Nothing of it has been run there."""

from __future__ import annotations

from dataclasses import replace

from dem_warp import Material
from experiments.export.contact import Contact, Term, contacts_of
from experiments.export.exporter import ExportedTest, Exporter, Translation
from experiments.export.laws import LawsOfCode, mechanism_warnings
from experiments.export.lift import Lift
from experiments.export.sheet import Entry, sheet_translation, size_entries, term_entries

CONVENTIONS = LawsOfCode(
    "EDEM",
    {
        "normal": {"hertz": "Hertz-Mindlin (no slip)"},
        "restitution": {"closed_form": ""},
        "normal_damping": {"tsuji": ""},
        "attraction": {"free": ""},
        "tangential_damping": {"tsuji": ""},
        "tangential_history": {"displacement": ""},
        "sliding": {"spring": ""},
        "friction_load": {"push": ""},
        "rolling": {
            "own_spin": "Standard Rolling Friction",
            "elastic_plastic": "Type C",
            "edem_rvd": "RVD Rolling Friction",
        },
    },
    # what resists the relative roll is nearer to Type C than to a torque on each spin
    dict.fromkeys(("relative_constant", "cdt", "epsd2", "sds", "rocky_3", "yade", "deme"), "elastic_plastic"),
)

TYPE_C_STIFFNESS = 2.25
"""Factor of the rolling spring in Type C, which has no entry."""

_SOURCE = "EDEM documentation, Hertz-Mindlin (no slip)"
_TYPE_C = "EDEM documentation, Type C Rolling Friction"


def material_terms(material: Material) -> tuple[Term, ...]:
    """Terms of a material, under Bulk Material or Equipment Material."""
    return (
        Term("Solids Density", material.density, "kg/m3", "rho", _SOURCE),
        Term("Shear Modulus", material.shear_modulus, "Pa", "G", _SOURCE),
        Term("Poisson's Ratio", material.poisson_ratio, "1", "v", _SOURCE),
    )


def contact_terms(contact: Contact) -> tuple[Term, ...]:
    """Terms of a contact, under Interaction; the ratio belongs to Type C, the only one with a spring."""
    surface, law = contact.surface, contact.coefficients
    ratio = Term("Rolling Viscous Damping Ratio", law.rolling_dashpot, "1", "eta", _TYPE_C)
    return (
        Term("Coefficient of Restitution", surface.restitution, "1", "e", _SOURCE),
        Term("Coefficient of Static Friction", surface.static_friction, "1", "mu", _SOURCE),
        Term("Coefficient of Rolling Friction", surface.rolling_friction, "1", "mu_r", _SOURCE),
        *((ratio,) if law.rolling_spring else ()),
    )


def translate(test: ExportedTest) -> Translation:
    """Write the sheet of a lifted cylinder.

    Raises
    ------
    InputError
        When the test is another one.
    """
    lift, laws = Lift(test), test.case.laws
    case = replace(lift.case, mechanisms=(), laws=CONVENTIONS.nearest_laws(laws))
    among, wall = contacts_of(case, lift.largest_radius, max(t.mass for t in lift.templates))
    words = CONVENTIONS.words(laws)
    entries = [
        *term_entries("Bulk Material", material_terms(among.first)),
        *term_entries("Equipment Material", material_terms(wall.second)),
        *term_entries("Interaction: grain with grain", contact_terms(among)),
        *term_entries("Interaction: grain with equipment", contact_terms(wall)),
        Entry("Physics, particle to particle and to geometry", "Base Model", words["normal"]),
        Entry("Physics, particle to particle and to geometry", "Rolling Friction", words["rolling"]),
        Entry("Particle", "Spheres: X, Y, Z, Physical Radius", "spheres.csv", "mm"),
        *size_entries(
            lift, "Particle, Size Distribution: Normal", ("Mean", "Std. Dev.", "Capped, Min", "Capped, Max")
        ),
        Entry("Simulator", "Fixed Time Step", f"{case.time_step:.6g}", "s"),
    ]
    return sheet_translation(lift, "EDEM", entries, CONVENTIONS.translated(laws), _warnings(test))


def _warnings(test: ExportedTest) -> tuple[str, ...]:
    laws, stiffness = test.case.laws, test.case.laws.rolling_stiffness
    has_spring = CONVENTIONS.taken(laws)["rolling"] == "elastic_plastic"
    other = (
        f"law rolling_stiffness = {stiffness:g}: EDEM's Type C has {TYPE_C_STIFFNESS:g}, and no entry for it"
    )
    lacking = (other,) if has_spring and stiffness != TYPE_C_STIFFNESS else ()
    return CONVENTIONS.warnings(laws) + lacking + mechanism_warnings(test.case, "EDEM")


EDEM = Exporter(
    "EDEM",
    "Hertz-Mindlin (no slip) with Standard, Type C or RVD Rolling Friction",
    "The formulas are those of its manual.",
    material_terms,
    contact_terms,
    translate,
    CONVENTIONS,
    "This sheet has not been run in EDEM: names and meanings are those of its manual.",
)
