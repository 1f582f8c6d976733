"""The lifted cylinder as a Python program of Yade."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from experiments.export.exporter import Translated, Translation
from experiments.export.lift import Lift, disc, prism
from experiments.export.lift_rows import lift_rows
from experiments.export.same_rain import (
    HEAP,
    RAIN_FILE,
    TEST_FILE,
    clump_texts,
    program,
    rain_text,
    same_rain_rows,
    test_numbers,
    world_of,
)

SCRIPT = "lift.py"


def translate_lift(
    lift: Lift,
    materials: Sequence[dict[str, float]],
    contacts: Sequence[dict[str, float]],
    warnings: tuple[str, ...],
    laws: Sequence[Translated],
) -> Translation:
    """Write the program and what it reads.

    Parameters
    ----------
    lift
        The test.
    materials, contacts
        Terms of the grains, the tube and the plate, and of their contacts with grains.
    warnings, laws
        What Yade lacks of the contact laws, and the rows of the README on them.
    """
    scene, world = lift.scene, world_of(lift)
    plate = None if scene.plate_diameter is None else disc(scene.plate_diameter / 2).tolist()
    numbers: dict[str, Any] = test_numbers(lift, world) | {
        "materials": list(materials),
        "contacts": list(contacts),
        "tube": prism(scene.diameter / 2, scene.height).tolist(),
        "plate": plate,
    }
    files = {
        SCRIPT: program("Yade", "yade"),
        TEST_FILE: json.dumps(numbers, indent=1) + "\n",
        RAIN_FILE: rain_text(world),
        **clump_texts(world),
    }
    return Translation(
        files=files,
        main=SCRIPT,
        command=("yade", "-n", "-x", "-j1", SCRIPT),
        heap=HEAP,
        translated=(*same_rain_rows(lift_rows(lift), _changes(lift)), *laws, *_ROWS),
        warnings=warnings,
    )


_ROWS = (
    Translated(
        "clumps",
        "rigid, mass properties of the union of the spheres",
        "`appendClumped` of spheres without a mass and a member without a surface that has mass and moments; "
        "both are checked. The spheres' own `state.mass` is the grain's: the damping takes it from there",
    ),
    Translated(
        "edges of the tube's facets", "none", "a sphere over an edge touches both facets, each with a history of its own"
    ),
    Translated("numerical damping", "none", "none: `NewtonIntegrator(damping=0)`, whose default is 0.2"),
    Translated(
        "contact point", "in the middle of the overlap", "the same; on the endless plate, the plane itself"
    ),
)


def _changes(lift: Lift) -> dict[str, tuple[str, str]]:
    """What the program has as it is here, and other inputs have not."""
    scene, grains = lift.scene, lift.case.grains
    sizes = f"{grains.size_mean:g} +- {grains.size_sd:g} of the shape, normal, cut at 3 sd"
    filled = f"{scene.grain_count} grains" if scene.grain_count else "to the rim, struck off there"
    filling = f"{filled}; {scene.rain_rate:g} grains a second, {scene.rain_speed:g} m/s"
    return {
        "sizes": (sizes, "the same grains, one by one"),
        "filling": (filling, "the same places, orientations and times, one by one"),
        "seed": (f"{lift.case.seed}", "the same rain; another seed is another export"),
    }
