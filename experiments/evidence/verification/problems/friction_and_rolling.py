"""Sliding, rolling and rest on a plane, against closed forms."""

import math

import numpy as np

from dem_warp import ClumpShape, Material, rayleigh_time
from dem_warp.model import ContactCoefficients, WorldSetup
from dem_warp.solver import CHUNK, Solver
from dem_warp.walls import Plane
from experiments.evidence.verification.check import Curve, Plot, Result, Row, absolute_row, relative_row
from experiments.evidence.verification.problems.setups import (
    BUCKWHEAT,
    CLUMP,
    GRAVITY,
    PRECISIONS,
    bodies,
    contact,
    downhill,
    record,
    world,
)

RADIUS = 5e-3
SUBSTANCE = Material(density=1000.0, shear_modulus=10e6, poisson_ratio=0.25)
SPEED = 0.1
ROLLING = 0.05
STEP = 0.25 * rayleigh_time(RADIUS, SUBSTANCE)

CLUMP_FRICTION = 0.2
SLOPES = np.array([-2.0, -0.2, -0.1, -0.05, 0.05, 0.1, 0.2, 2.0])
"""Slopes of the plane under the clump, from the friction angle [deg]."""

TEXT = """Rolling friction is the directional constant torque mu_r F_n R, as a limiter: it may stop a spin
and never turns it back. So a rolling sphere stops where the closed form says, and one at rest below the
rolling angle stays, without the trembling of an explicit torque. A clump on three feet holds below the
friction angle and slides above it."""


def rolling_law(friction: float, rolling: float = 0.0) -> ContactCoefficients:
    """Contact of the ball and the plane."""
    return contact(SUBSTANCE, SUBSTANCE, 0.5, friction, rolling)


def static_overlap(law: ContactCoefficients, slope: float = 0.0) -> float:
    """Overlap [m] at which the ball's contact carries its weight across a slope [deg]."""
    weight = SUBSTANCE.density * 4.0 / 3.0 * math.pi * RADIUS**3 * GRAVITY * math.cos(math.radians(slope))
    return float((0.75 * weight / (law.modulus * math.sqrt(RADIUS))) ** (2.0 / 3.0))


def lever(law: ContactCoefficients) -> float:
    """Distance from the ball's centre to its contact, half the overlap above the plane [m]."""
    return RADIUS - 0.5 * static_overlap(law)


def ball(
    law: ContactCoefficients,
    slope: float = 0.0,
    speed: float = 0.0,
    spin: tuple[float, ...] = (0.0, 0.0, 0.0),
) -> WorldSetup:
    """Follow a ball that stands on a plane under its own weight, and moves along x."""
    place = [0.0, 0.0, RADIUS - static_overlap(law, slope)]
    grains = bodies(place, SUBSTANCE.density, velocities=[speed, 0.0, 0.0], spins=spin)
    shape = ClumpShape.sphere(RADIUS)
    return world(grains, shape, law, STEP, walls=(Plane(),), gravity=downhill(slope), extent=0.1)


def advanced(setups: list[WorldSetup], time: float, precision: str, device: str) -> Solver:
    """Solver of worlds of one time step, past a time [s]."""
    solver = Solver(setups, device, precision)
    solver.advance(math.ceil(time / (setups[0].time_step * CHUNK)))
    return solver


def sliding_row(precision: str, device: str) -> Row:
    """Check that a sliding ball comes to roll at 5/7 of its speed."""
    solver = advanced([ball(rolling_law(0.2), speed=SPEED)], 0.05, precision, device)
    labels = ("Sliding turns to rolling", f"mu = 0.2, {PRECISIONS[precision]}", "speed over v0", "5/7")
    return relative_row(labels, 5.0 / 7.0, solver.poses(0)["velocities"][0, 0] / SPEED, 1e-3)


def stopping_rows(precision: str, device: str) -> list[Row]:
    """Check that a rolling ball stops where the constant directional torque says, and stays."""
    law = rolling_law(0.5, ROLLING)
    arm = lever(law)
    # m a = -f and (2/5) m R^2 a / L = f L - mu_r m g L, with L the lever
    braking = ROLLING * GRAVITY / (1.0 + 0.4 * (RADIUS / arm) ** 2)
    setup = ball(law, speed=SPEED, spin=(0.0, SPEED / arm, 0.0))
    pose = advanced([setup], 1.2 * SPEED / braking, precision, device).poses(0)
    problem, case = "Rolling ball stops", f"mu_r = {ROLLING:g}, {PRECISIONS[precision]}"
    path = (problem, case, "path [m]", "v0^2 (1 + 2/5) / (2 mu_r g), up to half the overlap")
    rest = (problem, case, "speed after the stop [m/s]", "at rest")
    return [
        relative_row(path, 0.5 * SPEED**2 / braking, pose["positions"][0, 0], 1e-3),
        absolute_row(rest, 0.0, np.abs(pose["velocities"]).max(), 1e-6),
    ]


