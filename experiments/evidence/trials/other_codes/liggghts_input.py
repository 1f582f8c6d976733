"""The lifted cylinder of a trial as an input of LIGGGHTS, filmed and weighed while the tube rises."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from dem_warp.laws.capillary import CapillaryBridge
from dem_warp.scenes.lifted_cylinder import GONE
from experiments.evidence.trials.other_codes.odd_lift import OddLift
from experiments.evidence.trials.other_codes.reading import DRAG, FRAMES
from experiments.evidence.trials.other_codes.surfaces import BIN, FILL_MARGIN, Bench
from experiments.export.contact import values
from experiments.export.lift import prism, stl_text
from experiments.export.liggghts import CONVENTIONS, contact_terms, material_terms, model_words
from experiments.export.liggghts_input import grain_template
from experiments.export.looks import rest_loop

INPUT, TUBE, PLATE = "lift.in", "tube.stl", "plate.stl"

GRAIN, ODD = 1, 4
"""Types of LIGGGHTS's atoms."""

_SORTING = "sort 0 0.0"
"""No sorting of the atoms in memory: its bins fill the empty box, and cost a tenth of the time."""

_SPARE = 1.2
"""Distance at which LIGGGHTS looks for bridges, over that at which they break."""

_SETUP = """\
atom_style granular
atom_modify map array {sorting}
boundary f f f
newton off
communicate single vel yes
units si
hard_particles yes
soft_particles yes
region box block {low:.6g} {high:.6g} {low:.6g} {high:.6g} {bottom:.6g} {top:.6g} units box
create_box {types} box  # 1 grains, 2 tube, 3 plate, 4 grains of another kind
neighbor {skin:.6g} bin
neigh_modify delay 0 every 1 check yes binsize {bin:.6g}
{properties}
pair_style gran model {pair_model}
pair_coeff * *
timestep {time_step:.9g}
fix weight all gravity {gravity:.9g} vector {direction}

# the plate is a mesh, since it may shake
fix tube all mesh/surface/stress file tube.stl type 2 stress on
fix plate all mesh/surface file plate.stl type 3
fix walls all wall/gran model {wall_model} mesh n_meshes 2 meshes tube plate
fix bodies all multisphere

# filling
{templates}
fix sizes all particledistribution/discrete/numberbased {sizes_seed} {kinds} {fractions}
region rain cylinder z 0 0 {rain_radius:.6g} {rain_bottom:.6g} {rain_top:.6g} units box
fix rain all insert/rate/region seed {rain_seed} distributiontemplate sizes &
    nparticles {count} particlerate {rate:.6g} insert_every {rain_steps} overlapcheck yes all_in yes &
    maxattempt 500 vel constant 0 0 -{rain_speed} orientation random region rain ntry_mc 10000

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
"""

_LIFT = """
# lifting; the film and the balance run from now on
variable now equal step
variable begin equal ${{now}}
fix lift all move/mesh mesh tube linear 0 0 {speed:.9g}
{turn}
{shake}
dump film all custom {look} {frames} id id_multisphere x y z vx vy vz radius
dump_modify film sort id format "%d %d %.9g %.9g %.9g %.6g %.6g %.6g %.9g"
fix balance all ave/time 1 {look} {look} f_tube[3] file {drag}
variable rise equal 0
variable clear equal "v_rise > c_highest + {reach:.6g}"
variable looks loop {lift_checks}
label lift
run {check}
variable rise equal ${{rise}}+{check_rise:.9g}
if "${{clear}} == 1" then "jump SELF lifted"
next looks
jump SELF lift
label lifted
variable looks delete
{still}
"""

_SHAKING = """
# the drive runs on, and the film to its next look
variable left equal "v_begin + {steps} - step"
variable go equal ${{left}}
run ${{go}}
unfix shake
run {more}
"""


_END = """
run {check}
"""

_PLATE_REST = 0.98
"""Half the plate's side over that of the box: a mesh must not reach its wall."""


def liggghts_files(bench: Bench) -> dict[str, str]:
    """Files of the input of a case, by name."""
    scene, end = bench.scene, _END.format(check=bench.check_steps)
    side = _PLATE_REST * scene.room(bench.lift.reach)[0]
    plate = side * np.array([[[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]]])
    phases = [_setup(bench), _rest(bench, "settle"), _lift(bench), _rest(bench, "rest"), end]
    return {
        TUBE: stl_text("tube", _tube(scene)),
        PLATE: stl_text("plate", plate),
        INPUT: "".join(phases),
    }


