"""Hopper in LAMMPS and LIGGGHTS: the outlet that opens while what is in it is weighed."""

from __future__ import annotations

import math

from dem_warp import ClumpShape
from dem_warp.scenes.discharge import DischargeController
from dem_warp.scenes.hopper import OVER_OUTLET
from experiments.export.laws import Translated
from experiments.export.lift import LOOK, Lift
from experiments.export.lift_rows import end_rows, filling_rows
from experiments.export.script_text import rest_loop

HOPPER, FILLED_FILE, DISCHARGE_FILE = "hopper.in", "filled.dump", "discharge.txt"
"""Main file, dump of the filled hopper, and the weighed discharge: seconds since the opening, kilograms that
are still above the floor, spheres over the middle of the outlet, all spheres above the floor."""

WEIGHED = " c_inside c_over c_stay"
"""Words of the log that keep these sums up to date."""

SLOWEST = 20.0
"""Longest discharge over that by the law of Beverloo for grains of size 0."""

_SUMS = """
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
{filled}variable now equal step
variable opened equal ${{now}}
variable since equal "(step - v_opened) * {time_step:.9g}"
variable mass equal c_inside
variable middle equal c_over
variable left equal c_stay
fix looks all print {look} "${{since}} ${{mass}} ${{middle}} ${{left}}" &
    file looks.txt screen no title "# s kg 1 1"
{opening}{rest}unfix looks
shell mv looks.txt {discharge}
"""


def bin_top(lift: Lift) -> float:
    """Return the height up to which the bin holds the rain [m]."""
    return lift.rain_bottom + lift.rain_height + lift.reach


def sums(lift: Lift) -> str:
    """Write the sums that are weighed."""
    [shape] = lift.case.grains.mixture.shapes
    return _SUMS.format(
        middle=(OVER_OUTLET * lift.scene.outlet) ** 2,
        weight=lift.case.grain_material.density * volume_share(shape),
    )


def volume_share(shape: ClumpShape) -> float:
    """Return the volume of a clump over the sum of its spheres' cubed radii: each has its part of it."""
    return shape.volume / float((shape.radii**3).sum())


def discharge(lift: Lift, filled: str, opening: str, quit: str) -> str:
    """Write the discharge until rest; `filled` and `opening` dump the spheres and open the outlet."""
    hopper = lift.scene
    beverloo = hopper.volume / (0.5 * math.sqrt(math.hypot(*hopper.gravity)) * hopper.outlet**2.5)
    return _OPEN.format(
        filled=filled,
        discharge=DISCHARGE_FILE,
        time_step=lift.case.time_step,
        look=lift.steps(LOOK),
        opening=opening,
        rest=rest_loop(lift, "rest", quit, limit=SLOWEST * beverloo + DischargeController.SETTLE_LIMIT),
    )


def part_rows(lift: Lift, walls: str, opening: str) -> tuple[Translated, ...]:
    """Return the translation of the parts of the test; `walls` and `opening` are those of the code."""
    return (
        *filling_rows(lift),
        Translated("bin, floor and outlet", "cylinder, cone or ring, disc", walls),
        Translated("opening", f"the plug falls at {lift.scene.top_speed:.3g} m/s", opening),
        *end_rows(lift),
    )
