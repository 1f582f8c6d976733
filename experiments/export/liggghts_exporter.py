"""LIGGGHTS: ``hertz`` with ``tangential history`` and ``rolling_friction epsd2`` or ``cdt``."""

from __future__ import annotations

from collections.abc import Sequence

from dem_warp import Drum, Hopper, LiftedCylinder
from experiments.export import liggghts_text as text
from experiments.export.code_table import CodeTest, code_exporter, code_laws
from experiments.export.drum import (
    TURNED_FILE,
    drum_meshes,
    drum_rows,
    liggghts_drum,
    liggghts_turning,
)
from experiments.export.exporter import Translation
from experiments.export.hopper_text import DISCHARGE_FILE, HOPPER, WEIGHED, bin_top
from experiments.export.laws import Translated
from experiments.export.lift import LOOK, Lift, disc, prism, stl_text
from experiments.export.lift_rows import lift_rows, lift_warnings
from experiments.export.liggghts_hopper import (
    hopper_meshes,
    hopper_opening,
    hopper_room,
    hopper_rows,
    hopper_walls,
)
from experiments.export.script_text import HEAP_FILE, Rain, clear_loop, fill_loop, rest_loop, watched

INPUT, TUBE_FILE, PLATE_FILE = "lift.in", "tube.stl", "plate.stl"

_QUIT = "quit"
"""Command that ends a program that has failed."""

_FILL_COUNT = """
# until all grains are in
run {steps}
unfix rain
"""

_LIFT = """
# lift, until the tube is clear of the heap
fix lift all move/mesh mesh tube linear 0 0 {speed}
variable rise equal 0
{loop}unfix lift
"""

_END = f"""
dump heap all custom 1 {HEAP_FILE} id type x y z radius
dump_modify heap sort id format "%d %d %.9g %.9g %.9g %.9g"
run 0
undump heap
"""


def translate(test: CodeTest) -> Translation:
    """Write the input of a lifted cylinder, a hopper or a drum, and its meshes."""
    if isinstance(test.lift.scene, Hopper):
        return _hopper(test)
    if isinstance(test.lift.scene, Drum):
        return _drum(test)
    lift, scene = test.lift, test.lift.scene
    files = {TUBE_FILE: stl_text("tube", prism(scene.diameter / 2, scene.height))}
    if scene.plate_diameter is not None:
        files[PLATE_FILE] = stl_text("plate", disc(scene.plate_diameter / 2))
    model = text.model_words(test.words)
    half_width, _, bottom = scene.room(lift.reach)
    types, room = ("grains", "tube", "plate"), (half_width, bottom)
    setup = _setup(test, model, types, room, 2.0 * scene.height, _walls(lift, model))
    files[INPUT] = "".join([setup, watched(lift), *_filling(lift), *_lifting(lift)])
    bodies = "`fix nve/sphere`" if lift.is_of_spheres else "`fix multisphere`, mass and inertia given"
    rows = (*test.rows, *lift_rows(lift), Translated("grains", "clumps, rigid", bodies))
    warnings = test.warnings + lift_warnings(lift)
    return Translation(files, INPUT, ("liggghts", "-in", INPUT), HEAP_FILE, rows, warnings)


def _hopper(test: CodeTest) -> Translation:
    lift, model = test.lift, text.model_words(test.words)
    walls = hopper_walls(lift, model)
    setup = _setup(test, model, ("grains", "bin", "floor"), hopper_room(lift), bin_top(lift), walls)
    parts = [setup, watched(lift, more=WEIGHED), *_filling(lift), hopper_opening(lift, _QUIT)]
    files = {HOPPER: "".join(parts)} | hopper_meshes(lift)
    rows, warnings = (*test.rows, *hopper_rows(lift)), test.warnings + lift_warnings(lift)
    return Translation(files, HOPPER, ("liggghts", "-in", HOPPER), DISCHARGE_FILE, rows, warnings)


