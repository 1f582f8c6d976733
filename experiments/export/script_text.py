"""Parts that inputs of LAMMPS and LIGGGHTS share: monitored quantities and loops over looks."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from dem_warp.scenes.lifted_cylinder import LiftController
from dem_warp.scenes.poured_controller import HEAPED
from dem_warp.scenes.rain import CrossSection
from experiments.export.lift import LOOK, Lift

HEAP_FILE = "heap.dump"
"""Dump of the final heap."""

ROUNDING = 1e-9
"""Rounding error of a quotient of times, in looks."""

_WATCHED = """\
# grains are looked at every {look} steps
variable speed atom sqrt(vx*vx+vy*vy+vz*vz)
variable square atom vx*vx+vy*vy+vz*vz
variable above atom "z > {strike:.6g} && v_speed < {slow:.6g}"
compute fastest all reduce max v_speed
compute square all reduce ave v_square
compute heaped all reduce sum v_above
compute highest all reduce max z
variable heaped equal c_heaped
variable moving equal "sqrt(c_square) > {rest:.6g} || c_fastest > {calm:.6g}"
thermo_style custom step atoms cpu c_fastest c_square c_heaped c_highest{more}
thermo {look}
thermo_modify lost ignore norm no
"""

_FILL_COUNT = """
# until all grains are in
run {steps}
unfix rain
"""

_FILL = """\
variable looks loop {looks}
label fill
run {run}
if "${{heaped}} >= {heaped}" then "jump SELF full"
next looks
jump SELF fill
print "ERROR: the filling did not end within {limit:.6g} s"
{quit}
label full
variable looks delete
unfix rain
"""

_CLEAR = """\
variable clear equal "v_rise > c_highest + {clearance:.6g}"
variable looks loop {looks}
label lift
run {look}
{rise}if "${{clear}} == 1" then "jump SELF lifted"
next looks
jump SELF lift
label lifted
variable looks delete
"""

_REST = """
# until the grains have been slow for {rest_time} s
variable looks loop {limit_looks}
variable calm equal 0
label {name}
run {look}
if "${{moving}} == 1" then "variable calm equal 0" else "variable calm equal ${{calm}}+1"
if "${{calm}} >= {calm_looks}" then "jump SELF {name}_done"
next looks
jump SELF {name}
print "ERROR: no rest within {limit:.6g} s"
{quit}
label {name}_done
variable looks delete
"""


@dataclass(frozen=True)
class Rain:
    """Space, number and rate of the grains that are poured."""

    section: CrossSection
    bottom: float
    top: float
    """Opening, and lower and upper end of the space that they are put in [m]."""
    count: int
    rate: float
    """Grains a second."""
    steps: int
    """Steps between two insertions."""
    speed: float
    """Speed downwards [m/s]."""


def plain(numbers: Iterable[float], digits: int = 9) -> str:
    """Write numbers with spaces between, each with some significant digits."""
    return " ".join(f"{number:.{digits}g}" for number in numbers)


def space_words(section: CrossSection, bottom: float, top: float, margin: float = 0.0) -> str:
    """Write the space between two heights, a margin within an opening [m], as a region of both codes."""
    x, y = (half - margin for half in section.half_sides)
    sides = f"cylinder z 0 0 {x:.6g}" if section.is_round else f"block {plain((-x, x, -y, y), 6)}"
    return f"{sides} {bottom:.6g} {top:.6g}"


def watched(lift: Lift, look: int | None = None, more: str = "") -> str:
    """Write the monitored quantities: speeds, the highest sphere, and the slow ones above the rim.

    `look` is the number of steps between two looks; default: that of `LOOK`; `more`
    are further words of the log.
    """
    return _WATCHED.format(
        more=more,
        look=look or lift.steps(LOOK),
        strike=lift.strike,
        slow=0.5 * lift.scene.rain_speed,
        rest=lift.scene.rest_speed,
        calm=lift.calm_speed,
    )


def fill_loop(lift: Lift, run: str, quit: str) -> str:
    """Write the loop until grains are heaped above the rim; `run` are the words of one look."""
    return _FILL.format(
        looks=max(round(lift.fill_limit / LOOK), 1),
        run=run,
        heaped=HEAPED * min(template.shape.sphere_count for template in lift.templates),
        limit=lift.fill_limit,
        quit=quit,
    )


def filling(lift: Lift, quit: str, steps: int, to_rim: str, whole: str = "") -> str:
    """Write the filling, until rest: the steps that a number of grains needs, or the text of one to the rim.

    `whole` are the words that strike off all spheres of a grain.
    """
    settle = rest_loop(lift, "settle", quit)
    if lift.scene.grain_count is not None:
        return _FILL_COUNT.format(steps=steps) + settle
    above = f"delete_atoms region above compress no{whole}\n"
    return to_rim + above + settle + above


def clear_loop(look: int, looks: int, clearance: float, rise: str = "") -> str:
    """Write the loop until the tube is clear of the heap.

    `look` are the steps between two looks, `rise` is the line that moves the variable of that name.
    """
    return _CLEAR.format(look=look, looks=looks, clearance=clearance, rise=rise)


def rest_loop(lift: Lift, name: str, quit: str, look: int | None = None, limit: float | None = None) -> str:
    """Write the loop until rest after the filling, ``settle``, or after the lift, ``rest``.

    At its time limit [s] the program ends by the command `quit`; `look` as in `watched`.
    """
    look_time = LOOK if look is None else look * lift.case.time_step
    own = LiftController.SETTLE_LIMIT if name == "settle" else LiftController.LIFT_MARGIN
    limit = limit or own
    return _REST.format(
        name=name,
        look=look or lift.steps(LOOK),
        rest_time=lift.scene.rest_time,
        calm_looks=_count(lift.scene.rest_time / look_time),
        limit=limit,
        limit_looks=_count(limit / look_time),
        quit=quit,
    )


def _count(looks: float) -> int:
    return max(math.ceil(looks - ROUNDING), 1)
