"""LAMMPS: ``pair_style granular`` with Hertz, Mindlin's spring with history and any of its dampings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from dem_warp import Drum, Hopper, LiftedCylinder
from experiments.export import lammps_text as text
from experiments.export.code_table import CodeTest, code_exporter, code_laws
from experiments.export.contact import Contact, values
from experiments.export.drum import DRUM, TURNED_FILE, drum_rows, lammps_drum, lammps_turning
from experiments.export.exporter import Translation
from experiments.export.hopper_text import DISCHARGE_FILE, HOPPER, WEIGHED
from experiments.export.lammps_hopper import hopper_opening, hopper_rows, hopper_walls
from experiments.export.laws import Translated
from experiments.export.lift import LOOK, Lift, Template
from experiments.export.lift_rows import lift_rows
from experiments.export.script_text import (
    HEAP_FILE,
    clear_loop,
    fill_loop,
    filling,
    rest_loop,
    space_words,
    watched,
)

INPUT = "lift.in"

TSUJI = (4.8218, -18.022, 27.467, -22.348, 11.087, -4.2783, 1.2728)
"""Polynomial of the restitution that LAMMPS makes the coefficient of Tsuji's damping from."""

ROLLING_OVERLAP = 0.01
"""The spring that resists rolling is as stiff as a tangential one at this overlap, in radii."""

_TUBE = """
# walls
variable rise equal 0.0
region tube cylinder z 0 0 {radius:.9g} 0 {height:.9g} open 1 open 2 move NULL NULL v_rise
fix tube all wall/gran/region granular {words} region tube
"""

_PLATE = """\
region plate cylinder z 0 0 {radius:.9g} {middle:.9g} 0 side out
fix plate all wall/gran/region granular {words} region plate
"""

_FALLEN = """\
# what falls off is taken out whole: LAMMPS ends where a part of a body leaves the box
region fallen block INF INF INF INF INF {bottom:.6g}
fix fallen all evaporate {look} {count} fallen {seed}{whole}
"""

_RAIN = """
# filling: {rate:.6g} grains a second, {count} of them
region rain {space}
fix rain all pour {count} {first_type} {seed} region rain vel 0 0 0 0 -{speed} &
    vol {vol:.9g} 1000 {kinds}

"""

_FILL_TO_RIM = """
# until grains are heaped above the rim; what stands above it is struck off
# no run is set up anew here: each set-up would pour at once, whatever the rate
{loop}region above block INF INF INF INF {strike:.6g} INF
"""

_LIFT = """
# lift, until the tube is clear of the heap
variable begin equal step
variable start equal ${{begin}}
variable rise equal "(step - v_start) * {step_rise:.12g}"
{loop}"""


def contact_numbers(contact: Contact) -> dict[str, float]:
    """Calculate the terms of a contact by their keys in the table.

    Poisson's ratio is put in as 0. From E and v LAMMPS makes E* = E / 2 (1 - v^2), of walls
    E / 2 (1 - v) in some versions; without v both are E / 2.
    """
    law = contact.coefficients
    spring = 8.0 * law.shear_modulus
    rolling = law.rolling_spring or spring * contact.radius * math.sqrt(2.0 * ROLLING_OVERLAP)
    return {
        "E": 2.0 * law.modulus,
        "nu": 0.0,
        "k_t": spring,
        "k_roll": rolling,
        "gamma_roll": law.rolling_dashpot or math.sqrt(rolling * contact.mass),
        **_dampings(contact),
    }


def _dampings(contact: Contact) -> dict[str, float]:
    """Calculate the normal damping, and the tangential one as a multiple of it."""
    law = contact.coefficients
    if contact.normal_damping == "tsuji":
        share = 2.0 * math.sqrt(law.shear_modulus / law.modulus) * law.tangential_damping
        return {"e": tsuji_restitution(law.damping), "share_tsuji": share}
    share = law.tangential_damping
    if contact.normal_damping == "viscoelastic":
        # ours is that of an area of 1 mm
        return {"eta_area": 1e3 * law.damping, "share": share}
    return {"eta_mass": law.damping, "share": share}


def granular_words(contact: Contact, words: Mapping[str, str], surface_energy: float = 0.0) -> str:
    """Write LAMMPS' words for a contact; see `lammps_text.granular_words`."""
    return text.granular_words(values(LAMMPS.contact_terms(contact)), words, surface_energy)


