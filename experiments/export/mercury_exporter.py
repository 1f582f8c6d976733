"""MercuryDPM: ``HertzianViscoelasticMindlinRollingTorsionSpecies``, as a driver in C++."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from dem_warp.model import WorldSetup
from experiments.export.code_table import CodeTest, code_exporter
from experiments.export.contact import Contact
from experiments.export.exporter import Translation
from experiments.export.lift import disc, prism
from experiments.export.same_rain import (
    phases,
    same_rain_files,
    same_rain_translation,
    template,
    test_numbers,
    world_of,
)

SOFTENING = 1.5
"""Mindlin's tangential spring over MercuryDPM's at the same modulus."""

SOURCE, HEADER = "lift.cpp", "test.h"

_CONTACT = """struct Contact
{
    double modulus, dissipation, shearModulus, slidingDissipation, slidingFriction, rollingFriction;
};"""


def contact_numbers(contact: Contact) -> dict[str, float]:
    """Calculate the terms that are no coefficients of ours."""
    law = contact.coefficients
    return {
        "Dissipation": math.sqrt(1.5) * law.damping,
        "EffectiveShearModulus": SOFTENING * law.shear_modulus,
        "SlidingDissipation": law.damping * law.tangential_damping / math.sqrt(SOFTENING),
    }


def translate(test: CodeTest) -> Translation:
    """Write the driver of a lifted cylinder and what it reads."""
    scene, world = test.lift.scene, world_of(test.lift)
    walls = {"tube.csv": prism(scene.diameter / 2, scene.height)}
    if scene.plate_diameter is not None:
        walls["plate.csv"] = disc(scene.plate_diameter / 2)
    texts = {SOURCE: template("mercury"), HEADER: _header(test, world)}
    files = texts | same_rain_files(world) | {name: _table(sides) for name, sides in walls.items()}
    return same_rain_translation(test, files, SOURCE, ("./lift",), comment="//")


def _header(test: CodeTest, world: WorldSetup) -> str:
    """Write the numbers of a test as constants of C++, in SI units."""
    lift = test.lift
    numbers, course = test_numbers(lift, world), phases(lift, world)
    look = max(round(course.pop("look") / world.time_step), 1)
    course["duration"] = course["duration"] or 0.0
    limit = course["fill_limit"] + course["settle_limit"] + course["lift_limit"]
    single = {
        "time_step": world.time_step,
        "time_limit": max(limit, course["duration"] + world.time_step),
        "look_steps": look,
        "density": lift.case.grain_material.density,
        "smallest": lift.case.grains.smallest_sphere,
        "largest": world.largest_sphere,
        "has_plane": lift.scene.plate_diameter is None,
        "shape_count": len(world.shapes),
        **course,
    }
    rows = ",\n    ".join(
        f"{{{', '.join(f'{value:.17g}' for value in one.values())}}}" for one in test.contact_values
    )
    names = ", ".join(f'"{name}"' for name in numbers["clumps"])
    lines = [
        "// Numbers of the test, in SI units; lift.cpp says what they are for.",
        "#pragma once\n\nnamespace test\n{",
        *(f"constexpr {_kind(value)} {_camel(name)} = {_written(value)};" for name, value in single.items()),
        _array("gravity", numbers["gravity"]),
        _array("low", world.domain[0]),
        _array("high", world.domain[1]),
        _array("masses", numbers["masses"]),
        f"constexpr double moments[][3] = {{{', '.join(_braced(row) for row in numbers['moments'])}}};",
        f"constexpr const char* clumps[] = {{{names}}};",
        _CONTACT,
        f"constexpr Contact contacts[] = {{\n    {rows}}};  // with grains, the tube, the plate",
        "}  // namespace test\n",
    ]
    return "\n".join(lines)


def _table(triangles: np.ndarray) -> str:
    rows = triangles.reshape(len(triangles), -1)
    return "".join(",".join(f"{value:.9g}" for value in row) + "\n" for row in rows)


def _array(name: str, values: Sequence[float]) -> str:
    return f"constexpr double {name}[] = {_braced(values)};"


def _braced(values: Sequence[float]) -> str:
    return f"{{{', '.join(f'{value:.17g}' for value in values)}}}"


def _camel(name: str) -> str:
    return re.sub("_(.)", lambda letter: letter[1].upper(), name)


def _kind(value: Any) -> str:
    return {bool: "bool", int: "int"}.get(type(value), "double")


def _written(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else f"{value:.17g}"


MERCURY = code_exporter("mercurydpm", translate, contact_numbers)
