"""Hopper in LIGGGHTS: its walls of triangles, and the plug that falls."""

from __future__ import annotations

import math

import numpy as np

from dem_warp.scenes.hopper import DEPTH
from experiments.export.hopper_text import FILLED_FILE, bin_top, discharge, part_rows
from experiments.export.laws import Translated
from experiments.export.lift import SIDES, Lift, disc, disc_corner, shell, stl_text
from experiments.export.liggghts_text import dump

FALL = DEPTH + 2.0
"""Fall of the plug over the bounding radius of the grains, as in our own hopper."""

_FALL = """\
fix fall all move/mesh mesh plug linear 0 0 -{speed:.9g}
run {fall}
unfix fall
# a mesh must not leave the box: the plug goes out of the stream, before the grains reach it
fix aside all move/mesh mesh plug linear {speed:.9g} 0 0
run {aside}
unfix aside
"""


def hopper_meshes(lift: Lift) -> dict[str, str]:
    """Return the files of the bin up to the rain, its floor or cone, and the plug in the outlet."""
    hopper = lift.scene
    wide, narrow = hopper.diameter / 2 / math.cos(math.pi / SIDES), disc_corner(hopper.outlet / 2)
    shoulder = np.array([0.0, 0.0, hopper.cone_height])
    walls = {
        "bin": shoulder + shell(wide, wide, bin_top(lift) - hopper.cone_height),
        "floor": shell(narrow, wide, hopper.cone_height),
        "plug": disc(hopper.outlet / 2),
    }
    return {f"{name}.stl": stl_text(name, triangles) for name, triangles in walls.items()}


def hopper_room(lift: Lift) -> tuple[float, float]:
    """Return half the width and the bottom of the box, with room for the plug next to the stream [m]."""
    reach = lift.reach
    return max(lift.scene.room(reach)[0], 1.5 * lift.scene.outlet + 3.0 * reach), -(FALL + 2.0) * reach


def hopper_opening(lift: Lift, quit: str) -> str:
    """Write the opening and the discharge, until rest."""
    speed = lift.scene.top_speed
    fall = _FALL.format(
        speed=speed,
        fall=lift.steps(FALL * lift.reach / speed),
        aside=lift.steps((lift.scene.outlet + lift.reach) / speed),
    )
    filled = dump("filled", FILLED_FILE, "type" if lift.is_of_spheres else "id_multisphere")
    return discharge(lift, filled, fall, quit)


def hopper_rows(lift: Lift) -> tuple[Translated, ...]:
    """Return the translation of the parts of the test."""
    polygon = f"polygons of {SIDES} sides: the bin's touch it from outside, the outlet's has its area"
    return part_rows(lift, polygon, "the same, then aside")
