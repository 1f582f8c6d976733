"""The lifted cylinder as an input of LIGGGHTS."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from experiments.export.exporter import Translation
from experiments.export.lift import LOOK, Lift, Template, disc, prism, stl_text
from experiments.export.lift_rows import lift_rows, lift_warnings
from experiments.export.looks import rest_loop, watched
from experiments.export.translated import Translated

INPUT, HEAP, TUBE_FILE, PLATE_FILE = "lift.in", "heap.dump", "tube.stl", "plate.stl"

_QUIT = "quit"
"""End of a program that has failed."""

_SETUP = """\
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
hard_particles yes
soft_particles yes  # a softened modulus is meant so
region box block {low:.6g} {high:.6g} {low:.6g} {high:.6g} {bottom:.6g} {top:.6g} units box
create_box 3 box  # types: 1 grains, 2 tube, 3 plate
neighbor {skin:.6g} bin
neigh_modify delay 0 every 1 check yes binsize {bin:.6g}

# contacts
{properties}
pair_style gran model {laws}
pair_coeff * *
timestep {time_step:.9g}
fix weight all gravity {gravity} vector {direction}

# walls
fix tube all mesh/surface file tube.stl type 2
{plate}
{bodies}
# filling: {rate:.6g} grains a second, {count} of them
{templates}
fix sizes all particledistribution/discrete/numberbased {sizes_seed} {template_count} {fractions}
region rain cylinder z 0 0 {rain_radius:.6g} {rain_bottom:.6g} {rain_top:.6g} units box
fix rain all insert/rate/region seed {rain_seed} distributiontemplate sizes &
    nparticles {count} particlerate {rate:.6g} insert_every {rain_steps} overlapcheck yes all_in yes &
    maxattempt 500 vel constant 0 0 -{rain_speed} orientation random region rain ntry_mc 10000

"""

_FILL_TO_RIM = """
# until grains are heaped above the rim; what stands above it is struck off
variable looks loop {fill_looks}
label fill
run {look}
if "${{heaped}} >= {heaped}" then "jump SELF full"
next looks
jump SELF fill
print "ERROR: the filling did not end within {fill_limit:.6g} s"
quit
label full
variable looks delete
unfix rain
delete_atoms region above compress no
"""

_FILL_COUNT = """
# until all grains are in
run {rain_steps_all}
unfix rain
"""

_LIFT = """
# lift, until the tube is clear of the heap
fix lift all move/mesh mesh tube linear 0 0 {speed}
variable rise equal 0
variable clear equal "v_rise > c_highest + {largest:.6g}"
variable looks loop {lift_looks}
label lift
run {look}
variable rise equal ${{rise}}+{look_rise:.9g}
if "${{clear}} == 1" then "jump SELF lifted"
next looks
jump SELF lift
label lifted
variable looks delete
unfix lift
"""

_END = """
dump heap all custom 1 {heap} id type x y z radius
dump_modify heap sort id format "%d %d %.9g %.9g %.9g %.9g"
run 0
undump heap
"""


def translate_lift(
    lift: Lift,
    model: str,
    properties: Mapping[str, str],
    warnings: tuple[str, ...],
    laws: Sequence[Translated],
) -> Translation:
    """Write the lifted cylinder for a contact model with its properties, each as LIGGGHTS' words for it."""
    scene, files = lift.scene, {}
    files[TUBE_FILE] = stl_text("tube", prism(scene.diameter / 2, scene.height))
    plate = f"fix plate all wall/gran model {model} primitive type 3 zplane 0.0"
    meshes = "1 meshes tube"
    if scene.plate_diameter is not None:
        files[PLATE_FILE] = stl_text("plate", disc(scene.plate_diameter / 2))
        plate, meshes = f"fix plate all mesh/surface file {PLATE_FILE} type 3", "2 meshes tube plate"
    walls = f"{plate}\nfix walls all wall/gran model {model} mesh n_meshes {meshes}\n"
    phases = [_setup(lift, model, properties, walls), *_filling(lift), *_lifting(lift)]
    files[INPUT] = "".join(phases)
    command = ("liggghts", "-in", INPUT)
    translated = (*laws, *lift_rows(lift), *_rows(lift))
    return Translation(files, INPUT, command, HEAP, translated, warnings + lift_warnings(lift))


