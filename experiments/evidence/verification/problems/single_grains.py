"""Single grains against closed forms: drop, incline, roll, and a ball on a plane."""

import math
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from dem_warp import (
    Case,
    ClumpShape,
    Drop,
    GrainPopulation,
    Incline,
    Interaction,
    Material,
    Numerics,
    Roll,
    rayleigh_time,
    simulate,
)
from dem_warp.solver import CHUNK, Solver
from dem_warp.walls import Plane
from experiments.evidence.verification.check import Result, Row, absolute_row, relative_row
from experiments.evidence.verification.problems.contact_ode import solve_impact
from experiments.evidence.verification.problems.impact import Impact
from experiments.evidence.verification.problems.kicks import RIGID_BODY, SAME_LAW
from experiments.evidence.verification.problems.normal_impact import clamped_restitution
from experiments.evidence.verification.problems.setups import (
    CLUMP,
    GRAVITY,
    PRECISIONS,
    STEEL,
    bodies,
    contact,
    downhill,
    world,
)

RADIUS = 5e-3
SUBSTANCE = Material(density=1000.0, shear_modulus=10e6, poisson_ratio=0.25)
"""Ball: radius [m] and substance."""
STEP = 0.25 * rayleigh_time(RADIUS, SUBSTANCE)
"""Time step of a ball on a plane [s]."""

HEIGHTS = (0.05, 0.15, 0.5)
"""Heights of the falls [m]."""

RESTITUTION, SLIDING, STICKING = 0.5, 0.1, 1.0
"""Restitution of the falls, and frictions with which a ball slides off a plate at 45 degrees, and sticks."""

FRICTION, ROLLING = 0.3, 0.05
"""Friction of the sledge, and rolling friction of the ball."""

SLOPE, DISTANCE = math.radians(30.0), 0.1
COPIES = 4

TEXT = f"""Copies of a grain, each by itself in one world. *Drop*: a ball falls on a plate and
rebounds with its restitution from every height. On a plate at 45 degrees it slides throughout, or
sticks; both as in the chapter on oblique impact. *Incline*: a sledge of three buckwheat grains
slides at atan(friction) and a ball rolls off at atan(rolling friction), seen once they move at 3 %
of sqrt(g d): at 1 degree per second within a degree. A ball that rolls gains 5/7 g (sin a - mu_r
cos a). *Roll*: a ball runs out until rolling friction has taken its energy, on the slope, in the
rounded foot, where its weight and the centripetal load press it on the plate, and on the level
plate. The usual reading, S sin b / (S cos b + L), leaves that load out: it gives 5 % more than
the rolling friction of {ROLLING:g}. *A ball on a plane* that slides comes to roll at 5/7 of its
speed, and rests for ten seconds below its rolling angle: rolling friction may stop a spin, and
never turns it back."""


def single_grains(device: str) -> Result:
    """Return the rows of all tests of single grains."""
    plate = Incline(STEEL, grain_count=COPIES, rotation_rate=1.0 / 360.0)
    run = Roll(SLOPE, DISTANCE, STEEL, grain_count=COPIES, run=2.0)
    drops = [_case(Drop(height, STEEL, grain_count=COPIES)) for height in HEIGHTS]
    inclined = Drop(HEIGHTS[0], STEEL, grain_count=COPIES, plate_angle=math.pi / 4)
    oblique = [_case(inclined, friction) for friction in (SLIDING, STICKING)]
    soft = Numerics(modulus_scale=10.0)
    sledge = replace(_case(replace(plate, sledge=3), FRICTION), grains=_grains(ClumpShape.read(CLUMP)))
    slow = [
        replace(case, numerics=soft)
        for case in (sledge, _case(plate, 0.8, ROLLING), _case(run, 0.8, ROLLING))
    ]
    results = simulate([*drops, *oblique, *slow], device=device)
    seen = [result.observables for result in results]
    rebounds = [each["rebound_restitution"] for each in seen[:3]]
    drop = ("Drop", f"e = {RESTITUTION:g}, from 50, 150 and 500 mm", "restitution", "the one that was chosen")
    tangent = partial(absolute_row, tolerance=5e-3)
    ratio = "tangential speed after over before"
    slides = ("Drop at 45 degrees", f"mu = {SLIDING:g}", ratio, RIGID_BODY)
    sticks = ("Drop at 45 degrees", f"mu = {STICKING:g}", ratio, SAME_LAW)
    rigid = 1.0 - SLIDING * (1.0 + clamped_restitution(RESTITUTION))
    return Result(
        "Single grains",
        TEXT,
        (
            relative_row(drop, RESTITUTION, rebounds, 0.01),
            tangent(slides, rigid, seen[3]["tangential_ratio"]),
            tangent(sticks, _stuck(), seen[4]["tangential_ratio"]),
            _angle_row("a sledge of three grains slides", FRICTION, seen[5]["start_angle"]),
            _angle_row("a ball rolls", ROLLING, seen[6]["start_angle"]),
            *(row for precision in PRECISIONS for row in _plane_rows(precision, device)),
            _run_row(run, seen[7]["run_out"]),
        ),
    )


