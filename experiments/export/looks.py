"""Looks at the grains in the language of LAMMPS and LIGGGHTS: what is watched, and the loop until rest."""

from __future__ import annotations

import math

from experiments.export.lift import LOOK, Lift

ROUNDING = 1e-9
"""Part of a look that is none, but the rounding of a quotient."""

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
thermo_style custom step atoms cpu c_fastest c_square c_heaped c_highest
thermo {look}
thermo_modify lost ignore norm no
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


def watched(lift: Lift) -> str:
    """Write what is watched: speeds, the highest sphere, and how many lie slow above the rim."""
    return _WATCHED.format(
        look=lift.steps(LOOK),
        strike=lift.strike,
        slow=0.5 * lift.scene.rain_speed,
        rest=lift.scene.rest_speed,
        calm=lift.calm_speed,
    )


def rest_loop(lift: Lift, name: str, limit: float, quit: str, look: int | None = None) -> str:
    """Write the loop until rest, which ends the program after a time limit [s].

    `quit` is the code's word for that, `look` the steps between two looks; left out, those of `watched`.
    """
    look_time = LOOK if look is None else look * lift.case.time_step
    return _REST.format(
        name=name,
        look=lift.steps(LOOK) if look is None else look,
        rest_time=lift.scene.rest_time,
        calm_looks=_count(lift.scene.rest_time / look_time),
        limit=limit,
        limit_looks=_count(limit / look_time),
        quit=quit,
    )


def _count(looks: float) -> int:
    return max(math.ceil(looks - ROUNDING), 1)
