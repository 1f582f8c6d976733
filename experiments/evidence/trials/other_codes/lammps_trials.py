"""The lifted cylinder of a trial as an input of LAMMPS, filmed and weighed while the tube rises."""

import math
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations_with_replacement

import numpy as np

from dem_warp import Material
from dem_warp.laws.capillary import CapillaryBridge
from dem_warp.model import ContactCoefficients
from dem_warp.scenes.lifted_cylinder import GONE
from experiments.evidence.trials.other_codes.code_surfaces import BIN, FILL_MARGIN, Bench
from experiments.evidence.trials.other_codes.dump_reading import DRAG, FRAMES
from experiments.export import Contact
from experiments.export import lammps_text as text
from experiments.export.lammps_exporter import CONVENTIONS, granular_words
from experiments.export.script_text import clear_loop, rest_loop, watched
from experiments.io.errors import InputError

INPUT = "lift.in"

GRAIN, ODD = 1, 2
"""Types of LAMMPS's atoms: grains, and those of another kind."""

_MARGIN = 10.0
"""Width of the strip around the box in which grains are taken away, in reaches of a grain."""

_LIFT_ANYWAY = (
    "# some grains tremble for ever in LAMMPS, in one full tube of 30 or so; it is lifted all the same"
)
"""End of the wait for rest before the lift."""

_WALLS = """
# walls
{groups}
variable rise equal 0.0
variable turn equal 0.0
variable shake equal 0.0
region tube {tube} open 1 open 2 move NULL NULL v_rise rotate v_turn 0 0 0 0 0 1
region plate plane 0 0 0 0 0 1 move NULL NULL v_shake
{walls}

# grains
"""

_FILLING = """\
# a body must not leave the box in parts
region far block -{far:.6g} {far:.6g} -{far:.6g} {far:.6g} INF {far_top:.6g} side out
fix gone all evaporate {look} 1000000 far {gone_seed} molecule yes

# filling
region rain cylinder z 0 0 {rain_radius:.6g} {rain_bottom:.6g} {rain_top:.6g}
{rain}

{watched}
run {fill_steps}
{dry}
variable short equal "atoms < {spheres}"
if "${{short}} == 1" then "print 'ERROR: not all grains came in'" "{quit}"
"""

_RAIN = """\
fix rain_{group} {group} deposit {count} 0 {steps} {seed} region rain near {near:.6g} attempt 500 &
    vx 0 0 vy 0 0 vz -{speed} -{speed} mol grains molfrac {shares} rigid bodies"""

_LIFT = """
# lifting; the film and the balance run from now on
variable now equal step
variable begin equal ${{now}}
variable rise equal "(step - v_begin) * {step_rise:.12g}"
variable turn equal "(step - v_begin) * {step_turn:.12g}"
variable shakes equal "step < v_begin + {shaken}"
variable shake equal "v_shakes * {amplitude:.9g} * sin((step - v_begin) * {step_phase:.12g})"
dump film all custom {look} {frames} id mol x y z vx vy vz radius
dump_modify film sort id format float %.9g
compute drag all reduce sum {loads}
variable drag equal {drag_sum}
fix balance all ave/time 1 {look} {look} v_drag file {drag}
{loop}# the plate shakes on, and the film goes to its next look
variable left equal "(v_begin + {shaken_looks} - step) * (step < v_begin + {shaken_looks})"
variable go equal ${{left}}
run ${{go}}
"""

_END = """
run {check}
"""


def lammps_files(bench: Bench) -> dict[str, str]:
    """Files of the input of a case, by name."""
    if bench.bridges() is not None:
        raise InputError("the case", "LAMMPS has no liquid bridges", CapillaryBridge.name)
    end = _END.format(check=bench.check_steps)
    phases = [_setup(bench), _rest(bench, "settle"), _lift(bench), _rest(bench, "rest"), end]
    molecules = {
        text.molecule_file(number): text.molecule_text(template, ODD if is_odd else GRAIN)
        for number, (is_odd, template, _) in enumerate(bench.kinds(), 1)
    }
    return {INPUT: "".join(phases)} | molecules


@dataclass(frozen=True)
class _Lot:
    """Grains of one kind: a group of LAMMPS, which comes in and touches walls in its own way."""

    group: str
    is_odd: bool
    count: int
    steps: int
    """Distance from one grain to the next."""


def _lots(bench: Bench) -> list[_Lot]:
    """Lots of a case, which come in over the same time."""
    lift, share = bench.lift, bench.scene.odd_share
    odd = round(share * lift.count)
    time = lift.count / bench.rain_rate
    counts = (("usual", False, lift.count - odd), ("odd", True, odd))
    return [_Lot(group, is_odd, count, lift.steps(time / count)) for group, is_odd, count in counts if count]


def _rain(bench: Bench, lot: _Lot, seed: int) -> str:
    """Write the rain of a lot, of the molecules of its kind alone."""
    kinds = bench.kinds()
    own = np.array([share for is_odd, _, share in kinds if is_odd is lot.is_odd])
    shares = iter(text.written_shares(own / own.sum()))
    return _RAIN.format(
        group=lot.group,
        count=lot.count,
        steps=lot.steps,
        seed=seed,
        near=2.0 * bench.lift.largest_radius,
        speed=bench.scene.rain_speed,
        shares=" ".join(next(shares) if is_odd is lot.is_odd else "0" for is_odd, _, _ in kinds),
    )