def _grains(shape: ClumpShape) -> GrainPopulation:
    return GrainPopulation(shape, SUBSTANCE, size_sd=0.0)


def _case(scene: Drop | Incline | Roll, friction: float = 0.3, rolling: float = 0.0) -> Case:
    surface = Interaction(RESTITUTION, friction, rolling)
    fine = Numerics(time_step_fraction=0.03)
    return Case(scene, _grains(ClumpShape.sphere(RADIUS)), surface, surface, seed=1, numerics=fine)


def _stuck() -> float:
    """Return the tangential speed of a ball that sticks over that before, by the law's equation."""
    speed = math.sqrt(GRAVITY * HEIGHTS[0])
    impact = Impact(SUBSTANCE, RADIUS, speed, speed, RESTITUTION, STICKING, plate=STEEL)
    return float(solve_impact(impact).tangential[0] / speed)


def _angle_row(what: str, coefficient: float, angle: float) -> Row:
    labels = ("Incline", what, "angle at which it moves [degrees]", "atan of the coefficient")
    return absolute_row(labels, math.degrees(math.atan(coefficient)), angle, 1.0)


def _ball(
    precision: str, device: str, friction: float, rolling: float, slope: float = 0.0, speed: float = 0.0
) -> Solver:
    """Return a ball that stands on a plane under its own weight, and moves along x."""
    law = contact(SUBSTANCE, SUBSTANCE, 0.5, friction, rolling)
    weight = SUBSTANCE.density * 4.0 / 3.0 * math.pi * RADIUS**3 * GRAVITY * math.cos(slope)
    overlap = (0.75 * weight / (law.modulus * math.sqrt(RADIUS))) ** (2.0 / 3.0)
    grains = bodies([0.0, 0.0, RADIUS - overlap], SUBSTANCE.density, velocities=[speed, 0.0, 0.0])
    gravity, walls = downhill(math.degrees(slope)), (Plane(),)
    setup = world(grains, ClumpShape.sphere(RADIUS), law, STEP, walls=walls, gravity=gravity, extent=0.1)
    return Solver([setup], device, precision)


def _advance(solver: Solver, time: float) -> tuple[float, np.ndarray, float]:
    """Pass a time [s] or a little more; return the time [s], the ball's place [m] and its speed [m/s]."""
    solver.advance(math.ceil(time / (STEP * CHUNK)))
    pose = solver.poses(0)
    return solver.view([0])[0].time, pose["positions"].copy(), float(pose["velocities"][0, 0])


def _plane_rows(precision: str, device: str) -> list[Row]:
    """Check a ball that slides, one that rests on half its rolling angle, and one that rolls down."""
    words = PRECISIONS[precision]
    slid = _advance(_ball(precision, device, 0.2, 0.0, speed=0.1), 0.05)[2] / 0.1
    rests = _ball(precision, device, 0.8, 0.2, math.atan(0.1))
    moved = np.abs(_advance(rests, 0.5)[1] - _advance(rests, 10.0)[1]).max()
    rolls = _ball(precision, device, 0.8, ROLLING, SLOPE)
    (early, _, slow), (late, _, fast) = _advance(rolls, 0.02), _advance(rolls, 0.06)
    wanted = 5.0 / 7.0 * GRAVITY * (math.sin(SLOPE) - ROLLING * math.cos(SLOPE))
    # the rounding of a position; in production precision less than a count of the length unit
    least = 1e-15 if precision == "double" else 1e-9
    slides = ("Ball slides, then rolls", f"mu = 0.2, {words}", "speed over that before", "5/7")
    creep = ("Ball rests on a slope", f"mu_r = 0.2, atan(0.1), {words}", "creep in 10 s [m]", "none")
    labels = ("Ball rolls down 30 degrees", words, "acceleration [m/s2]", "5/7 g (sin a - mu_r cos a)")
    return [
        relative_row(slides, 5.0 / 7.0, slid, 1e-3),
        absolute_row(creep, 0.0, moved, least),
        relative_row(labels, wanted, (fast - slow) / (late - early), 2e-3),
    ]


def _run_row(scene: Roll, run: float) -> Row:
    """Check the run-out of a ball against the energy over m g that rolling friction takes along its way."""
    left = (scene.distance - scene.tangent) * (math.sin(SLOPE) - ROLLING * math.cos(SLOPE))
    radius, turns = scene.foot_radius - RADIUS, np.linspace(SLOPE, 0.0, 2001)
    for turn, after in pairwise(turns):
        pressed = radius * math.cos(turn) + 10.0 / 7.0 * left
        left += (turn - after) * (radius * math.sin(turn) - ROLLING * pressed)
    labels = (
        "Roll",
        f"mu_r = {ROLLING:g}, 100 mm down 30 degrees",
        "run-out [m]",
        "energy of a rolling ball",
    )
    return relative_row(labels, scene.tangent + left / ROLLING, run, 0.02)
