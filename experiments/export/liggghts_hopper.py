"""Hopper in LIGGGHTS: its walls, and the outlet that opens while what is in it is weighed."""

from __future__ import annotations

import math

import numpy as np

from dem_warp import ClumpShape
from dem_warp.scenes.discharge import DischargeController
from dem_warp.scenes.hopper import OVER_OUTLET
from experiments.export.laws import Translated
from experiments.export.lift import LOOK, SIDES, Lift, disc, disc_corner, shell, stl_text
from experiments.export.lift_rows import end_rows, filling_rows
from experiments.export.script_text import rest_loop

FILLED_FILE, DISCHARGE_FILE = "filled.dump", "discharge.txt"
"""Dump of the filled hopper, and the weighed discharge: seconds since the opening, kilograms that are still
above the floor, spheres over the middle of the outlet, all spheres above the floor."""

WEIGHED = " c_inside c_over c_stay"
"""Words of the log that keep these sums up to date."""

FALL = 8.0
"""Fall of the plug over the bounding radius of the grains, as in our own hopper."""

SLOWEST = 20.0
"""Longest discharge over that by the law of Beverloo for grains of size 0."""

_WALLS = """\
fix bin all mesh/surface file bin.stl type 2
fix floor all mesh/surface file floor.stl type 3
fix plug all mesh/surface file plug.stl type 3
fix walls all wall/gran model {model} mesh n_meshes 3 meshes bin floor plug

fix {bodies}

# spheres above the floor: their share of the mass, number, and number over the middle of the outlet
compute radius all property/atom radius
variable inside atom "{weight:.9g} * c_radius * c_radius * c_radius * (z >= 0)"
variable stay atom "z >= 0"
variable over atom "(z >= 0) * (x*x+y*y < {middle:.9g})"
compute inside all reduce sum v_inside
compute stay all reduce sum v_stay
compute over all reduce sum v_over
"""

_OPEN = """
# open the outlet, and weigh what is above it at every look
dump filled all custom 1 {filled} id {body} x y z radius
dump_modify filled sort id format "%d %d %.9g %.9g %.9g %.9g"
run 0
undump filled
variable now equal step
variable opened equal ${{now}}
variable since equal "(step - v_opened) * {time_step:.9g}"
variable mass equal c_inside
variable middle equal c_over
variable left equal c_stay
fix looks all print {look} "${{since}} ${{mass}} ${{middle}} ${{left}}" &
    file looks.txt screen no title "# s kg 1 1"
fix fall all move/mesh mesh plug linear 0 0 -{speed:.9g}
run {fall}
unfix fall
# a mesh must not leave the box: the plug goes out of the stream, before the grains reach it
fix aside all move/mesh mesh plug linear {speed:.9g} 0 0
run {aside}
unfix aside
{rest}unfix looks
shell mv looks.txt {discharge}
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


def bin_top(lift: Lift) -> float:
    """Return the height up to which the bin holds the rain [m]."""
    return lift.rain_bottom + lift.rain_height + lift.reach


def hopper_walls(lift: Lift, model: str) -> str:
    """Write the walls, and the sums that are weighed."""
    [shape] = lift.case.grains.mixture.shapes
    return _WALLS.format(
        model=model,
        middle=(OVER_OUTLET * lift.scene.outlet) ** 2,
        bodies="motion all nve/sphere" if lift.is_of_spheres else "bodies all multisphere",
        weight=lift.case.grain_material.density * volume_share(shape),
    )


def volume_share(shape: ClumpShape) -> float:
    """Return the volume of a clump over the sum of its spheres' cubed radii: each has its part of it."""
    return shape.volume / float((shape.radii**3).sum())


def hopper_opening(lift: Lift, quit: str) -> str:
    """Write the opening and the discharge, until rest."""
    hopper = lift.scene
    beverloo = hopper.volume / (0.5 * math.sqrt(math.hypot(*hopper.gravity)) * hopper.outlet**2.5)
    speed = hopper.top_speed
    limit = SLOWEST * beverloo + DischargeController.SETTLE_LIMIT
    return _OPEN.format(
        filled=FILLED_FILE,
        body="type" if lift.is_of_spheres else "id_multisphere",
        discharge=DISCHARGE_FILE,
        time_step=lift.case.time_step,
        look=lift.steps(LOOK),
        speed=speed,
        fall=lift.steps(FALL * lift.reach / speed),
        aside=lift.steps((hopper.outlet + lift.reach) / speed),
        rest=rest_loop(lift, "rest", quit, limit=limit),
    )


def hopper_rows(lift: Lift) -> tuple[Translated, ...]:
    """Return the translation of the parts of the test."""
    polygon = f"polygons of {SIDES} sides: the bin's touch it from outside, the outlet's has its area"
    return (
        *filling_rows(lift),
        Translated("bin, floor and outlet", "cylinder, cone or ring, disc", polygon),
        Translated("opening", f"the plug falls at {lift.scene.top_speed:.3g} m/s", "the same, then aside"),
        *end_rows(lift),
    )
