"""Rocky: a sheet of values under the names of its dialogs. Nothing of it has been run there."""

from __future__ import annotations

from dataclasses import replace

from dem_warp import Material
from experiments.export.contact import Contact, Term, contacts_of
from experiments.export.exporter import ExportedTest, Exporter, Translation
from experiments.export.laws import LawsOfCode, mechanism_warnings
from experiments.export.lift import Lift
from experiments.export.sheet import Entry, sheet_translation, size_entries, term_entries

CONVENTIONS = LawsOfCode(
    "Rocky",
    {
        "normal": {"hertz": "Hertzian Spring Dashpot"},
        "restitution": {"closed_form": ""},
        "normal_damping": {"tsuji": ""},
        "attraction": {"free": ""},
        "tangential_damping": {"tsuji": ""},
        "tangential_history": {"displacement": "Mindlin-Deresiewicz"},
        "sliding": {"spring": ""},
        "friction_load": {"push": ""},
        "rolling": {"rocky_3": "Type C: Linear Spring Rolling Limit", "own_spin": "Type A: Constant Moment"},
    },
    {"own_spin_whole_step": "own_spin"},
)

_SOURCE = "Ansys Rocky, DEM Technical Manual"


def material_terms(material: Material) -> tuple[Term, ...]:
    """Terms of a material, under Materials."""
    return (
        Term("Density", material.density, "kg/m3", "rho, of the solid", _SOURCE),
        Term("Young's Modulus", material.youngs_modulus, "Pa", "2 G (1 + v)", _SOURCE),
        Term("Poisson's Ratio", material.poisson_ratio, "1", "v", _SOURCE),
    )


def contact_terms(contact: Contact) -> tuple[Term, ...]:
    """Terms of a contact, under Materials Interactions; the last is entered with the particle."""
    surface = contact.surface
    return (
        Term("Static Friction", surface.static_friction, "1", "mu", _SOURCE),
        Term("Dynamic Friction", surface.static_friction, "1", "mu", _SOURCE),
        Term("Restitution Coefficient", surface.restitution, "1", "e", _SOURCE),
        Term("Rolling Resistance", surface.rolling_friction, "1", "mu_r", _SOURCE),
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
        *term_entries("Materials: grain", material_terms(among.first)),
        *term_entries("Materials: wall", material_terms(wall.second)),
        *term_entries("Materials Interactions: grain with grain", contact_terms(among)),
        *term_entries("Materials Interactions: grain with wall", contact_terms(wall)),
        Entry("Physics, Momentum", "Normal Force", words["normal"]),
        Entry("Physics, Momentum", "Tangential Force", words["tangential_history"]),
        Entry("Physics, Momentum", "Rolling Resistance Model", words["rolling"]),
        Entry("Physics, Momentum", "Numerical Softening Factor", "1 (the modulus above is softened)"),
        Entry("Particles", "Shape: Sphero-composite of spheres", "spheres.csv", "mm"),
        *size_entries(lift, "Particles, Size", ("mean", "standard deviation", "smallest", "largest")),
        Entry("Solver", "Fixed Timestep", f"{case.time_step:.6g}", "s"),
    ]
    return sheet_translation(lift, "Rocky", entries, CONVENTIONS.translated(laws), _warnings(test))


def _warnings(test: ExportedTest) -> tuple[str, ...]:
    case = test.case
    pairs = (case.grain_grain.rolling_friction, case.grain_wall.rolling_friction)
    one = "Rolling Resistance is one number a particle: enter that of grain with grain"
    several = (
        (f"{one}, {pairs[0]:g}; that of grain with wall is {pairs[1]:g}",) if len(set(pairs)) > 1 else ()
    )
    return CONVENTIONS.warnings(case.laws) + several + mechanism_warnings(case, "Rocky")


ROCKY = Exporter(
    "Rocky",
    "Hertzian Spring Dashpot, Mindlin-Deresiewicz, rolling resistance of Type C or A",
    "Its tangential spring is another, as said above.",
    material_terms,
    contact_terms,
    translate,
    CONVENTIONS,
    "This sheet has not been run in Rocky: names and meanings are those of its manual. Its tangential spring "
    "(Mindlin-Deresiewicz) softens as a contact is about to slide, ours does not.",
)