def translate(test: CodeTest) -> Translation:
    """Write the input of a lifted cylinder, a hopper or a drum, and its molecules."""
    lift = test.lift
    if isinstance(lift.scene, Hopper):
        return _hopper(test)
    if isinstance(lift.scene, Drum):
        return _drum(test)
    files = {INPUT: _setup(test, *_lift_walls(test)) + _lifting(lift), **_molecules(lift)}
    tilted = ("scene tilt: LAMMPS pours along gravity alone; left out",) if lift.scene.tilt else ()
    upright = f"(0, 0, -{_gravity(lift):.4g}) m/s2"
    rows = (
        replace(row, there=upright) if tilted and row.subject == "gravity" else row
        for row in lift_rows(lift, exact_tube=True)
    )
    bodies = "`fix nve/sphere`" if lift.is_of_spheres else "`fix rigid/small`, mass and inertia given"
    translated = (*rows, Translated("grains", "clumps, rigid", bodies))
    return test.script("lmp", files, HEAP_FILE, translated, *tilted)


def _hopper(test: CodeTest) -> Translation:
    lift = test.lift
    bin_words, floor_words = (granular_words(contact, test.words) for contact in test.contacts[1:])
    walls = hopper_walls(lift, bin_words, floor_words) + _fallen(lift)
    setup = _setup(test, walls, _sides(lift, _below(lift)), WEIGHED)
    files = {HOPPER: setup + hopper_opening(lift), **_molecules(lift)}
    return test.script("lmp", files, DISCHARGE_FILE, hopper_rows(lift))


def _drum(test: CodeTest) -> Translation:
    lift = test.lift
    x, y, bottom = lift.scene.room(lift.reach)
    walls = lammps_drum(lift, granular_words(test.contacts[1], test.words))
    setup = _setup(test, walls, (-x, x, -y, y, bottom, lift.scene.diameter - bottom))
    files = {DRUM: setup + lammps_turning(lift), **_molecules(lift)}
    return test.script("lmp", files, TURNED_FILE, drum_rows(lift, exact=True))


def _molecules(lift: Lift) -> dict[str, str]:
    """Return the files of the clumps; spheres need none."""
    if lift.is_of_spheres:
        return {}
    return {text.molecule_file(n): text.molecule_text(each) for n, each in enumerate(lift.templates, 1)}


def _lift_walls(test: CodeTest) -> tuple[str, tuple[float, ...]]:
    """Return the walls of a lifted cylinder, and the sides of the box [m]."""
    lift, scene = test.lift, test.lift.scene
    with_tube, with_plate = (granular_words(contact, test.words) for contact in test.contacts[1:])
    tube = _TUBE.format(radius=scene.diameter / 2, height=scene.height, words=with_tube)
    bottom = scene.room(lift.reach)[2]
    if scene.plate_diameter is None:
        plane = f"fix plate all wall/gran granular {with_plate} zplane 0 NULL\n"
        return tube + plane, _sides(lift, bottom)
    plate = _PLATE.format(radius=scene.plate_diameter / 2, middle=bottom / 2, words=with_plate)
    return tube + plate + _fallen(lift), _sides(lift, _below(lift))


def _sides(lift: Lift, bottom: float) -> tuple[float, ...]:
    half_width, top = lift.scene.room(lift.reach)[0], lift.rain_bottom + lift.rain_height
    return -half_width, half_width, -half_width, half_width, bottom, top + 2.0 * lift.reach


def _below(lift: Lift) -> float:
    """Return the height that no grain falls to between two looks at what is to be taken out [m]."""
    fall = 2.0 * _gravity(lift) * (lift.rain_bottom + lift.rain_height)
    way = LOOK * math.sqrt(lift.scene.rain_speed**2 + fall)
    return float(lift.scene.room(lift.reach)[2]) - way - lift.reach


def _setup(test: CodeTest, walls: str, sides: Sequence[float], watch: str = "") -> str:
    lift, among = test.lift, granular_words(test.contacts[0], test.words)
    names = " ".join(text.molecule_file(n) for n in range(1, len(lift.templates) + 1))
    upright = (0.0, 0.0, -_gravity(lift))
    spheres = lift.is_of_spheres
    parts = [
        text.head(
            "hash  # an array is written beyond its end as grains are poured",
            0.0 if spheres else 2.0 * lift.reach + lift.skin,
        ),
        "" if spheres else f"molecule grains {names}\n",
        text.box(sides),
        text.neighbors(lift.skin, 2.0 * lift.largest_radius + lift.skin),
        "\n# contacts\n",
        text.contacts({"* *": among}, lift.case.time_step),
        walls,
        "\n# grains\n",
        text.weight(upright) + "fix motion all nve/sphere\n"
        if spheres
        else text.BODY_NUMBERS + text.rigid_bodies(upright),
        _rain(lift, lift.rain_bottom + lift.rain_height),
        watched(lift, more=watch),
        _filling(lift),
    ]
    return "".join(parts)


