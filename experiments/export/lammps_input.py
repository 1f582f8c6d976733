"""The lifted cylinder as an input of LAMMPS."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from experiments.export.exporter import Translation
from experiments.export.lift import LOOK, Lift, Template
from experiments.export.lift_rows import lift_rows, lift_warnings
from experiments.export.looks import rest_loop, watched
from experiments.export.translated import Translated

INPUT, HEAP = "lift.in", "heap.dump"

QUIT = "quit 1"
"""End of a program that has failed."""

_SETUP = """\
units si
atom_style sphere
atom_modify map hash  # an array is written beyond its end as grains are poured
boundary f f f
newton off
comm_modify vel yes{cutoff}
{molecules}region box block {low:.6g} {high:.6g} {low:.6g} {high:.6g} {bottom:.6g} {top:.6g}
create_box 1 box
neighbor {skin:.6g} bin
neigh_modify delay 0 every 1 check yes binsize {bin:.6g}

# contacts
pair_style granular
pair_coeff * * {among}
timestep {time_step:.9g}

# walls
variable rise equal 0.0
region tube cylinder z 0 0 {radius:.9g} 0 {height:.9g} open 1 open 2 move NULL NULL v_rise
fix tube all wall/gran/region granular {with_tube} region tube
{plate}

# grains
{grains}

# filling: {rate:.6g} grains a second, {count} of them
region rain cylinder z 0 0 {rain_radius:.6g} {rain_bottom:.6g} {rain_top:.6g}
fix rain {poured} pour {count} {first_type} {rain_seed} region rain vel 0 0 0 0 -{rain_speed} &
    vol {vol:.9g} 1000 {kinds}