def _tube(scene: OddLift) -> np.ndarray:
    """Triangles of the tube, (2 sides, 3, 3) [m]."""
    corners = prism(1.0, scene.height, scene.tube_sides)
    radii = np.where(corners[..., 2] > 0.0, scene.upper_radius, scene.lower_radius)
    return corners * np.stack([radii, radii, np.ones_like(radii)], axis=-1)


def _setup(bench: Bench) -> str:
    scene, lift = bench.scene, bench.lift
    half_width, _, bottom = scene.room(lift.reach)
    kinds = bench.kinds()
    sizes_seed, rain_seed, *seeds = lift.seeds(2 + len(kinds))
    words = CONVENTIONS.words(CONVENTIONS.nearest_laws(bench.case.laws))
    cohesion, numbers = _cohesion(bench)
    gravity = math.hypot(*scene.gravity)
    look = bench.look_steps
    fill = lift.steps(lift.count / bench.rain_rate + FILL_MARGIN)
    return _SETUP.format(
        sorting=_SORTING,
        low=-half_width,
        high=half_width,
        bottom=bottom,
        top=max(bench.rain_top, (1.0 + GONE) * scene.height) + 4.0 * lift.reach,
        types=4 if bench.has_odd else 3,
        skin=lift.skin,
        bin=BIN * (2.0 * lift.largest_radius + lift.skin),
        properties=_properties(_tables(bench) | numbers),
        pair_model=model_words(words | {"cohesion": cohesion}),
        wall_model=model_words(words),
        time_step=lift.case.time_step,
        gravity=gravity,
        direction=" ".join(f"{part / gravity:.9g}" for part in scene.gravity),
        templates="\n".join(
            grain_template(number, template, seed, ODD if is_odd else GRAIN)
            for number, ((is_odd, template, _), seed) in enumerate(zip(kinds, seeds, strict=True), 1)
        ),
        sizes_seed=sizes_seed,
        kinds=len(kinds),
        fractions=" ".join(f"grain{number} {part:.9g}" for number, (_, _, part) in enumerate(kinds, 1)),
        rain_radius=bench.rain_radius,
        rain_bottom=lift.rain_bottom - lift.reach,
        rain_top=bench.rain_top,
        rain_seed=rain_seed,
        count=lift.count,
        rate=bench.rain_rate,
        rain_steps=lift.steps(bench.rain_period),
        rain_speed=scene.rain_speed,
        rest=scene.rest_speed,
        calm=lift.calm_speed,
        check=bench.check_steps,
        fill_steps=look * math.ceil(fill / look),
    )


def _properties(tables: Mapping[str, str]) -> str:
    return "\n".join(f"fix {name} all property/global {name} {text}" for name, text in tables.items())


def _tables(bench: Bench) -> dict[str, str]:
    """Global properties of the types: grains, tube, plate, and grains of another kind."""
    scene = bench.scene
    among, tube, plate = (values(contact_terms(contact)) for contact in bench.contacts())
    material, *walls = (
        values(material_terms(part))
        for part in (bench.case.grain_material, scene.wall_material, scene.wall_material)
    )
    materials = [material, *walls]
    if bench.has_odd:
        materials.append(material | {"youngsModulus": scene.odd_modulus * material["youngsModulus"]})
    tables = {name: "peratomtype " + _row([each[name] for each in materials]) for name in material}
    for name in among:
        factor = scene.odd_friction if name == "coefficientFriction" else 1.0
        with_all = np.array([among[name], tube[name], plate[name], factor * among[name]])
        full = np.empty((4, 4))
        # walls do not touch each other; LIGGGHTS wants their numbers none the less
        full[:] = tube[name]
        full[0] = full[:, 0] = with_all
        full[3] = full[:, 3] = factor * with_all[[0, 1, 2, 0]]
        full[2, 2] = plate[name]
        types = len(materials)
        rows = "  ".join(_row(row[:types]) for row in full[:types])
        tables[name] = f"peratomtypepair {types} {rows}"
    return tables


def _row(numbers: Sequence[float] | np.ndarray) -> str:
    return " ".join(f"{number:.9g}" for number in numbers)