def _drum(test: CodeTest) -> Translation:
    lift, model, input = test.lift, text.model_words(test.words), "drum.in"
    half_x, half_y, bottom = lift.scene.room(lift.reach)
    room, types = (max(half_x, half_y), bottom), ("grains", "shell", "ends")
    setup = _setup(test, model, types, room, lift.scene.diameter, liggghts_drum(lift, model))
    parts = [setup, watched(lift), *_filling(lift), liggghts_turning(lift)]
    files = {input: "".join(parts)} | drum_meshes(lift)
    rows, warnings = (*test.rows, *drum_rows(lift)), test.warnings + lift_warnings(lift)
    return Translation(files, input, ("liggghts", "-in", input), TURNED_FILE, rows, warnings)


def _setup(
    test: CodeTest,
    model: str,
    types: Sequence[str],
    room: tuple[float, float],
    highest: float,
    walls: str,
) -> str:
    lift, scene = test.lift, test.lift.scene
    half_width, bottom = room
    rain_top = lift.rain_bottom + lift.rain_height
    top = max(rain_top, highest) + 2.0 * lift.reach
    among, tube, plate = test.contact_values

    def contact(i: int, j: int) -> text.Numbers:
        # walls do not touch each other, but LIGGGHTS wants numbers for them
        return (among, tube, plate)[max(i, j) if min(i, j) == 0 or i == j else 1]

    rain = Rain(
        lift.rain_section,
        lift.rain_bottom - lift.reach,
        rain_top,
        lift.count,
        lift.rain_rate,
        lift.steps(lift.rain_period),
        scene.rain_speed,
    )
    kinds = [(template, template.fraction, 1) for template in lift.templates]
    parts = [
        text.head(
            types,
            (-half_width, half_width, -half_width, half_width, bottom, top),
            lift.skin,
            2.0 * lift.largest_radius + lift.skin,
        ),
        "\n# contacts\n",
        text.contacts(text.properties(test.material_values, contact), model, lift.case.time_step),
        text.weight(scene.gravity),
        f"\n# walls\n{walls}\n",
        f"# filling: {rain.rate:.6g} grains a second, {rain.count} of them\n",
        text.pouring(kinds, rain, lift.seeds(2 + len(kinds))),
    ]
    return "".join(parts)


def _walls(lift: Lift, model: str) -> str:
    plate, meshes = f"wall/gran model {model} primitive type 3 zplane 0.0", "1 meshes tube"
    if lift.scene.plate_diameter is not None:
        plate, meshes = f"mesh/surface file {PLATE_FILE} type 3", "2 meshes tube plate"
    bodies = "motion all nve/sphere" if lift.is_of_spheres else "bodies all multisphere"
    return (
        f"fix tube all mesh/surface file {TUBE_FILE} type 2\nfix plate all {plate}\n"
        f"fix walls all wall/gran model {model} mesh n_meshes {meshes}\n\nfix {bodies}\n"
    )


def _filling(lift: Lift) -> list[str]:
    settle = rest_loop(lift, "settle", _QUIT)
    if lift.scene.grain_count is not None:
        steps = lift.steps(lift.count / lift.rain_rate + lift.rain_period)
        return [_FILL_COUNT.format(steps=steps), settle]
    above = "delete_atoms region above compress no\n"
    return [
        f"region above block INF INF INF INF {lift.strike:.6g} INF units box\n",
        "\n# until grains are heaped above the rim; what stands above it is struck off\n",
        fill_loop(lift, str(lift.steps(LOOK)), _QUIT),
        above,
        settle,
        above,
    ]


def _lifting(lift: Lift) -> list[str]:
    scene, look = lift.scene, lift.steps(LOOK)
    rise = look * lift.case.time_step * scene.lift_speed
    looks = max(round(scene.lift_time / LOOK), 1)
    loop = clear_loop(look, looks, lift.largest_radius, f"variable rise equal ${{rise}}+{rise:.9g}\n")
    lifting = _LIFT.format(speed=scene.lift_speed, loop=loop)
    return [lifting, rest_loop(lift, "rest", _QUIT), _END]


LIGGGHTS = code_exporter("liggghts", translate, kinds=(LiftedCylinder, Hopper, Drum))

CONVENTIONS = code_laws("liggghts")
"""Contact laws that it has."""
