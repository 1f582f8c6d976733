"""Lifted cylinder for codes that a program drives: the same grains at the same places and times."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from dem_warp.model import WorldSetup
from dem_warp.scenes.lifted_cylinder import CLOGGED, GONE, LiftController
from dem_warp.scenes.phases import CALM
from dem_warp.scenes.poured_controller import HEAPED
from experiments.export.code_table import CodeTest
from experiments.export.exporter import Translation
from experiments.export.laws import Translated
from experiments.export.lift import LOOK, Lift
from experiments.export.lift_rows import lift_rows, lift_warnings
from experiments.export.sizes import sizes_text

SCRIPT, RAIN_FILE, TEST_FILE, HEAP = "lift.py", "rain.csv", "test.json", "heap.dump"

RAIN_HEAD = "shape,size,release_time,x,y,z,qx,qy,qz,qw"
"""Columns of the rain: number of the shape from 0, its scale, the time [s] at which the grain is released to
gravity and contacts, its centre then [m], and its orientation."""


def world_of(lift: Lift) -> WorldSetup:
    """Prepare the world of a case."""
    # a wrong study is answered before the simulator is loaded
    from dem_warp.device import resolve_device

    (world,) = lift.scene.prepare([lift.case], resolve_device(None))
    return world


def rain_text(world: WorldSetup) -> str:
    """Write the grains of a world, one a line, in the order of their release."""
    grains = world.grains
    times = grains.release_steps * world.time_step
    places = grains.positions + grains.velocities * times[:, None]
    table = np.column_stack([grains.shapes, grains.sizes, times, places, grains.orientations])
    order = np.argsort(times, kind="stable")
    rows = [",".join(f"{value:.9g}" for value in row) for row in table[order]]
    return "\n".join([RAIN_HEAD, *rows, ""])


def clump_texts(world: WorldSetup) -> dict[str, str]:
    """Write the spheres of every shape at size 1 [m], by file name, as DEM-Engine reads them too."""
    return {
        f"clump-{number}.csv": "\n".join(
            ["x,y,z,r", *(",".join(f"{value:.9g}" for value in row) for row in _spheres(shape)), ""]
        )
        for number, shape in enumerate(world.shapes, 1)
    }


def _spheres(shape: Any) -> np.ndarray:
    return np.column_stack([shape.centers, shape.radii])


def test_numbers(lift: Lift, world: WorldSetup) -> dict[str, Any]:
    """Return the numbers of the test but those of contacts and walls, in SI units."""
    density = lift.case.grain_material.density
    return {
        "time_step": world.time_step,
        "seed": lift.case.seed,
        "gravity": list(world.gravity),
        "skin": world.skin,
        "clumps": list(clump_texts(world)),
        "masses": [density * shape.volume for shape in world.shapes],
        "moments": [(density * shape.volume * shape.inertia_over_mass).tolist() for shape in world.shapes],
        "phases": phases(lift, world),
    }


def phases(lift: Lift, world: WorldSetup) -> dict[str, Any]:
    """Return the numbers of the phases of the test."""
    scene, release = lift.scene, world.grains.release_steps.max() * world.time_step
    return {
        "look": LOOK,
        "bottom": world.domain[0][2],
        "brim": scene.brim,
        "height": scene.height,
        "strike_off": scene.grain_count is None,
        "rain_speed": scene.rain_speed,
        "heaped": HEAPED,
        "fill_limit": release + LiftController.FILL_MARGIN,
        "settle_limit": LiftController.SETTLE_LIMIT,
        "rest_speed": scene.rest_speed,
        "calm": CALM,
        "rest_time": scene.rest_time,
        "lift_speed": scene.lift_speed,
        "lift_limit": scene.lift_time + LiftController.LIFT_MARGIN,
        "reach": float(world.bounding_radii.max()),
        "gone": GONE,
        "clogged": CLOGGED,
        "duration": scene.duration,
    }


def same_rain_files(world: WorldSetup) -> dict[str, str]:
    """Return the files of the rain and the clumps."""
    return {RAIN_FILE: rain_text(world), **clump_texts(world)}


def program_translation(
    test: CodeTest,
    world: WorldSetup,
    solver: str,
    command: tuple[str, ...],
    numbers: Mapping[str, Any],
    walls: Mapping[str, str] | None = None,
) -> Translation:
    """Write a Python program: its head, the course of the test and the template of a solver, with its files.

    `numbers` are those that it reads besides the test's, `walls` are texts of further files.
    """
    reads = f"Reads {TEST_FILE}, {RAIN_FILE} and the clumps; writes {HEAP}."
    about = f'"""Lifted cylinder in {test.exporter.code}. {reads}"""\n'
    files = {
        SCRIPT: about + template("course") + template(solver),
        TEST_FILE: json.dumps(test_numbers(test.lift, world) | dict(numbers), indent=1) + "\n",
        **same_rain_files(world),
        **(walls or {}),
    }
    return same_rain_translation(test, files, SCRIPT, command)


def same_rain_translation(
    test: CodeTest,
    files: Mapping[str, str],
    main: str,
    command: tuple[str, ...],
    comment: str = "#",
) -> Translation:
    """Return the translation of a test whose program places every grain as it is placed here."""
    return Translation(
        files=files,
        main=main,
        command=command,
        heap=HEAP,
        translated=(*same_rain_rows(test.lift), *test.rows, *test.notes),
        warnings=test.warnings + lift_warnings(test.lift, ends_in_time=True),
        comment=comment,
    )


@cache
def template(name: str) -> str:
    """Return the text of a part of a program."""
    return (files("experiments.export") / "templates" / f"{name}.txt").read_text(encoding="utf-8")


def same_rain_rows(lift: Lift) -> list[Translated]:
    """Return rows of the README on the test, with what only a program has as it is here."""
    scene, grains = lift.scene, lift.case.grains
    filled = f"{scene.grain_count} grains" if scene.grain_count else "to the rim, struck off there"
    filling = f"{filled}; {lift.given_rate:g} grains a second, {scene.rain_speed:g} m/s"
    changes = {
        "sizes": (sizes_text(grains), "the same grains, one by one"),
        "filling": (filling, "the same places, orientations and times, one by one"),
        "seed": (f"{lift.case.seed}", "the same rain; another seed is another export"),
        "end": (_end(lift), "the same"),
    }
    rows = lift_rows(lift)
    return [Translated(row.subject, *changes[row.subject]) if row.subject in changes else row for row in rows]


def _end(lift: Lift) -> str:
    scene = lift.scene
    if scene.duration is not None:
        return f"{scene.duration:g} s after the first grain"
    return (
        f"at rest: rms speed below {scene.rest_speed:g} m/s, none above {lift.calm_speed:g} m/s, for "
        f"{scene.rest_time:g} s"
    )