"""

_SPHERES = """\
fix weight all gravity {gravity:.9g} vector 0 0 -1
fix motion all nve/sphere"""

_CLUMPS = """\
fix clump all property/atom mol ghost yes
neigh_modify exclude molecule/intra all
group nothing empty
# gravity acts on the bodies alone: spheres of a body overlap, and together are heavier than it is
fix weight nothing gravity {gravity:.9g} vector 0 0 -1
fix bodies all rigid/small molecule mol grains gravity weight"""

_FILL_TO_RIM = """
# until grains are heaped above the rim; what stands above it is struck off
# no run is set up anew here: each set-up would pour at once, whatever the rate
variable looks loop {fill_looks}
label fill
run {look} pre no post no
if "${{heaped}} >= {heaped}" then "jump SELF full"
next looks
jump SELF fill
print "ERROR: the filling did not end within {fill_limit:.6g} s"
quit 1
label full
variable looks delete
unfix rain
region above block INF INF INF INF {strike:.6g} INF
delete_atoms region above compress no{whole}
"""

_FILL_COUNT = """
# until all grains are in
run {steps}
unfix rain
"""

_LIFT = """
# lift, until the tube is clear of the heap
variable begin equal {time}
variable start equal ${{begin}}
variable rise equal "(step - v_start) * {step_rise:.12g}"
variable clear equal "v_rise > c_highest + {largest:.6g}"
variable looks loop {lift_looks}
label lift
run {look}
if "${{clear}} == 1" then "jump SELF lifted"
next looks
jump SELF lift
label lifted
variable looks delete
"""

_END = """
write_dump all custom {heap} id type x y z radius modify sort id format float %.9g
"""


def translate_lift(
    lift: Lift, contacts: Sequence[str], warnings: tuple[str, ...], laws: Sequence[Translated]
) -> Translation:
    """Write the lifted cylinder.

    The contacts are LAMMPS' words for those among grains, with the tube and with the plate.
    """
    kinds = () if lift.is_of_spheres else lift.templates
    molecules = {_file(number): molecule_text(template) for number, template in enumerate(kinds, 1)}
    files = {INPUT: _setup(lift, contacts) + _filling(lift) + _lifting(lift), **molecules}
    tilted = ("scene tilt: LAMMPS pours along gravity alone; left out",) if lift.scene.tilt else ()
    upright = f"(0, 0, -{_gravity(lift):.4g}) m/s2"
    rows = (
        replace(row, there=upright) if tilted and row.subject == "gravity" else row
        for row in lift_rows(lift, exact_tube=True)
    )
    translated = (*laws, *rows, *_rows(lift))
    command = ("lmp", "-in", INPUT)
    return Translation(files, INPUT, command, HEAP, translated, warnings + lift_warnings(lift) + tilted)


def _file(number: int) -> str:
    return f"grain{number}.mol"


def _setup(lift: Lift, contacts: Sequence[str]) -> str:
    scene, templates = lift.scene, lift.templates
    among, with_tube, with_plate = contacts
    half_width, _, bottom = scene.room(lift.reach)
    rain_top = lift.rain_bottom + lift.rain_height
    gravity = _gravity(lift)
    plate = f"fix plate all wall/gran granular {with_plate} zplane 0 NULL"
    if scene.plate_diameter is not None:
        radius, whole = scene.plate_diameter / 2, "" if lift.is_of_spheres else " molecule yes"
        plate = (
            f"region plate cylinder z 0 0 {radius:.9g} {bottom / 2:.9g} 0 side out\n"
            f"fix plate all wall/gran/region granular {with_plate} region plate\n"
            "# what falls off it is taken out whole: LAMMPS ends where a part of a body leaves the box\n"
            f"region fallen block INF INF INF INF INF {bottom:.6g}\n"
            f"fix fallen all evaporate {lift.steps(LOOK)} {lift.count} fallen {lift.seeds(2)[1]}{whole}"
        )
        bottom -= LOOK * math.sqrt(scene.rain_speed**2 + 2.0 * gravity * rain_top) + lift.reach
    spheres, names = lift.is_of_spheres, " ".join(_file(n) for n in range(1, len(templates) + 1))
    shares = " ".join(written_shares([template.fraction for template in templates]))
    return _SETUP.format(
        cutoff="" if spheres else f" cutoff {2.0 * lift.reach + lift.skin:.6g}",
        molecules="" if spheres else f"molecule grains {names}\n",
        grains=(_SPHERES if spheres else _CLUMPS).format(gravity=gravity),
        poured="all",
        first_type=1 if spheres else 0,
        kinds=_diameters(templates) if spheres else f"mol grains rigid bodies molfrac {shares}",
        low=-half_width,
        high=half_width,
        bottom=bottom,
        top=rain_top + 2.0 * lift.reach,
        skin=lift.skin,
        bin=2.0 * lift.largest_radius + lift.skin,
        among=among,
        with_tube=with_tube,
        plate=plate,
        time_step=lift.case.time_step,
        radius=scene.diameter / 2,
        height=scene.height,
        rate=lift.rain_rate,
        count=lift.count,
        rain_radius=lift.rain_radius - lift.reach,
        rain_bottom=lift.rain_bottom,
        rain_top=rain_top,
        rain_seed=lift.seeds(1)[0],
        rain_speed=scene.rain_speed,
        vol=_volume_fraction(lift),
    ) + watched(lift)


def _diameters(templates: Sequence[Template]) -> str:
    shares = written_shares([template.fraction for template in templates])
    sizes = " ".join(f"{2.0 * t.radii[0]:.9g} {part}" for t, part in zip(templates, shares, strict=True))
    density = templates[0].density
    return f"diam poly {len(templates)} {sizes} dens {density:.9g} {density:.9g}"


def written_shares(fractions: Sequence[float]) -> list[str]:
    """Write parts that add up to 1 within LAMMPS' tolerance."""
    return [f"{fraction:.15g}" for fraction in (*fractions[:-1], 1.0 - sum(fractions[:-1]))]


def _gravity(lift: Lift) -> float:
    return sum(part**2 for part in lift.scene.gravity) ** 0.5


def _fall_time(lift: Lift) -> float:
    """Time between two insertions [s]: that in which a grain falls through the space of the rain."""
    speed, gravity = lift.scene.rain_speed, _gravity(lift)
    return (math.sqrt(speed**2 + 2.0 * gravity * lift.rain_height) - speed) / gravity


