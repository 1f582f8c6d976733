"""LIGGGHTS: ``hertz`` with ``tangential history`` and ``rolling_friction epsd2`` or ``cdt``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from dem_warp import Drum, Hopper, LiftedCylinder
from experiments.export import liggghts_text as text
from experiments.export.code_table import CodeTest, code_exporter, code_laws
from experiments.export.drum import DRUM, TURNED_FILE, drum_meshes, drum_rows, liggghts_turning
from experiments.export.exporter import Translation
from experiments.export.hopper_text import DISCHARGE_FILE, HOPPER, WEIGHED, bin_top, sums
from experiments.export.laws import Translated
from experiments.export.lift import LOOK, Lift, disc, prism, stl_text
from experiments.export.lift_rows import lift_rows
from experiments.export.liggghts_hopper import hopper_meshes, hopper_opening, hopper_room, hopper_rows
from experiments.export.script_text import HEAP_FILE, Rain, clear_loop, fill_loop, filling, rest_loop, watched

INPUT = "lift.in"

_QUIT = "quit"
"""Command that ends a program that has failed."""

_FILL_TO_RIM = """\
region above block INF INF INF INF {strike:.6g} INF units box

# until grains are heaped above the rim; what stands above it is struck off
{loop}"""

_LIFT = """
# lift, until the tube is clear of the heap
fix lift all move/mesh mesh tube linear 0 0 {speed}
variable rise equal 0
{loop}unfix lift
"""


def translate(test: CodeTest) -> Translation:
    """Write the input of a lifted cylinder, a hopper or a drum, and its meshes."""
    if isinstance(test.lift.scene, Hopper):
        return _hopper(test)
    if isinstance(test.lift.scene, Drum):
        return _drum(test)
    lift, scene = test.lift, test.lift.scene
    files = {"tube.stl": stl_text("tube", prism(scene.diameter / 2, scene.height))}
    plane = "fix plate all wall/gran model {model} primitive type 3 zplane 0.0\n"
    if scene.plate_diameter is not None:
        files["plate.stl"], plane = stl_text("plate", disc(scene.plate_diameter / 2)), ""
    half_width, _, bottom = scene.room(lift.reach)
    types, room = ("grains", "tube", "plate"), (half_width, bottom)
    setup = _setup(test, types, room, 2.0 * scene.height, files, plane)
    bodies = "`fix nve/sphere`" if lift.is_of_spheres else "`fix multisphere`, mass and inertia given"
    rows = (*lift_rows(lift), Translated("grains", "clumps, rigid", bodies))
    return test.script("liggghts", {INPUT: setup + _lifting(lift)} | files, HEAP_FILE, rows)


def _hopper(test: CodeTest) -> Translation:
    lift, files, types = test.lift, hopper_meshes(test.lift), ("grains", "bin", "floor")
    setup = _setup(test, types, hopper_room(lift), bin_top(lift), files, weighed=sums(lift), watch=WEIGHED)
    files = {HOPPER: setup + hopper_opening(lift, _QUIT)} | files
    return test.script("liggghts", files, DISCHARGE_FILE, hopper_rows(lift))


def _drum(test: CodeTest) -> Translation:
    lift, files, types = test.lift, drum_meshes(test.lift), ("grains", "shell", "ends")
    half_x, half_y, bottom = lift.scene.room(lift.reach)
    setup = _setup(test, types, (max(half_x, half_y), bottom), lift.scene.diameter, files)
    files = {DRUM: setup + liggghts_turning(lift)} | files
    return test.script("liggghts", files, TURNED_FILE, drum_rows(lift))


def _setup(
    test: CodeTest,
    types: Sequence[str],
    room: tuple[float, float],
    highest: float,
    meshes: Iterable[str],
    plane: str = "",
    weighed: str = "",
    watch: str = "",
) -> str:
    lift, scene, model = test.lift, test.lift.scene, text.model_words(test.words)
    bodies = "motion all nve/sphere" if lift.is_of_spheres else "bodies all multisphere"
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
        f"\n# walls\n{_walls(meshes, model, plane)}\nfix {bodies}\n{weighed}\n",
        f"# filling: {rain.rate:.6g} grains a second, {rain.count} of them\n",
        text.pouring(kinds, rain, lift.seeds(2 + len(kinds))),
        watched(lift, more=watch),
        _filling(lift),
    ]
    return "".join(parts)


def _walls(meshes: Iterable[str], model: str, plane: str) -> str:
    """Write walls of files of triangles, the first of type 2 and the others of type 3, and of a plane."""
    names = [mesh.removesuffix(".stl") for mesh in meshes]
    files = (f"fix {name} all mesh/surface file {name}.stl type {2 + (name != names[0])}\n" for name in names)
    walls = f"fix walls all wall/gran model {model} mesh n_meshes {len(names)} meshes {' '.join(names)}\n"
    return "".join(files) + plane.format(model=model) + walls


def _filling(lift: Lift) -> str:
    to_rim = _FILL_TO_RIM.format(strike=lift.strike, loop=fill_loop(lift, str(lift.steps(LOOK)), _QUIT))
    return filling(lift, _QUIT, lift.steps(lift.count / lift.rain_rate + lift.rain_period), to_rim)


def _lifting(lift: Lift) -> str:
    scene, look = lift.scene, lift.steps(LOOK)
    rise = look * lift.case.time_step * scene.lift_speed
    looks = max(round(scene.lift_time / LOOK), 1)
    loop = clear_loop(look, looks, lift.largest_radius, f"variable rise equal ${{rise}}+{rise:.9g}\n")
    lifting = _LIFT.format(speed=scene.lift_speed, loop=loop)
    return lifting + rest_loop(lift, "rest", _QUIT) + "\n" + text.dump("heap", HEAP_FILE)


LIGGGHTS = code_exporter("liggghts", translate, kinds=(LiftedCylinder, Hopper, Drum))

CONVENTIONS = code_laws("liggghts")
"""Contact laws that it has."""
