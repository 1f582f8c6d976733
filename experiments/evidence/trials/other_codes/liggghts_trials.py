"""The lifted cylinder of a trial as an input of LIGGGHTS, filmed and weighed while the tube rises."""

import math

import numpy as np

from dem_warp import effective_moduli
from dem_warp.laws.capillary import CapillaryBridge
from dem_warp.scenes.lifted_cylinder import GONE
from experiments.evidence.trials.other_codes.code_surfaces import BIN, FILL_MARGIN, Bench
from experiments.evidence.trials.other_codes.dump_reading import DRAG, FRAMES
from experiments.export import liggghts_text as text
from experiments.export import values
from experiments.export.lift import stl_text
from experiments.export.liggghts_exporter import CONVENTIONS, LIGGGHTS
from experiments.export.script_text import Rain, clear_loop, plain, rest_loop, watched

INPUT, TUBE, PLATE = "lift.in", "tube.stl", "plate.stl"

TYPES = ("grains", "tube", "plate")
"""Types of LIGGGHTS's atoms."""

_SORTING = "sort 0 0.0"
"""No sorting of the atoms in memory: its bins fill the empty box, and cost a tenth of the time."""

_SPARE = 1.2
"""Distance at which LIGGGHTS looks for bridges, over that at which they break."""

_WALLS = """
# the plate is a mesh, since it may shake
fix tube all mesh/surface/stress file tube.stl type 2 stress on
fix plate all mesh/surface file plate.stl type 3
fix walls all wall/gran model {model} mesh n_meshes 2 meshes tube plate
fix bodies all multisphere

# filling
"""

_LIFT = """
# lifting; the film and the balance run from now on
variable now equal step
variable begin equal ${{now}}
{shake}
dump film all custom {look} {frames} id id_multisphere x y z vx vy vz radius
dump_modify film sort id format "%d %d %.9g %.9g %.9g %.6g %.6g %.6g %.9g"
fix balance all ave/time 1 {look} {look} f_tube[3] file {drag}
{jump}fix lift all move/mesh mesh tube linear 0 0 {speed:.9g}
variable rise equal 0
{loop}{still}
"""

_SHAKING = """
# the drive runs on, and the film to its next look
variable left equal "v_begin + {steps} - step"
variable go equal ${{left}}
run ${{go}}
unfix shake
run {more}
"""

_JUMP = """\
fix lift all move/mesh mesh tube linear 0 0 {speed:.9g}
run {look}
unfix lift
"""

_PLATE_REST = 0.98
"""Half the plate's side over that of the box: a mesh must not reach its wall."""


def liggghts_files(bench: Bench) -> dict[str, str]:
    """Files of the input of a case, by name."""
    scene = bench.scene
    side = _PLATE_REST * scene.room(bench.lift.reach)[0]
    plate = side * np.array([[[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]]])
    phases = [
        _setup(bench),
        rest_loop(bench.lift, "settle", "quit", bench.check_steps),
        _lift(bench),
        rest_loop(bench.lift, "rest", "quit", bench.check_steps),
        f"\nrun {bench.check_steps}\n",
    ]
    return {
        TUBE: stl_text("tube", scene.tube),
        PLATE: stl_text("plate", plate),
        INPUT: "".join(phases),
    }


def _setup(bench: Bench) -> str:
    scene, lift, look = bench.scene, bench.lift, bench.look_steps
    half_width, _, bottom = scene.room(lift.reach)
    top = max(bench.rain_top, (1.0 + GONE) * scene.height) + 4.0 * lift.reach
    words = CONVENTIONS.words(CONVENTIONS.nearest_laws(bench.case.laws))
    cohesion, numbers = _cohesion(bench)
    pair_model = text.model_words(words | {"cohesion": cohesion})
    fill = lift.steps(lift.count / bench.rain_rate + FILL_MARGIN)
    rain = Rain(
        lift.rain_section,
        lift.rain_bottom - lift.reach,
        bench.rain_top,
        lift.count,
        bench.rain_rate,
        lift.steps(bench.rain_period),
        scene.rain_speed,
    )
    kinds = [(template, template.fraction, 1) for template in bench.templates]
    parts = [
        text.head(
            TYPES,
            (-half_width, half_width, -half_width, half_width, bottom, top),
            lift.skin,
            BIN * (2.0 * lift.largest_radius + lift.skin),
            _SORTING,
        ),
        text.contacts(_properties(bench) | numbers, pair_model, lift.case.time_step),
        text.weight(scene.gravity),
        _WALLS.format(model=text.model_words(words | {"cohesion": cohesion if scene.charge else ""})),
        text.pouring(kinds, rain, lift.seeds(2 + len(kinds))),
        watched(lift, bench.check_steps),
        f"\nrun {look * math.ceil(fill / look)}\nunfix rain\n",
    ]
    return "".join(parts)


