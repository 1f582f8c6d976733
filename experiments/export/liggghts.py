"""LIGGGHTS: ``hertz`` with ``tangential history`` and ``rolling_friction epsd2`` or ``cdt``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from dem_warp import Material
from experiments.export.contact import Contact, Term, contacts_of, values
from experiments.export.exporter import ExportedTest, Exporter, Translation
from experiments.export.laws import LawsOfCode, mechanism_warnings
from experiments.export.lift import Lift
from experiments.export.liggghts_input import translate_lift

CONVENTIONS = LawsOfCode(
    "LIGGGHTS",
    {
        "normal": {"hertz": "hertz"},
        "restitution": {"closed_form": ""},
        "normal_damping": {"tsuji": ""},
        "attraction": {"free": "", "clamped": "limitForce on"},
        "tangential_damping": {"tsuji": "", "none": "tangential_damping off"},
        "tangential_history": {"displacement": "tangential history"},
        "sliding": {"spring_free": ""},
        "friction_load": {"size": ""},
        "rolling": {"epsd2": "rolling_friction epsd2", "cdt": "rolling_friction cdt"},
    },
    {"own_spin": "cdt", "own_spin_whole_step": "cdt", "relative_constant": "cdt"},
)

LAWS = "hertz tangential history rolling_friction cdt"
"""Laws of the peers' column."""

_HERTZ = "LIGGGHTS(R)-PUBLIC 3.8, gran model hertz"
_ROLLING = "LIGGGHTS(R)-PUBLIC 3.8, gran model rolling_friction"

_ORDER = ("normal", "tangential_history", "cohesion", "rolling", "tangential_damping", "attraction")
"""Order in which LIGGGHTS wants the words of its model."""


def material_terms(material: Material) -> tuple[Term, ...]:
    """Terms of a material, ``property/global NAME peratomtype``."""
    return (
        Term("youngsModulus", material.youngs_modulus, "Pa", "2 G (1 + v)", _HERTZ),
        Term("poissonsRatio", material.poisson_ratio, "1", "v", _HERTZ),
    )


def contact_terms(contact: Contact) -> tuple[Term, ...]:
    """Terms of a contact, ``property/global NAME peratomtypepair``."""
    surface = contact.surface
    return (
        Term("coefficientRestitution", surface.restitution, "1", "e", _HERTZ),
        Term("coefficientFriction", surface.static_friction, "1", "mu", _HERTZ),
        Term("coefficientRollingFriction", surface.rolling_friction, "1", "mu_r", _ROLLING),
    )


def model_words(words: Mapping[str, str]) -> str:
    """LIGGGHTS' words after ``model``, from those for each law."""
    return " ".join(words[law] for law in _ORDER if words.get(law))


def translate(test: ExportedTest) -> Translation:
    """Write the input of a lifted cylinder.

    Raises
    ------
    InputError
        When the test is another one.
    """
    lift, laws = Lift(test), test.case.laws
    words = CONVENTIONS.words(laws)
    model = model_words(words)
    warnings = CONVENTIONS.warnings(laws) + mechanism_warnings(test.case, "LIGGGHTS")
    return translate_lift(lift, model, _properties(lift), warnings, CONVENTIONS.translated(laws))


def _properties(lift: Lift) -> dict[str, str]:
    """Write the global properties of the types 1 (grains), 2 (tube) and 3 (plate)."""
    scene = lift.scene
    case = replace(lift.case, mechanisms=(), laws=CONVENTIONS.nearest_laws(lift.case.laws))
    among, tube = contacts_of(case, lift.largest_radius, max(t.mass for t in lift.templates))
    friction = scene.contacts(case)[2].static_friction
    plate = replace(tube, surface=replace(tube.surface, static_friction=friction))
    materials = [values(material_terms(each)) for each in (among.first, tube.second, tube.second)]
    written = {
        name: "peratomtype " + " ".join(f"{each[name]:.9g}" for each in materials) for name in materials[0]
    }
    pairs = [values(contact_terms(contact)) for contact in (among, tube, plate)]
    for name in pairs[0]:
        own, with_tube, with_plate = (f"{pair[name]:.9g}" for pair in pairs)
        # walls do not touch each other; LIGGGHTS wants their numbers none the less
        rows = ((own, with_tube, with_plate), (with_tube,) * 3, (with_plate, with_tube, with_plate))
        written[name] = "peratomtypepair 3 " + "  ".join(" ".join(row) for row in rows)
    return written


LIGGGHTS = Exporter(
    "LIGGGHTS",
    "gran model hertz, tangential history, rolling_friction epsd2 or cdt",
    "`cdt` acts for whole steps and may reverse a spin; `epsd2` is a spring without a dashpot.",
    material_terms,
    contact_terms,
    translate,
    CONVENTIONS,
)
