"""The lifted cylinder of a trial as an input of LAMMPS, filmed and weighed while the tube rises."""

from __future__ import annotations

import math

from dem_warp.scenes.lifted_cylinder import GONE
from experiments.errors import InputError
from experiments.export.lammps import CONVENTIONS, granular_words
from experiments.export.lammps_input import molecule_text, shares, volume_fraction
from experiments.trials.other_codes.odd_lift import OddLift
from experiments.trials.other_codes.reading import DRAG, FRAMES
from experiments.trials.other_codes.surfaces import FILL_MARGIN, Bench

INPUT = "lift.in"

_SETUP = """\
units si
atom_style sphere
atom_modify map hash  # an array is written beyond its end as grains are poured
boundary f f f
newton off
comm_modify vel yes cutoff {cutoff:.6g}
molecule grains {molecules}
region box block {low:.6g} {high:.6g} {low:.6g} {high:.6g} {bottom:.6g} {top:.6g}
create_box 1 box
neighbor {skin:.6g} bin
neigh_modify delay 0 every 1 check yes binsize {bin:.6g}
pair_style granular
pair_coeff * * {among}
timestep {time_step:.9g}

variable rise equal 0.0
variable turned equal 0.0
variable shaken equal 0.0
region tube {tube} open 1 open 2 move NULL NULL v_rise rotate v_turned 0 0 0 0 0 1
region plate plane 0 0 0 0 0 1 move NULL NULL v_shaken
fix tube all wall/gran/region granular {with_tube} region tube contacts
fix plate all wall/gran/region granular {with_plate} region plate

fix clump all property/atom mol ghost yes
neigh_modify exclude molecule/intra all
group nothing empty
# gravity acts on the bodies alone: spheres of a body overlap, and together are heavier than it is
fix weight nothing gravity {gravity:.9g} vector 0 0 -1
fix bodies all rigid/small molecule mol grains gravity weight

# filling
region rain cylinder z 0 0 {rain_radius:.6g} {rain_bottom:.6g} {rain_top:.6g}
fix rain nothing pour {count} 0 {rain_seed} region rain vel 0 0 0 0 -{rain_speed} &
    vol {vol:.9g} 1000 mol grains rigid bodies molfrac {parts}

variable speed atom sqrt(vx*vx+vy*vy+vz*vz)
variable square atom vx*vx+vy*vy+vz*vz
compute fastest all reduce max v_speed
compute square all reduce ave v_square
compute highest all reduce max z
variable moving equal "sqrt(c_square) > {rest:.6g} || c_fastest > {calm:.6g}"
thermo_style custom step atoms c_fastest c_square c_highest
thermo {check}
thermo_modify lost ignore norm no

run {fill_steps}
unfix rain
{tilt}
"""

_REST = """
variable looks loop {limit_checks}
variable calm equal 0
label {name}
run {check}
if "${{moving}} == 1" then "variable calm equal 0" else "variable calm equal ${{calm}}+1"
if "${{calm}} >= {calm_checks}" then "jump SELF {name}_done"
next looks
jump SELF {name}
print "ERROR: no rest after {name}"
quit 1
label {name}_done
variable looks delete
"""

_LIFT = """
# lifting; the film and the balance run from now on
variable now equal step
variable begin equal ${{now}}
variable elapsed equal "(step - v_begin) * dt"
variable rise equal "{speed:.9g} * v_elapsed"
variable turned equal "{turn_rate:.9g} * v_elapsed"
variable shaken equal "{amplitude:.9g} * sin({omega:.12g} * v_elapsed) * (v_elapsed < {vibration_time:.9g})"
dump film all custom {look} {frames} id mol x y z vx vy vz radius
dump_modify film sort id format line "%d %d %.9g %.9g %.9g %.6g %.6g %.6g %.9g"
# forces of the tube on the spheres
compute onto all reduce sum f_tube[4]
variable weighed equal -c_onto
fix balance all ave/time 1 {look} {look} v_weighed file {drag}
variable clear equal "v_rise > c_highest + {reach:.6g} && v_elapsed >= {vibration_time:.9g}"
variable looks loop {lift_checks}
label lift
run {check}
if "${{clear}} == 1" then "jump SELF lifted"
next looks
jump SELF lift
label lifted
variable looks delete
"""

_END = """
run {check}
"""