def _properties(bench: Bench) -> dict[str, str]:
    """Write the global properties of the types: grains, tube, plate."""
    contacts = [values(LIGGGHTS.contact_terms(contact)) for contact in bench.contacts()]
    material, wall = (
        values(LIGGGHTS.material_terms(part))
        for part in (bench.case.grain_material, bench.scene.wall_material)
    )

    def contact(i: int, j: int) -> dict[str, float]:
        # walls do not touch each other, but LIGGGHTS wants numbers for them
        return contacts[min(i, j) or max(i, j)]

    return text.properties([material, wall, wall], contact)


def _cohesion(bench: Bench) -> tuple[str, dict[str, str]]:
    """LIGGGHTS' words for what holds grains together, or to walls, and the properties that it needs."""
    scene, types, radius = bench.scene, len(TYPES), bench.radius
    among = 1.5 * math.pi * bench.adhesion() * radius / 2.0  # JKR's largest pull between two spheres
    wall_modulus = effective_moduli(bench.case.grain_material, scene.wall_material)[0]
    densities = np.zeros((types, types))
    densities[0, 0] = energy_density(among, radius / 2.0, bench.modulus)
    densities[0, 1:] = energy_density(scene.charge, radius, wall_modulus)
    densities[:, 0] = densities[0]
    if densities.any():
        pairs = "  ".join(plain(row) for row in densities.tolist())
        return "cohesion sjkr", {"cohesionEnergyDensity": f"peratomtypepair {types} {pairs}"}
    bridge = bench.bridges()
    if bridge is None:
        return "", {}
    part, tension = wetting(bridge, radius)
    reach = 1.0 + _SPARE * bridge.reach(radius, bench.modulus) / (
        2.0 * min(float(t.radii.min()) for t in bench.templates)
    )
    scalars = {
        "surfaceLiquidContentInitial": part,
        "surfaceTension": tension,
        "fluidViscosity": 0.0,
        "minSeparationDistanceRatio": 1.01,
        "maxSeparationDistanceRatio": reach,
    }
    written = {name: f"scalar {value:.9g}" for name, value in scalars.items()}
    return "cohesion easo/capillary/viscous", written | {
        "contactAngle": "peratomtype " + plain([0.0] * types)
    }


def energy_density(pull: float, reduced: float, modulus: float) -> float:
    """Energy density k [J/m3] of ``sjkr`` whose largest pull is `pull` [N], at a reduced radius R* [m].

    Its attraction is k 2 pi R* d, against Hertz's 4/3 E* sqrt(R*) d^(3/2); their sum pulls by
    (2 pi R* k)^3 / (6.75 K^2) at the most, K = 4/3 E* sqrt(R*).
    """
    stiffness = 4.0 / 3.0 * modulus * math.sqrt(reduced)
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
    amplitude, frequency = scene.vibration_amplitude, scene.vibration_frequency
    shaking = amplitude > 0.0
    wiggle = f"amplitude 0 0 {amplitude:.9g} period {1.0 / frequency:.9g}"
    shake = f"fix shake all move/mesh mesh plate wiggle {wiggle}"
    still = "unfix lift\n"
    jump = _JUMP.format(speed=scene.jump / (look * lift.case.time_step), look=look)
    steps = lift.steps(scene.vibration_time)
    if shaking:
        still += _SHAKING.format(steps=steps, more=-steps % look)
    return _LIFT.format(
        speed=scene.lift_speed,
        jump=jump if scene.jump else "",
        shake=shake if shaking else "",
        look=look,
        frames=FRAMES,
        drag=DRAG,
        loop=clear_loop(
            bench.check_steps,
            math.ceil(GONE * scene.height / check_rise) + 1,
            lift.reach,
            f"variable rise equal ${{rise}}+{check_rise:.9g}\n",
        ),
        still=still,
    )
