"""Hopper in LAMMPS: its walls are the open faces of regions, and the plug is taken away."""

from __future__ import annotations

from experiments.export.hopper_text import FILLED_FILE, bin_top, discharge, part_rows, sums
from experiments.export.lammps_text import QUIT, dump
from experiments.export.laws import Translated
from experiments.export.lift import Lift
from experiments.io.errors import InputError

FLAT = 1e-9
"""Height of the cone that is a flat floor [m]."""

_WALLS = """
# walls: both sides of an open face are walls, with its rims
region bin cylinder z 0 0 {wide:.9g} {shoulder:.9g} {top:.9g} open 1 open 2
region floor cone z 0 0 {narrow:.9g} {wide:.9g} 0 {rise:.9g} open 1 open 2
region plug cylinder z 0 0 {narrow:.9g} -{reach:.9g} 0 side out open 1
fix bin all wall/gran/region granular {bin_words} region bin
fix floor all wall/gran/region granular {floor_words} region floor
fix plug all wall/gran/region granular {floor_words} region plug
"""


def hopper_walls(lift: Lift, bin_words: str, floor_words: str) -> str:
    """Write the walls, and the sums that are weighed.

    Raise InputError for an outlet where LAMMPS would divide by zero.
    """
    hopper = lift.scene
    if lift.largest_radius >= hopper.outlet:
        # it counts half the curvature of the rim in
        rule = f"the outlet must be wider than the radius {lift.largest_radius:.4g} m of a sphere in LAMMPS"
        raise InputError(lift.test.source, rule, f"{hopper.outlet:g} m")
    walls = _WALLS.format(
        wide=hopper.diameter / 2,
        narrow=hopper.outlet / 2,
        shoulder=hopper.cone_height,
        rise=hopper.cone_height or FLAT,
        top=bin_top(lift),
        reach=lift.reach,
        bin_words=bin_words,
        floor_words=floor_words,
    )
    return walls + sums(lift)


def hopper_opening(lift: Lift) -> str:
    """Write the opening and the discharge, until rest."""
    filled = dump(FILLED_FILE, "id type" if lift.is_of_spheres else "id mol type")
    return discharge(lift, filled, "unfix plug\n", QUIT)


def hopper_rows(lift: Lift) -> tuple[Translated, ...]:
    """Return the translation of the parts of the test."""
    flat = "" if lift.scene.cone_height else f"; the ring is a cone {FLAT:g} m high"
    return part_rows(lift, f"the same{flat}", "the plug is gone at once")
