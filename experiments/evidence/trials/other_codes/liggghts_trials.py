"""The lifted cylinder of a trial as an input of LIGGGHTS, filmed and weighed while the tube rises."""

import math

import numpy as np

from dem_warp.laws.capillary import CapillaryBridge
from dem_warp.scenes.lifted_cylinder import GONE
from experiments.evidence.trials.other_codes.code_surfaces import BIN, FILL_MARGIN, Bench
from experiments.evidence.trials.other_codes.dump_reading import DRAG, FRAMES
from experiments.evidence.trials.other_codes.odd_lift import OddLift
from experiments.export import liggghts_text as text
from experiments.export import values
from experiments.export.lift import prism, stl_text
from experiments.export.liggghts_exporter import CONVENTIONS, LIGGGHTS
from experiments.export.script_text import Rain, clear_loop, plain, rest_loop, watched

INPUT, TUBE, PLATE = "lift.in", "tube.stl", "plate.stl"

GRAIN, ODD = 1, 4
TYPES = ("grains", "tube", "plate", "grains of another kind")
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
fix lift all move/mesh mesh tube linear 0 0 {speed:.9g}
{turn}
{shake}
dump film all custom {look} {frames} id id_multisphere x y z vx vy vz radius
dump_modify film sort id format "%d %d %.9g %.9g %.9g %.6g %.6g %.6g %.9g"
fix balance all ave/time 1 {look} {look} f_tube[3] file {drag}
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
    phases = [
        _setup(bench),
        rest_loop(bench.lift, "settle", "quit", bench.check_steps),
        _lift(bench),
        rest_loop(bench.lift, "rest", "quit", bench.check_steps),
        end,
    ]
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
    scene, lift, look = bench.scene, bench.lift, bench.look_steps
    half_width, _, bottom = scene.room(lift.reach)
    top = max(bench.rain_top, (1.0 + GONE) * scene.height) + 4.0 * lift.reach
    words = CONVENTIONS.words(CONVENTIONS.nearest_laws(bench.case.laws))
    cohesion, numbers = _cohesion(bench)
    pair_model = text.model_words(words | {"cohesion": cohesion})
    fill = lift.steps(lift.count / bench.rain_rate + FILL_MARGIN)
    rain = Rain(
        bench.rain_radius,
        lift.rain_bottom - lift.reach,
        bench.rain_top,
        lift.count,
        bench.rain_rate,
        lift.steps(bench.rain_period),
        scene.rain_speed,
    )
    kinds = [(template, part, ODD if is_odd else GRAIN) for is_odd, template, part in bench.kinds()]
    parts = [
        text.head(
            TYPES if bench.has_odd else TYPES[:-1],
            (-half_width, half_width, -half_width, half_width, bottom, top),
            lift.skin,
            BIN * (2.0 * lift.largest_radius + lift.skin),
            _SORTING,
        ),
        text.contacts(_properties(bench) | numbers, pair_model, lift.case.time_step),
        text.weight(scene.gravity),
        _WALLS.format(model=text.model_words(words)),
        text.pouring(kinds, rain, lift.seeds(2 + len(kinds))),
        watched(lift, bench.check_steps),
        f"\nrun {look * math.ceil(fill / look)}\nunfix rain\n",
    ]
    return "".join(parts)


def _properties(bench: Bench) -> dict[str, str]:
    """Write the global properties of the types: grains, tube, plate, and grains of another kind."""
    scene = bench.scene
    among, tube, plate = (values(LIGGGHTS.contact_terms(contact)) for contact in bench.contacts())
    material, wall = (
        values(LIGGGHTS.material_terms(part)) for part in (bench.case.grain_material, scene.wall_material)
    )
    materials = [material, wall, wall]
    if bench.has_odd:
        materials.append(material | {"youngsModulus": scene.odd_modulus * material["youngsModulus"]})

    def contact(i: int, j: int) -> dict[str, float]:
        own, other = (0 if kind == ODD - 1 else kind for kind in sorted((i, j)))
        # walls do not touch each other, but LIGGGHTS wants numbers for them
        terms = (among, tube, plate)[max(own, other) if min(own, other) == 0 or i == j else 1]
        factor = scene.odd_friction if ODD - 1 in (i, j) else 1.0
        return terms | {"coefficientFriction": factor * terms["coefficientFriction"]}

    return text.properties(materials, contact)


def _cohesion(bench: Bench) -> tuple[str, dict[str, str]]:
    """LIGGGHTS' words for what holds grains together, and the properties that it needs."""
    types = 4 if bench.has_odd else 3
    if work := bench.adhesion():
        density = energy_density(work, bench.radius, bench.modulus)
        pairs = "  ".join(plain([density] * types) for _ in range(types))
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
    return "cohesion easo/capillary/viscous", written | {
        "contactAngle": "peratomtype " + plain([0.0] * types)
    }


def energy_density(work: float, radius: float, modulus: float) -> float:
    """Energy density k [J/m3] of ``sjkr`` with which two spheres are as hard to part as after JKR.

    Its attraction is k 2 pi R* d, against Hertz's 4/3 E* sqrt(R*) d^(3/2); their sum pulls by
    (2 pi R* k)^3 / (6.75 K^2) at the most, K = 4/3 E* sqrt(R*). JKR's contact holds 3/2 pi W R*.
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