def _setup(lift: Lift, model: str, properties: Mapping[str, str], walls: str) -> str:
    scene, templates = lift.scene, lift.templates
    half_width, _, bottom = scene.room(lift.reach)
    rain_top = lift.rain_bottom + lift.rain_height
    sizes_seed, rain_seed, *seeds = lift.seeds(2 + len(templates))
    gravity = sum(part**2 for part in scene.gravity) ** 0.5
    words = [
        grain_template(number, template, seed)
        for number, (template, seed) in enumerate(zip(templates, seeds, strict=True), 1)
    ]
    return _SETUP.format(
        low=-half_width,
        high=half_width,
        bottom=bottom,
        top=max(rain_top, 2.0 * scene.height) + 2.0 * lift.reach,
        skin=lift.skin,
        bin=2.0 * lift.largest_radius + lift.skin,
        properties="\n".join(
            f"fix {name} all property/global {name} {text}" for name, text in properties.items()
        ),
        laws=model,
        time_step=lift.case.time_step,
        gravity=gravity,
        direction=" ".join(f"{part / gravity:.9g}" for part in scene.gravity),
        plate=walls,
        bodies="fix motion all nve/sphere\n" if lift.is_of_spheres else "fix bodies all multisphere\n",
        rate=lift.rain_rate,
        count=lift.count,
        templates="\n".join(words),
        template_count=len(templates),
        sizes_seed=sizes_seed,
        rain_seed=rain_seed,
        fractions=" ".join(f"grain{n} {t.fraction:.9g}" for n, t in enumerate(templates, 1)),
        rain_radius=lift.rain_radius,
        rain_bottom=lift.rain_bottom - lift.reach,
        rain_top=rain_top,
        rain_steps=lift.steps(lift.rain_period),
        rain_speed=scene.rain_speed,
    ) + watched(lift)


def grain_template(number: int, template: Template, seed: int, atom_type: int = 1) -> str:
    """Write a template as LIGGGHTS' fix ``grain{number}``; the seed is a prime."""
    material = f"atom_type {atom_type} density constant {template.density:.9g}"
    if template.shape.sphere_count == 1:
        radius = float(template.radii[0])
        return f"fix grain{number} all particletemplate/sphere {seed} {material} radius constant {radius:.9g}"
    spheres = " &\n    ".join(
        f"{x:.9g} {y:.9g} {z:.9g} {r:.9g}"
        for (x, y, z), r in zip(template.centers, template.radii, strict=True)
    )
    xx, yy, zz = template.inertia.tolist()
    return (
        f"fix grain{number} all particletemplate/multisphere {seed} {material} &\n"
        f"    nspheres {template.shape.sphere_count} ntry 100000 spheres &\n    {spheres} &\n"
        f"    type {number} mass {template.mass:.9g} &\n"
        f"    inertia_tensor {xx:.9g} 0 0 {yy:.9g} 0 {zz:.9g} use_density"
    )


def _filling(lift: Lift) -> list[str]:
    look = lift.steps(LOOK)
    if lift.scene.grain_count is not None:
        fill = _FILL_COUNT.format(rain_steps_all=lift.steps(lift.count / lift.rain_rate + lift.rain_period))
        return [fill, rest_loop(lift, "settle", lift.settle_limit, _QUIT)]
    spheres = min(template.shape.sphere_count for template in lift.templates)
    strike = (
        f"region above block INF INF INF INF {lift.scene.height + lift.rise_of_spheres:.6g} INF units box\n"
    )
    fill = _FILL_TO_RIM.format(
        fill_looks=max(round(lift.fill_limit / LOOK), 1),
        fill_limit=lift.fill_limit,
        look=look,
        heaped=lift.heaped * spheres,
    )
    return [
        strike,
        fill,
        rest_loop(lift, "settle", lift.settle_limit, _QUIT),
        "delete_atoms region above compress no\n",
    ]


def _lifting(lift: Lift) -> list[str]:
    scene, look = lift.scene, lift.steps(LOOK)
    looks = max(round(scene.lift_time / LOOK), 1)
    lifting = _LIFT.format(
        speed=scene.lift_speed,
        look=look,
        lift_looks=looks,
        look_rise=look * lift.case.time_step * scene.lift_speed,
        largest=lift.largest_radius,
    )
    return [lifting, rest_loop(lift, "rest", lift.rest_limit, _QUIT), _END.format(heap=HEAP)]


def _rows(lift: Lift) -> tuple[Translated, ...]:
    """Say what LIGGGHTS has in a form of its own."""
    bodies = "`fix nve/sphere`" if lift.is_of_spheres else "`fix multisphere`, mass and inertia given"
    return (Translated("grains", "clumps, rigid", bodies),)
