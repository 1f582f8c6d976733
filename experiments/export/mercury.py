"""MercuryDPM: ``HertzianViscoelasticMindlinRollingTorsionSpecies``."""

from __future__ import annotations

import math
from dataclasses import replace

from dem_warp import Material
from experiments.export.contact import Contact, Term, contacts_of, values
from experiments.export.exporter import ExportedTest, Exporter, Translation
from experiments.export.laws import LawsOfCode, mechanism_warnings
from experiments.export.lift import Lift
from experiments.export.lift_rows import lift_warnings
from experiments.export.mercury_input import translate_lift

CONVENTIONS = LawsOfCode(
    "MercuryDPM",
    {
        "normal": {"hertz": "HertzianViscoelastic"},
        "restitution": dict.fromkeys(("closed_form", "polynomial", "thornton"), "setDissipation"),
        "normal_damping": {"tsuji": ""},
        "attraction": {"free": ""},
        "tangential_damping": dict.fromkeys(("tsuji", "normal", "deme", "none"), "setSlidingDissipation"),
        "tangential_history": {"displacement": "Mindlin"},
        "sliding": {"spring_free": ""},
        "friction_load": {"size": ""},
        "rolling": {"epsd2": "RollingTorsion; its spring is 1.5 times as stiff"},
    },
    {},
)

SOFTENING = 1.5
"""Its tangential spring is 2/3 of Mindlin's at the same modulus."""

_NORMAL = "MercuryDPM 1.0.0 alpha, HertzianViscoelasticInteraction.cc"
_TANGENTIAL = "MercuryDPM 1.0.0 alpha, MindlinInteraction.cc"
_ROLLING = "MercuryDPM 1.0.0 alpha, MindlinRollingTorsionInteraction.cc"


def contact_terms(contact: Contact) -> tuple[Term, ...]:
    """Terms of a contact, those of a mixed species."""
    law = contact.coefficients
    sliding = law.damping * law.tangential_damping / math.sqrt(SOFTENING)
    return (
        Term("EffectiveElasticModulus", law.modulus, "Pa", "E*", _NORMAL),
        Term("Dissipation", math.sqrt(1.5) * law.damping, "1", "sqrt(5) |beta|", _NORMAL),
        Term("EffectiveShearModulus", SOFTENING * law.shear_modulus, "Pa", "3/2 G*", _TANGENTIAL),
        Term("SlidingDissipation", sliding, "1", "sqrt(20/9) |beta|", _TANGENTIAL),
        Term("SlidingFrictionCoefficient", law.static_friction, "1", "mu", _TANGENTIAL),
        Term("RollingFrictionCoefficient", law.rolling_friction, "1", "mu_r", _ROLLING),
    )


def no_terms(material: Material) -> tuple[Term, ...]:
    """Terms of a material: none, as all belong to contacts."""
    return ()


def translate(test: ExportedTest) -> Translation:
    """Write the driver of a lifted cylinder.

    Raises
    ------
    InputError
        When the test is another one.
    """
    lift, laws = Lift(test), test.case.laws
    case = replace(lift.case, mechanisms=(), laws=CONVENTIONS.nearest_laws(laws))
    warnings = (
        CONVENTIONS.warnings(laws)
        + mechanism_warnings(test.case, "MercuryDPM")
        + lift_warnings(lift, ends_in_time=True)
    )
    among, tube = contacts_of(case, lift.largest_radius, max(t.mass for t in lift.templates))
    plate = replace(tube, coefficients=lift.scene.contacts(case)[2])
    contacts = [values(contact_terms(each)) for each in (among, tube, plate)]
    return translate_lift(lift, contacts, warnings, CONVENTIONS.translated(laws))


MERCURY = Exporter(
    "MercuryDPM",
    "HertzianViscoelasticMindlinRollingTorsionSpecies",
    "Beyond Coulomb's limit the spring alone is held; the spring of rolling has no dashpot.",
    no_terms,
    contact_terms,
    translate,
    CONVENTIONS,
    "This driver has not been run in MercuryDPM yet.",
)
