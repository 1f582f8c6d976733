"""Yade: ``MindlinPhys`` and ``Law2_ScGeom_MindlinPhys_Mindlin``, driven by a Python program."""

from __future__ import annotations

import math

from experiments.export.code_table import CodeTest, code_exporter
from experiments.export.contact import Contact
from experiments.export.exporter import Translation
from experiments.export.lift import disc, prism
from experiments.export.same_rain import SCRIPT, program_translation, world_of


def translate(test: CodeTest) -> Translation:
    """Write the program of a lifted cylinder and what it reads."""
    scene, world = test.lift.scene, world_of(test.lift)
    numbers = {
        "materials": test.material_values,
        "contacts": test.contact_values,
        "domain": world.domain,
        "tube": prism(scene.diameter / 2, scene.height).tolist(),
        "plate": None if scene.plate_diameter is None else disc(scene.plate_diameter / 2).tolist(),
    }
    return program_translation(test, world, "yade", ("yade", "-n", "-x", "-j1", SCRIPT), numbers)


def contact_numbers(contact: Contact) -> dict[str, float]:
    """Calculate the terms of the functor; ratios are of the critical damping 2 sqrt(S m*)."""
    law = contact.coefficients
    ratio = law.damping / 2.0
    return {
        "frictAngle": math.atan(law.static_friction),
        "betan": ratio,
        "betas": ratio * law.tangential_damping,
    }


YADE = code_exporter("yade", translate, contact_numbers)