def lammps_files(bench: Bench) -> dict[str, str]:
    """Files of the input of a case, by name.

    Raises
    ------
    InputError
        When it has what LAMMPS is not asked for: bridges, or grains of another kind.
    """
    if bench.bridges() is not None or bench.has_odd:
        lacking = "bridges" if bench.bridges() is not None else "two kinds of grains"
        raise InputError("trials in LAMMPS have one kind of grains, without bridges", lacking, "the case")
    phases = [_setup(bench), _rest(bench, "settle"), _lift(bench), _rest(bench, "rest")]
    text = "".join(phases) + _END.format(check=bench.check_steps)
    molecules = {_file(number): molecule_text(each) for number, each in enumerate(bench.templates, 1)}
    return molecules | {INPUT: text}


def _file(number: int) -> str:
    return f"grain{number}.mol"


def _tube(scene: OddLift) -> str:
    if scene.taper > 0.0:
        return f"cone z 0 0 {scene.lower_radius:.9g} {scene.upper_radius:.9g} 0 {scene.height:.9g}"
    return f"cylinder z 0 0 {scene.diameter / 2:.9g} 0 {scene.height:.9g}"


def _setup(bench: Bench) -> str:
    scene, lift = bench.scene, bench.lift
    half_width, _, bottom = scene.room(lift.reach)
    gravity = math.hypot(*scene.gravity)
    direction = " ".join(f"{part / gravity:.9g}" for part in scene.gravity)
    words = CONVENTIONS.words(bench.case.laws)
    levers = (2.0 * bench.lever, bench.lever)
    among, tube, plate = (granular_words(contact, words) for contact in bench.contacts(levers))
    if work := bench.adhesion():
        _, modulus, restitution, poisson, *others = among.split(" ")
        # LAMMPS has the surface energy of one of two like surfaces
        among = " ".join(["jkr", modulus, restitution, poisson, f"{work / 2.0:.9g}", *others])
    radius = bench.rain_radius - lift.reach
    look = bench.look_steps
    fill = lift.steps(lift.count / bench.rain_rate + FILL_MARGIN + bench.rain_period)
    return _SETUP.format(
        cutoff=2.0 * lift.reach + lift.skin,
        molecules=" ".join(_file(number) for number, _ in enumerate(bench.templates, 1)),
        low=-half_width,
        high=half_width,
        bottom=bottom,
        top=max(bench.rain_top, scene.height) + 4.0 * lift.reach,
        skin=lift.skin,
        bin=2.0 * (2.0 * lift.largest_radius + lift.skin),
        among=among,
        time_step=lift.case.time_step,
        tube=_tube(scene),
        with_tube=tube,
        with_plate=plate,
        gravity=gravity,
        rain_radius=radius,
        rain_bottom=lift.rain_bottom,
        rain_top=bench.rain_top,
        count=lift.count,
        rain_seed=lift.seeds(1)[0],
        rain_speed=scene.rain_speed,
        vol=volume_fraction(lift, bench.rain_rate * bench.rain_period, radius),
        parts=" ".join(shares([template.fraction for template in bench.templates])),
        rest=scene.rest_speed,
        calm=lift.calm_speed,
        check=bench.check_steps,
        fill_steps=look * math.ceil(fill / look),
        tilt=f"fix weight nothing gravity {gravity:.9g} vector {direction}" if scene.tilt else "",
    )


def _lift(bench: Bench) -> str:
    scene, look = bench.scene, bench.look_steps
    check_time = bench.check_steps * bench.case.time_step
    highest = max(GONE * scene.height / scene.lift_speed, scene.vibration_time)
    return _LIFT.format(
        speed=scene.lift_speed,
        turn_rate=scene.turn_rate,
        amplitude=scene.vibration_amplitude,
        omega=2.0 * math.pi * scene.vibration_frequency,
        vibration_time=scene.vibration_time,
        look=look,
        check=bench.check_steps,
        frames=FRAMES,
        drag=DRAG,
        reach=bench.lift.reach,
        lift_checks=math.ceil(highest / check_time) + 1,
    )


def _rest(bench: Bench, name: str) -> str:
    check_time = bench.check_steps * bench.case.time_step
    limit = bench.lift.settle_limit if name == "settle" else bench.lift.rest_limit
    return _REST.format(
        name=name,
        check=bench.check_steps,
        calm_checks=math.ceil(bench.scene.rest_time / check_time),
        limit_checks=math.ceil(limit / check_time),
    )