def _fallen(lift: Lift) -> str:
    return _FALLEN.format(
        bottom=lift.scene.room(lift.reach)[2],
        look=lift.steps(LOOK),
        count=lift.count,
        seed=lift.seeds(2)[1],
        whole="" if lift.is_of_spheres else " molecule yes",
    )


def _rain(lift: Lift, top: float) -> str:
    shares = text.written_shares([template.fraction for template in lift.templates])
    return _RAIN.format(
        rate=lift.rain_rate,
        count=lift.count,
        space=space_words(lift.rain_section, lift.rain_bottom, top, lift.reach),
        first_type=1 if lift.is_of_spheres else 0,
        seed=lift.seeds(1)[0],
        speed=lift.scene.rain_speed,
        vol=_volume_fraction(lift),
        kinds=_diameters(lift.templates, shares)
        if lift.is_of_spheres
        else f"mol grains rigid bodies molfrac {' '.join(shares)}",
    )


def _diameters(templates: Sequence[Template], shares: Sequence[str]) -> str:
    sizes = " ".join(f"{2.0 * t.radii[0]:.9g} {part}" for t, part in zip(templates, shares, strict=True))
    density = templates[0].density
    return f"diam poly {len(templates)} {sizes} dens {density:.9g} {density:.9g}"


def _gravity(lift: Lift) -> float:
    return sum(part**2 for part in lift.scene.gravity) ** 0.5


def _fall_time(lift: Lift) -> float:
    # an insertion follows when the last one has fallen through the space of the rain
    speed, gravity = lift.scene.rain_speed, _gravity(lift)
    return (math.sqrt(speed**2 + 2.0 * gravity * lift.rain_height) - speed) / gravity


def grains_at_once(lift: Lift) -> int:
    """Return the number of grains that LAMMPS puts in at once: its rate is the wanted one or less."""
    return max(math.floor(lift.rain_rate * _fall_time(lift)), 1)


def _volume_fraction(lift: Lift) -> float:
    # LAMMPS makes the number of grains of an insertion from it
    area = lift.rain_section.open_area(lift.reach)
    if lift.is_of_spheres:
        one = sum(t.fraction * 4.0 / 3.0 * math.pi * t.radii[0] ** 3 for t in lift.templates)
    else:
        one = 4.0 / 3.0 * math.pi * max(_molecule_radius(t) for t in lift.templates) ** 3
    return (grains_at_once(lift) + 0.5) * one / (area * lift.rain_height)


def _molecule_radius(template: Template) -> float:
    # LAMMPS has it about the mean of the spheres' centres
    away = template.centers - template.centers.mean(axis=0)
    return float(((away**2).sum(axis=1) ** 0.5 + template.radii).max())


def _filling(lift: Lift) -> str:
    insertions = math.ceil(lift.count / grains_at_once(lift))
    time = max(lift.count / lift.rain_rate + 2.0 * lift.rain_period, insertions * _fall_time(lift))
    loop = fill_loop(lift, f"{lift.steps(LOOK)} pre no post no", text.QUIT)
    to_rim = _FILL_TO_RIM.format(loop=loop, strike=lift.strike)
    return filling(lift, text.QUIT, lift.steps(time), to_rim, "" if lift.is_of_spheres else " mol yes")


def _lifting(lift: Lift) -> str:
    scene, looks = lift.scene, max(round(lift.scene.lift_time / LOOK), 1)
    loop = clear_loop(lift.steps(LOOK), looks, lift.largest_radius)
    lifting = _LIFT.format(step_rise=lift.case.time_step * scene.lift_speed, loop=loop)
    return lifting + rest_loop(lift, "rest", text.QUIT) + "\n" + text.dump(HEAP_FILE)


def tsuji_restitution(damping: float) -> float:
    """Return the restitution from which LAMMPS calculates a given damping.

    LAMMPS damps with a sqrt(m* 4/3 E* sqrt(R* d)), a being a polynomial of it; dem-warp with a
    coefficient times sqrt(m* 2 E* sqrt(R* d)). At 0 the polynomial is 1.27, which damps as a restitution of
    0.11 does here: more is reached below 0. At 1 it is 3e-4, the least.

    Raises
    ------
    ValueError
        If the polynomial does not reach so far: for no restitution above 0.
    """
    from scipy.optimize import brentq

    def above(number: float) -> float:
        return float(np.polyval(TSUJI, number)) - math.sqrt(1.5) * damping

    if above(1.0) >= 0.0:
        return 1.0
    ends = (0.0, 1.0) if above(0.0) >= 0.0 else (-1.0, 0.0)
    return float(brentq(above, *ends))


LAMMPS = code_exporter("lammps", translate, contact_numbers, (LiftedCylinder, Hopper, Drum))

CONVENTIONS = code_laws("lammps")
"""Contact laws that it has."""
