"""Drum in LIGGGHTS and LAMMPS: its walls, and its turn with a look at all grains every now and then."""

from __future__ import annotations

import math

import numpy as np

from experiments.export import lammps_text, liggghts_text
from experiments.export.hopper_text import FILLED_FILE
from experiments.export.laws import Translated
from experiments.export.lift import LOOK, Lift, disc, prism, stl_text
from experiments.export.lift_rows import end_rows, filling_rows

DRUM, TURNED_FILE = "drum.in", "turned.dump"
"""Main file, and dump of the turning drum, with a frame for each look."""

SHELL_SIDES = 180
"""Sides of the prism around the shell; its edges are 0.02 % of the radius outside the cylinder."""

LOOKS = 250
"""Most looks at the turning drum, so that the dump stays small."""

_LIGGGHTS_MOVE = """\
fix turn_{wall} all move/mesh mesh {wall} rotate origin 0 0 {radius:.9g} axis 0 1 0 period {period:.9g}
"""

_LAMMPS_WALLS = """
# walls
variable turn equal 0.0
region drum cylinder y 0 {radius:.9g} {radius:.9g} -{half:.9g} {half:.9g} &
    rotate v_turn 0 0 {radius:.9g} 0 1 0
fix drum all wall/gran/region granular {words} region drum
"""

_LAMMPS_MOVE = """\
variable begin equal step
variable start equal ${{begin}}
variable turn equal "(step - v_start) * {step_turn:.12g}"
"""

_TURN = """
# turn, and after the start-up look at the grains
{opening}run {start_up}
dump looks all custom {look} looks.txt id {body} x y z radius
dump_modify looks sort id format {form}
run {turn}
undump looks
shell mv looks.txt {turned}
"""


def drum_meshes(lift: Lift) -> dict[str, str]:
    """Return the files of the shell and the two ends, which reach beyond its corners."""
    # a primitive ycylinder of LIGGGHTS 3.8 with shear moves towards the grains where it should turn
    radius, length = lift.scene.diameter / 2, lift.scene.length
    shell = prism(radius, length, SHELL_SIDES)
    end = disc(radius / math.cos(math.pi / SHELL_SIDES), SHELL_SIDES)
    walls = {"shell": shell, "front": end, "back": end + np.array([0.0, 0.0, length])}
    along_y = {name: triangles[..., [1, 2, 0]] for name, triangles in walls.items()}
    first = np.array([0.0, -length / 2, radius])
    return {f"{name}.stl": stl_text(name, first + each) for name, each in along_y.items()}


def liggghts_turning(lift: Lift) -> str:
    """Write the turn of the filled drum for LIGGGHTS."""
    drum, body = lift.scene, "type" if lift.is_of_spheres else "id_multisphere"
    numbers = {"radius": drum.diameter / 2, "period": 1.0 / drum.rotation_rate}
    moves = "".join(_LIGGGHTS_MOVE.format(wall=wall, **numbers) for wall in ("shell", "front", "back"))
    filled = liggghts_text.dump("filled", FILLED_FILE, body)
    return _turning(lift, filled + moves, body, '"%d %d %.7g %.7g %.7g %.9g"')


def lammps_drum(lift: Lift, words: str) -> str:
    """Write the walls of the drum for LAMMPS, which turn by a variable."""
    return _LAMMPS_WALLS.format(words=words, radius=lift.scene.diameter / 2, half=lift.scene.length / 2)


def lammps_turning(lift: Lift) -> str:
    """Write the turn of the filled drum for LAMMPS."""
    body, step_turn = "type" if lift.is_of_spheres else "mol", lift.scene.spin * lift.case.time_step
    filled = lammps_text.dump(FILLED_FILE, f"id {body}")
    return _turning(lift, filled + _LAMMPS_MOVE.format(step_turn=step_turn), body, "float %.7g")


def _turning(lift: Lift, opening: str, body: str, form: str) -> str:
    drum = lift.scene
    window = drum.revolutions / drum.rotation_rate
    look = lift.steps(max(LOOK, window / LOOKS))
    # the first look may begin the measuring, and the last must not come before its end
    looks = math.ceil(window / (look * lift.case.time_step)) + 2
    return _TURN.format(
        opening=opening,
        start_up=lift.steps(drum.start_up / drum.rotation_rate),
        look=look,
        body=body,
        form=form,
        turn=looks * look,
        turned=TURNED_FILE,
    )


def drum_rows(lift: Lift, exact: bool = False) -> tuple[Translated, ...]:
    """Return the translation of the parts of the test."""
    drum = lift.scene
    prism = f"prism of {SHELL_SIDES} sides that touch it from outside"
    measured = f"{drum.start_up:g} revolutions, then measured for {drum.revolutions:g}"
    schedule = f"{drum.rotation_rate:g} 1/s from rest; {measured}"
    _, *rows = end_rows(lift)
    return (
        *filling_rows(lift),
        Translated("shell and ends", "cylinder and discs", "the same" if exact else prism),
        Translated("turn", schedule, schedule),
        *rows,
    )