def twisting(device: str) -> tuple[list[Row], Plot]:
    """Check that a spin about the normal falls on a straight line to zero and never turns back."""
    law, spin = rolling_law(0.0, ROLLING), 5.0
    rate = ROLLING * GRAVITY * lever(law) / (0.4 * RADIUS**2)
    seen = record([ball(law, spin=(0.0, 0.0, spin))], int(1.4 * spin / rate / STEP), device).spins[:, 0, 0, 2]
    times = STEP * np.arange(len(seen))
    line = np.maximum(spin - rate * times, 0.0)
    problem, case = "Spinning ball stops", f"mu_r = {ROLLING:g}, float64"
    rows = [
        absolute_row((problem, case, "spin over that at the start, any time", "5 mu_r g L t / (2 R^2)"), 0.0,
                     np.abs(seen - line).max() / spin, 1e-4),
        absolute_row((problem, case, "least spin [rad/s]", "never reversed"), 0.0, seen.min(), 0.0),
    ]  # fmt: skip
    curves = (
        Curve("simulated", 1e3 * times[::10], seen[::10], "points"),
        Curve("closed form", 1e3 * times, line),
    )
    return rows, Plot("spin-stops", "Spinning ball on a plane", "time [ms]", "spin [rad/s]", curves)


def creep_rows(precision: str, device: str) -> list[Row]:
    """Check that a ball on half its rolling angle stays for ten seconds."""
    rolling = 0.2
    slope = math.degrees(math.atan(0.5 * rolling))
    solver = advanced([ball(rolling_law(0.8, rolling), slope)], 0.5, precision, device)
    early = solver.poses(0)["positions"].copy()
    solver.advance(math.ceil(10.0 / (STEP * CHUNK)))
    moved = float(np.abs(solver.poses(0)["positions"] - early).max())
    case = f"slope {slope:.1f} deg, mu_r = {rolling:g}, {PRECISIONS[precision]}"
    labels = ("Ball rests on a slope", case, "creep in 10 s [m]", "none below the rolling angle")
    # the rounding of a position; in production precision less than a count of the length unit
    return [absolute_row(labels, 0.0, moved, 1e-15 if precision == "double" else 1e-9)]


def clump_rows(precision: str, device: str) -> list[Row]:
    """Check that a clump on three feet holds below the friction angle and slides above it."""
    shape = ClumpShape.read(CLUMP)
    law = contact(BUCKWHEAT, BUCKWHEAT, 0.2, CLUMP_FRICTION)
    foot = -float((shape.centers[:, 2] - shape.radii).min())
    time_step = 0.25 * rayleigh_time(float(shape.radii.min()), BUCKWHEAT)
    angle = math.degrees(math.atan(CLUMP_FRICTION))
    setups = [
        world(
            bodies([0.0, 0.0, foot], BUCKWHEAT.density), shape, law, time_step,
            walls=(Plane(),), gravity=downhill(angle + float(slope)), extent=0.1,
        )
        for slope in SLOPES
    ]  # fmt: skip
    solver = advanced(setups, 0.05, precision, device)
    early = np.array([solver.poses(w)["velocities"][0, 0] for w in range(len(SLOPES))])
    steps = math.ceil(0.1 / (time_step * CHUNK)) * CHUNK
    solver.advance(steps // CHUNK)
    late = np.array([abs(solver.poses(w)["velocities"][0, 0]) for w in range(len(SLOPES))])
    slides = late > 1e-5
    case = f"nine spheres on three feet, mu = {CLUMP_FRICTION:g}, {PRECISIONS[precision]}"
    between = angle + 0.5 * (SLOPES[~slides].max() + SLOPES[slides].min())
    radians = np.radians(angle + SLOPES[slides])
    pull = GRAVITY * (np.sin(radians) - CLUMP_FRICTION * np.cos(radians)) * steps * time_step
    problem = "Clump on a slope"
    holds = (problem, case, "speed where it holds [m/s]", "at rest")
    from_slope = (problem, case, "slope that it slides from [deg]", "friction angle")
    gains = (problem, case, "speed gained where it slides [m/s]", "g (sin - mu cos) t")
    return [
        absolute_row(from_slope, angle, between, 0.2),
        absolute_row(holds, 0.0, late[~slides].max(), 1e-6),
        relative_row(gains, pull, (late - early)[slides], 5e-3),
    ]


def friction_and_rolling(device: str) -> Result:
    """Item by item: sliding to rolling, stopping, no creep, and a clump's friction angle."""
    rows: list[Row] = []
    for precision in PRECISIONS:
        rows.append(sliding_row(precision, device))
        rows += stopping_rows(precision, device)
        rows += creep_rows(precision, device)
        rows += clump_rows(precision, device)
    spin_rows, plot = twisting(device)
    return Result("Friction and rolling", TEXT, (*rows, *spin_rows), (plot,))