def _cohesion(bench: Bench) -> tuple[str, dict[str, str]]:
    """LIGGGHTS' words for what holds grains together, and the properties that it needs."""
    types = 4 if bench.has_odd else 3
    if work := bench.adhesion():
        density = energy_density(work, bench.radius, bench.modulus)
        pairs = "  ".join(_row([density] * types) for _ in range(types))
        return "cohesion sjkr", {"cohesionEnergyDensity": f"peratomtypepair {types} {pairs}"}
    bridge = bench.bridges()
    if bridge is None:
        return "", {}
    part, tension = wetting(bridge, bench.radius)
    reach = 1.0 + _SPARE * bridge.reach(bench.radius, bench.modulus) / (2.0 * bench.smallest_radius)
    scalars = {
        "surfaceLiquidContentInitial": part,
        "surfaceTension": tension,
        "fluidViscosity": 0.0,
        "minSeparationDistanceRatio": 1.01,
        "maxSeparationDistanceRatio": reach,
    }
    written = {name: f"scalar {value:.9g}" for name, value in scalars.items()}
    return "cohesion easo/capillary/viscous", written | {"contactAngle": "peratomtype " + _row([0.0] * types)}


def energy_density(work: float, radius: float, modulus: float) -> float:
    """Energy density k [J/m3] of ``sjkr`` with which two spheres are as hard to part as after JKR.

    Its attraction is k 2 pi R* d, beside Hertz's 4/3 E* sqrt(R*) d^(3/2); their sum pulls by
    (2 pi R* k)^3 / (6.75 K^2) at the most, K = 4/3 E* sqrt(R*). JKR's contact holds 3/2 pi W R*.

    Parameters
    ----------
    work
        Of adhesion, W [J/m2].
    radius, modulus
        Radius of both spheres [m], effective modulus E* [Pa].
    """
    reduced = radius / 2.0
    stiffness = 4.0 / 3.0 * modulus * math.sqrt(reduced)
    pull = 1.5 * math.pi * work * reduced
    return math.cbrt(6.75 * stiffness**2 * pull) / (2.0 * math.pi * reduced)


def wetting(bridge: CapillaryBridge, radius: float) -> tuple[float, float]:
    """Liquid over solid volume, and tension [N/m], with which two touching spheres pull as the bridge does.

    ``easo/capillary/viscous`` takes of each sphere's liquid the part (1 - sqrt(3)/2) / 2, and its force on
    contact is pi g R (exp(B) + C), with V* = V / R^3, B = 0.48 - 0.0082 ln V*, C = 0.078 + 0.0018 ln V*
    (Soulie et al., Int. J. Numer. Anal. Methods Geomech. 30 (2006) 213-228); the bridge's is 2 pi R g. Both
    break at the cube root of the volume.
    """
    part = bridge.bridge_volume / ((1.0 - math.sqrt(0.75)) * 4.0 / 3.0 * math.pi * radius**3)
    log = math.log(bridge.bridge_volume / radius**3)
    return part, bridge.surface_tension * 2.0 / (math.exp(0.48 - 0.0082 * log) + 0.078 + 0.0018 * log)


def _lift(bench: Bench) -> str:
    scene, lift, look = bench.scene, bench.lift, bench.look_steps
    check_rise = bench.check_steps * lift.case.time_step * scene.lift_speed
    turning = scene.turn_rate > 0.0
    period = 2.0 * math.pi / scene.turn_rate if turning else 0.0
    turn = f"fix turn all move/mesh mesh tube rotate origin 0 0 0 axis 0 0 1 period {period:.9g}"
    amplitude, frequency = scene.vibration_amplitude, scene.vibration_frequency
    shaking = amplitude > 0.0
    wiggle = f"amplitude 0 0 {amplitude:.9g} period {1.0 / frequency:.9g}"
    shake = f"fix shake all move/mesh mesh plate wiggle {wiggle}"
    # motions that are superposed are taken off in reverse order
    still = ("unfix turn\n" if turning else "") + "unfix lift\n"
    steps = lift.steps(scene.vibration_time)
    if shaking:
        still += _SHAKING.format(steps=steps, more=-steps % look)
    return _LIFT.format(
        speed=scene.lift_speed,
        turn=turn if turning else "",
        shake=shake if shaking else "",
        look=look,
        check=bench.check_steps,
        frames=FRAMES,
        drag=DRAG,
        reach=lift.reach,
        lift_checks=math.ceil(GONE * scene.height / check_rise) + 1,
        check_rise=check_rise,
        still=still,
    )


def _rest(bench: Bench, name: str) -> str:
    limit = bench.lift.settle_limit if name == "settle" else bench.lift.rest_limit
    return rest_loop(bench.lift, name, limit, "quit", bench.check_steps)
