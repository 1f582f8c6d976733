"""Oblique and spinning impacts: the rigid-body limit, and the law's own equation of motion."""

import math
from collections.abc import Sequence

import numpy as np

from experiments.evidence.verification.check import Curve, Plot, Result, Row, absolute_row
from experiments.evidence.verification.problems import chung_ooi
from experiments.evidence.verification.problems.impact import Course, Impact, Partner
from experiments.evidence.verification.problems.kicks import (
    STEPS,
    friction_speed,
    kicks_of,
    law_rows,
    simulated_courses,
    sliding_rows,
    slip_before,
    solved_kicks,
)
from experiments.evidence.verification.problems.setups import material

ANGLES = np.array([2.0, *np.arange(5.0, 86.0, 5.0)])
SPINS = np.array([0.1, 0.2, 0.4, 0.6, 0.8, 1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0, 7.0, 8.0])
OBLIQUE_TEXT = """A sphere meets a rigid plane at 3.9 m/s under angles from 2 to 85 degrees, with the
constants of the experiment of Kharaz, Gorham and Salman (Powder Technology 120 (2001) 281-291). Two
references. *The same law as a differential equation*: Hertz spring, damping, no-slip spring and Coulomb
limit written anew and integrated by SciPy to 1e-10 between events of stick and slip. *Rigid bodies*, where
the contact slides throughout: an impulse of friction times the normal impulse, and 5/2 of it as spin. With
damping that may attract, friction ends where repulsion ends, so the normal impulse that friction sees is 1 +
e' with e' the clamped restitution of the chapter before: 1.55 instead of 1.5 at e = 0.5, and 1.31 instead of
1.18 at the e = 0.18 of buckwheat. Changes are over mu (1 + e) v, with v the normal speed."""

SPIN_TEXT = """A spinning sphere falls on a plane (test 6), on its like (test 7: opposite spins, whose
surfaces run together, and equal ones), and on a sphere five times as large at rest (test 8). A partner a
thousand times as stiff and dense must act as the plane does. References as in the chapter on oblique impact;
linear momentum is kept to rounding. Over the normal speed, the slips of all pairs fall on one curve."""


def oblique_impact(device: str) -> Result:
    """Chung and Ooi's test 4: constant speed, angles from 2 to 85 degrees."""
    problem = "Chung and Ooi test 4: oblique impact"
    rows: list[Row] = []
    curves: dict[str, list[Curve]] = {"restitution": [], "spin": [], "rebound": []}
    radians = np.deg2rad(ANGLES)
    for name, substance in chung_ooi.OBLIQUE_MATERIALS.items():
        impacts = [chung_ooi.oblique(substance, 3.9 * math.cos(a), 3.9 * math.sin(a)) for a in radians]
        courses, want = simulated_courses(impacts, STEPS, device), solved_kicks(impacts)
        got = kicks_of(courses)
        case = f"{name}, {len(ANGLES)} angles from 2 to 85 deg, {STEPS} steps"
        rows += law_rows(problem, case, got, want, 5e-3)
        rows += sliding_rows(problem, name, impacts, got)
        mixed = kicks_of(simulated_courses(impacts, STEPS, device, "mixed"))
        rows += law_rows(problem, f"{case}, production precision", mixed, want, 5e-3)
        step = f"{name}, 25 % of the Rayleigh time ({impacts[0].production_steps:.1f} steps at 2 deg)"
        rows += law_rows(problem, step, kicks_of(simulated_courses(impacts, None, device)), want, None)
        for key, points, line in _angle_curves(impacts, got, want):
            colour = len(curves[key])
            curves[key] += [
                Curve(name, ANGLES, points, "points", colour),
                Curve(f"{name}, law", ANGLES, line, colour=colour),
            ]
    titles = {
        "restitution": "tangential speed after / before",
        "spin": "spin after [rad/s]",
        "rebound": "rebound angle of the contact point [deg]",
    }
    plots = tuple(
        Plot(f"oblique-{key}", "Test 4", "angle of incidence [deg]", title, tuple(curves[key]))
        for key, title in titles.items()
    )
    return Result("Oblique impact at constant speed", OBLIQUE_TEXT, tuple(rows), plots)