def grains_at_once(lift: Lift) -> int:
    """Grains that LAMMPS puts in at once: whole ones, so that its rate is the asked one or less."""
    return max(math.floor(lift.rain_rate * _fall_time(lift)), 1)


def _volume_fraction(lift: Lift) -> float:
    """Volume fraction from which LAMMPS comes to as many grains an insertion as the rate asks for."""
    area = math.pi * (lift.rain_radius - lift.reach) ** 2
    if lift.is_of_spheres:
        one = sum(t.fraction * 4.0 / 3.0 * math.pi * t.radii[0] ** 3 for t in lift.templates)
    else:
        one = 4.0 / 3.0 * math.pi * max(_molecule_radius(t) for t in lift.templates) ** 3
    return (grains_at_once(lift) + 0.5) * one / (area * lift.rain_height)


def _molecule_radius(template: Template) -> float:
    """Radius of a molecule as LAMMPS has it [m]: about the mean of the spheres' centres."""
    away = template.centers - template.centers.mean(axis=0)
    return float(((away**2).sum(axis=1) ** 0.5 + template.radii).max())


def molecule_text(template: Template, atom_type: int = 1) -> str:
    """Write a template as a molecule file: mass and inertia are the body's."""
    count = template.shape.sphere_count
    xx, yy, zz = template.inertia.tolist()
    rows = list(enumerate(zip(template.centers, template.radii, strict=True), 1))
    share = template.mass / count
    sections = {
        "Coords": [f"{i} {x:.9g} {y:.9g} {z:.9g}" for i, ((x, y, z), _) in rows],
        "Types": [f"{i} {atom_type}" for i, _ in rows],
        "Diameters": [f"{i} {2.0 * radius:.9g}" for i, (_, radius) in rows],
        "Masses": [f"{i} {share:.9g}" for i, _ in rows],
    }
    head = (
        f"# a grain of size {template.size:.6g}\n\n{count} atoms\n{template.mass:.9g} mass\n0 0 0 com\n"
        f"{xx:.9g} {yy:.9g} {zz:.9g} 0 0 0 inertia\n"
    )
    return head + "".join(f"\n{name}\n\n" + "\n".join(lines) + "\n" for name, lines in sections.items())


def _filling(lift: Lift) -> str:
    look, settle = lift.steps(LOOK), rest_loop(lift, "settle", lift.settle_limit, QUIT)
    if lift.scene.grain_count is not None:
        insertions = math.ceil(lift.count / grains_at_once(lift))
        time = max(lift.count / lift.rain_rate + 2.0 * lift.rain_period, insertions * _fall_time(lift))
        return _FILL_COUNT.format(steps=lift.steps(time)) + settle
    whole = "" if lift.is_of_spheres else " mol yes"
    fill = _FILL_TO_RIM.format(
        fill_looks=max(round(lift.fill_limit / LOOK), 1),
        fill_limit=lift.fill_limit,
        look=look,
        heaped=lift.heaped * min(template.shape.sphere_count for template in lift.templates),
        strike=lift.strike,
        whole=whole,
    )
    return f"{fill}{settle}delete_atoms region above compress no{whole}\n"


def _lifting(lift: Lift) -> str:
    scene, look = lift.scene, lift.steps(LOOK)
    lifting = _LIFT.format(
        time="step",
        look=look,
        lift_looks=max(round(scene.lift_time / LOOK), 1),
        step_rise=lift.case.time_step * scene.lift_speed,
        largest=lift.largest_radius,
    )
    return lifting + rest_loop(lift, "rest", lift.rest_limit, QUIT) + _END.format(heap=HEAP)


def _rows(lift: Lift) -> tuple[Translated, ...]:
    """Say what LAMMPS has in a form of its own."""
    bodies = "`fix nve/sphere`" if lift.is_of_spheres else "`fix rigid/small`, mass and inertia given"
    return (
        Translated("grains", "clumps, rigid", bodies),
        Translated(
            "radius of contacts with the tube",
            "that of the sphere",
            "LAMMPS counts half the tube's curvature in: contacts are stiffer by r / 4 R or so",
        ),
    )