def _setup(bench: Bench) -> str:
    scene, lift = bench.scene, bench.lift
    half_width, _, bottom = scene.room(lift.reach)
    kinds = bench.kinds()
    top = max(bench.rain_top, (1.0 + GONE) * scene.height) + 4.0 * lift.reach
    margin, lots = _MARGIN * lift.reach, _lots(bench)
    gone_seed, *seeds = lift.seeds(1 + len(lots))
    fill = max(lot.count * lot.steps for lot in lots) + lift.steps(FILL_MARGIN)
    outer = half_width + margin
    parts = [
        # an array is written beyond its end as grains come in
        text.head("hash sort 0 0.0", 2.0 * lift.reach + lift.skin),
        f"molecule grains {' '.join(text.molecule_file(number) for number, _ in enumerate(kinds, 1))}\n",
        text.box((-outer, outer, -outer, outer, bottom, top + margin), ODD if bench.has_odd else GRAIN),
        text.neighbors(lift.skin, BIN * (2.0 * lift.largest_radius + lift.skin)),
        "\n# contacts\n",
        text.contacts(_pairs(bench), lift.case.time_step),
        _WALLS.format(
            tube=_tube(bench),
            groups="\n".join(f"group {lot.group} empty" for lot in lots),
            walls="\n".join(_walls(bench, lot) for lot in lots),
        ),
        text.BODY_NUMBERS + text.rigid_bodies(scene.gravity),
        _FILLING.format(
            far=half_width,
            far_top=top,
            look=bench.look_steps,
            gone_seed=gone_seed,
            rain_radius=bench.rain_radius - lift.reach,
            rain_bottom=lift.rain_bottom,
            rain_top=bench.rain_top,
            rain="\n".join(map(partial(_rain, bench), lots, seeds)),
            watched=watched(lift, bench.check_steps),
            dry="\n".join(f"unfix rain_{lot.group}" for lot in lots),
            fill_steps=bench.look_steps * math.ceil(fill / bench.look_steps),
            spheres=lift.count * lift.templates[0].shape.sphere_count,
            quit=text.QUIT,
        ),
    ]
    return "".join(parts)


def _tube(bench: Bench) -> str:
    scene = bench.scene
    if scene.taper:
        return f"cone z 0 0 {scene.lower_radius:.9g} {scene.upper_radius:.9g} 0 {scene.height:.9g}"
    return f"cylinder z 0 0 {scene.lower_radius:.9g} 0 {scene.height:.9g}"


def _pairs(bench: Bench) -> dict[str, str]:
    """Write the contacts among grains of each kind, with their adhesion."""
    among, kinds = bench.contacts()[0], (GRAIN, ODD) if bench.has_odd else (GRAIN,)
    energy = surface_energy(bench.adhesion())
    return {
        f"{first} {second}": _words(bench, among, first == ODD, second == ODD, energy)
        for first, second in combinations_with_replacement(kinds, 2)
    }


def _walls(bench: Bench, lot: _Lot) -> str:
    """Write the contacts of grains of a kind with tube and plate."""
    _, tube, plate = bench.contacts()
    return "\n".join(
        f"fix {name}_{lot.group} {lot.group} wall/gran/region granular {_words(bench, contact, lot.is_odd)} "
        f"region {name} contacts"
        for name, contact in (("tube", tube), ("plate", plate))
    )


def _words(
    bench: Bench, contact: Contact, first_odd: bool, second_odd: bool = False, energy: float = 0.0
) -> str:
    """Write a contact whose first or second grain may be of the other kind."""
    scene, laws = bench.scene, CONVENTIONS.nearest_laws(bench.case.laws)

    def softened(material: Material, is_odd: bool) -> Material:
        factor = scene.odd_modulus if is_odd else 1.0
        return replace(material, shear_modulus=factor * material.shear_modulus)

    factor = scene.odd_friction if first_odd or second_odd else 1.0
    surface = replace(contact.surface, static_friction=factor * contact.surface.static_friction)
    first, second = softened(contact.first, first_odd), softened(contact.second, second_odd)
    coefficients = ContactCoefficients.of_pair(first, second, surface, laws, (), contact.radius, contact.mass)
    return granular_words(replace(contact, coefficients=coefficients), CONVENTIONS.words(laws), energy)


def surface_energy(work: float) -> float:
    """Surface energy [J/m2] with which LAMMPS's ``dmt`` holds spheres as JKR does.

    Its contact holds 4 pi g R*, JKR's 3/2 pi W R*.
    """
    return 0.375 * work


def _lift(bench: Bench) -> str:
    scene, lift, look = bench.scene, bench.lift, bench.look_steps
    step = lift.case.time_step
    check_rise = bench.check_steps * step * scene.lift_speed
    shaken = lift.steps(scene.vibration_time) if scene.vibration_amplitude > 0.0 else 0
    groups = [lot.group for lot in _lots(bench)]
    return _LIFT.format(
        step_rise=step * scene.lift_speed,
        step_turn=step * scene.turn_rate,
        amplitude=scene.vibration_amplitude,
        step_phase=step * 2.0 * math.pi * scene.vibration_frequency,
        shaken=shaken,
        shaken_looks=look * math.ceil(shaken / look),
        look=look,
        frames=FRAMES,
        # the force on the grains, along the axis
        loads=" ".join(f"f_tube_{group}[4]" for group in groups),
        drag_sum="-c_drag[1]-c_drag[2]" if len(groups) > 1 else "-c_drag",
        drag=DRAG,
        loop=clear_loop(bench.check_steps, math.ceil(GONE * scene.height / check_rise) + 1, lift.reach),
    )


def _rest(bench: Bench, name: str) -> str:
    ends = _LIFT_ANYWAY if name == "settle" else text.QUIT
    return rest_loop(bench.lift, name, ends, bench.check_steps)