def _angle_curves(
    impacts: Sequence[Impact], got: np.ndarray, want: np.ndarray
) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Quantities of the paper's figures for test 4: name, simulated and the law's."""
    size = np.array([friction_speed(i) for i in impacts])
    before = np.array([i.tangential_speed for i in impacts])
    after_normal = np.array([i.restitution * i.normal_speed for i in impacts])
    radius = impacts[0].radius
    shown = []
    for kicks in (got, want):
        tangential, surface = before + size * kicks[:, 0], size * kicks[:, 1]
        rebound = np.degrees(np.arctan((tangential - surface) / after_normal))
        shown.append((tangential / before, surface / radius, rebound))
    return [(key, shown[0][k], shown[1][k]) for k, key in enumerate(("restitution", "spin", "rebound"))]


def spinning_impact(device: str) -> Result:
    """Chung and Ooi's tests 6 to 8: a spinning sphere on a plane, on its like and on a larger sphere."""
    alloy = chung_ooi.ALUMINIUM_ALLOY
    heavy = material(70e12, 0.33, 2700e3)
    tests = {
        "6: spinning sphere on a plane": [chung_ooi.spinning(s) for s in SPINS],
        "7: equal spheres, opposite spins": [
            chung_ooi.spinning(s, Partner(alloy, 0.1, spin=-s)) for s in SPINS
        ],
        "7: equal spheres, equal spins": [chung_ooi.spinning(s, Partner(alloy, 0.1, spin=s)) for s in SPINS],
        "8: larger sphere, a thousand times as stiff and dense": [
            chung_ooi.spinning(s, Partner(heavy, 0.5)) for s in SPINS
        ],
        "8: larger sphere of the same material": [chung_ooi.spinning(s, Partner(alloy, 0.5)) for s in SPINS],
    }
    rows: list[Row] = []
    kicks = {}
    for test, impacts in tests.items():
        problem = f"Chung and Ooi test {test}"
        courses, want = simulated_courses(impacts, STEPS, device), solved_kicks(impacts)
        kicks[test] = got = kicks_of(courses)
        case = f"{len(SPINS)} spins from {SPINS[0]:g} to {SPINS[-1]:g} rad/s, {STEPS} steps"
        if "opposite" in test:
            labels = (problem, case, "change of surface speeds over the speed before", "no slip: none")
            # the spin is carried through some 1,600 steps, each of which rounds by 1e-16
            rows.append(absolute_row(labels, 0.0, max(map(_surface_change, courses)), 1e-11))
        else:
            rows += law_rows(problem, case, got, want, 5e-3)
            rows += sliding_rows(problem, "aluminium alloy", impacts, got)
        if impacts[0].partner:
            rows += _momentum_rows(problem, case, courses)
    plots = (_recoil_plot(tests, kicks),)
    return Result("Impacts of spinning spheres", SPIN_TEXT, tuple(rows), plots)


def _surface_change(course: Course) -> float:
    """Largest change of a sphere's tangential speed or of its surface's by spin, over that before."""
    surface = course.impact.radius * abs(course.impact.spin)
    speeds = np.ptp(course.velocities[[0, -1], :, 0], axis=0)
    spins = course.impact.radius * np.ptp(course.spins[[0, -1], :, 1], axis=0)
    return float(np.maximum(speeds, spins).max() / surface)


def _momentum_rows(problem: str, case: str, courses: Sequence[Course]) -> list[Row]:
    """Linear momentum of both spheres, over the momentum that came in."""
    gaps = []
    for course in courses:
        masses = np.array([course.impact.mass, course.impact.partner_mass])
        momentum = masses @ course.velocities[[0, -1]]
        gaps.append(np.abs(momentum[1] - momentum[0]).max() / (masses[0] * course.impact.normal_speed))
    labels = (problem, case, "change of momentum over what came in", "conservation")
    return [absolute_row(labels, 0.0, max(gaps), 1e-12)]


def _recoil_plot(tests: dict[str, list[Impact]], kicks: dict[str, np.ndarray]) -> Plot:
    curves = []
    for test, impacts in tests.items():
        if "opposite" in test:
            continue
        before = np.array([slip_before(i) / i.normal_speed for i in impacts])
        # any two solid spheres: slip changes by 1 + 5/2 of the impulse over the effective mass
        slowed = np.array([3.5 * i.friction * (1.0 + i.restitution) for i in impacts]) * kicks[test][:, 0]
        after = (before - slowed) / np.array([i.restitution for i in impacts])
        curves.append(Curve(test, before, after, "points"))
    axes = ("slip before / normal speed", "slip after / normal speed after")
    return Plot("spinning-recoil", "Tests 6 to 8: slip of the contact point", *axes, tuple(curves))
