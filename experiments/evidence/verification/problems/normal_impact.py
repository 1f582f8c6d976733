"""Normal impacts: Hertz's solution, the restitution that comes back, and the step of production."""

import math

import numpy as np
from scipy.integrate import solve_ivp

from dem_warp import ClumpShape, Material, rayleigh_time
from dem_warp.walls import Plane
from experiments.evidence.verification.check import (
    Curve,
    Plot,
    Result,
    Row,
    absolute_row,
    order_row,
    relative_row,
)
from experiments.evidence.verification.problems import chung_ooi
from experiments.evidence.verification.problems.impact import HERTZ_DURATION, Course, Impact, simulate_impacts
from experiments.evidence.verification.problems.setups import (
    BUCKWHEAT,
    CLUMP,
    STEEL,
    bodies,
    contact,
    record,
    world,
)

PHASES = (0.0, 0.25, 0.5, 0.75)
"""Parts of a step at which the surfaces meet; what is seen of an impact depends on it: the worst counts."""

HERTZ = "Hertz: Johnson (1985), section 11.4"
QUANTITIES = ("largest overlap [m]", "largest force [N]", "duration [s]", "speed after [m/s]")
HERTZ_ORDERS = (50, 100, 200, 400, 800)
RESTITUTIONS = tuple(np.round(np.arange(0.1, 1.01, 0.1), 1))
RESTITUTION_ORDERS = (100, 200, 400, 800)
FINE = 1000
"""Steps an impact that bring a restitution of 0.1 back within 0.5 %."""


AS_CHOSEN = "the restitution that was chosen"
CLAMPED = "exp(-2 t / tan t), cos t the damping ratio"

ELASTIC_TEXT = """Impacts are those of Y. C. Chung and J. Y. Ooi, Granular Matter 13 (2011) 643-656, eight
tests. The paper itself was not at hand: radii, speeds and constants are those that Yade (tests 1 to 4) and
Kratos Multiphysics (1 to 8) state for the same tests. Not had are the constants of polyethylene (test 5),
nylon (6) and copper (7), the pairs that test 8 compares, and the paper's own curves. Materials matter
little: over the normal speed, an impact of this law is set by restitution, Poisson's ratio, and slip over
friction.

Here two like spheres meet head-on, and a sphere meets a rigid plane, without damping. The reference is
Hertz's solution: largest overlap, largest force, duration, and the force at every step (K. L. Johnson,
Contact Mechanics, 1985). The surfaces meet at four phases of a step, and the worst counts. The scheme is of
second order. At the step of production, 25 % of the Rayleigh time, these stiff and fast spheres leave 11 to
27 steps to an impact. A buckwheat grain of the study is many times heavier than its smallest sphere, so its
impacts take more."""

RESTITUTION_TEXT = """The damping is EDEM's, linear in the speed with the root of the contact's stiffness.
Near the end of an impact it exceeds the spring and attracts. Left alone until the overlap is gone, the
restitution that was chosen comes back. Kept from attracting (`clamp_attraction`), a higher one does: the
table has it against the closed form.

*The campaign leaves the damping alone.* Its factors C and D are restitutions, as are the paper's, and they
mean what they say only in this form, which is EDEM's; clamped, the paper's 0.18 would be 0.31. The damping
force takes the speed of half a step before, so restitution converges at first order: at e = 0.1 it needs
about 1,000 steps an impact for half a percent. At the step of production, a buckwheat grain on steel
(chapter before) comes back with 0.495 for 0.5 and 0.174 for 0.18; the small stiff spheres of test 3, with 18
steps an impact, are further off."""

TIP_SPEED = 1.5
"""Speed of a grain that falls through the whole tube of the study [m/s]."""

UPSIDE_DOWN = (1.0, 0.0, 0.0, 0.0)


def hertz_force(impact: Impact, times: np.ndarray) -> np.ndarray:
    """Force [N] of an elastic impact at times [s] since the surfaces met, from its equation of motion."""
    unit = impact.peak_overlap / impact.normal_speed
    spans = np.clip(times / unit, 0.0, HERTZ_DURATION)

    def rates(_: float, y: np.ndarray) -> list[float]:
        return [y[1], -1.25 * max(y[0], 0.0) ** 1.5]

    span, start = (0.0, HERTZ_DURATION), [0.0, 1.0]
    path = solve_ivp(rates, span, start, "DOP853", dense_output=True, rtol=1e-12, atol=1e-14)
    return impact.peak_force * np.maximum(path.sol(spans)[0], 0.0) ** 1.5


def _seen(course: Course) -> tuple[float, float, float, float]:
    after = course.restitution * course.impact.normal_speed
    return float(course.overlap.max()), float(course.force.max()), course.duration, after


def _hertz(impact: Impact) -> tuple[float, float, float, float]:
    return impact.peak_overlap, impact.peak_force, impact.duration, impact.normal_speed


def hertz_rows(problem: str, case: str, courses: list[Course], tolerance: float) -> list[Row]:
    """Overlap, force, duration, speed after, and force curve against Hertz; the worst course of each."""
    want = np.array([_hertz(c.impact) for c in courses])
    seen = np.array([_seen(c) for c in courses])
    rows = [
        relative_row((problem, case, quantity, HERTZ), want[:, k], seen[:, k], tolerance)
        for k, quantity in enumerate(QUANTITIES)
    ]
    gaps = [np.abs(c.force - hertz_force(c.impact, c.time)).max() / c.impact.peak_force for c in courses]
    labels = (problem, case, "force at any step, off by, over the largest", HERTZ)
    return [*rows, absolute_row(labels, 0.0, gaps, tolerance)]


def _hertz_errors(courses: list[Course]) -> np.ndarray:
    """Largest relative errors over the phases, (4,)."""
    want = np.array(_hertz(courses[0].impact))
    return np.abs(np.array([_seen(c) for c in courses]) / want - 1.0).max(axis=0)


def _drop_on_tip(restitution: float, device: str) -> tuple[float, np.ndarray, np.ndarray]:
    """Return steps, largest forces [N] and speeds after [m/s] of a buckwheat grain on steel."""
    shape = ClumpShape.read(CLUMP)
    time_step = 0.25 * rayleigh_time(float(shape.radii.min()), BUCKWHEAT)
    reach = float((shape.centers[:, 2] + shape.radii).max())
    law = contact(BUCKWHEAT, STEEL, restitution)
    worlds = []
    for phase in PHASES:
        place, fall = [0.0, 0.0, reach + (1.0 + phase) * time_step * TIP_SPEED], [0.0, 0.0, -TIP_SPEED]
        grains = bodies(place, BUCKWHEAT.density, velocities=fall, orientations=UPSIDE_DOWN)
        worlds.append(world(grains, shape, law, time_step, walls=(Plane(),)))
    steps = _tip_impact(shape).duration / time_step
    velocities = record(worlds, int(4.0 * steps), device, "mixed").velocities[:, :, 0, 2]
    peaks = BUCKWHEAT.density * shape.volume * np.diff(velocities, axis=0).max(axis=0) / time_step
    return steps, peaks, velocities[-1]


def _tip_impact(shape: ClumpShape) -> Impact:
    """Impact of a single sphere that is as large as the grain's tip and as heavy as the grain."""
    radius = float(shape.radii[np.argmax(shape.centers[:, 2])])
    density = BUCKWHEAT.density * shape.volume / (4.0 / 3.0 * math.pi * radius**3)
    substance = Material(density, BUCKWHEAT.shear_modulus, BUCKWHEAT.poisson_ratio)
    return Impact(substance, radius, TIP_SPEED, plate=STEEL)


def clamped_restitution(chosen: float) -> float:
    """Restitution of the damped Hertz contact when it ends where the force, not the overlap, vanishes.

    The contact maps onto a damped oscillator (Antypov and Elliott, EPL 94 (2011) 50004): e = exp(-2 t / tan
    t) with cos t its damping ratio.
    """
    if chosen == 1.0:
        return 1.0
    angle = math.acos(-math.log(chosen) / math.hypot(math.log(chosen), math.pi))
    return math.exp(-2.0 * angle / math.tan(angle))


def elastic_impact(device: str) -> Result:
    """Chung and Ooi's tests 1 and 2: elastic normal impact of two spheres, and of a sphere on a plane."""
    rows: list[Row] = []
    plots: list[Plot] = []
    tests = {"1: two spheres": chung_ooi.ELASTIC_PAIRS, "2: sphere on a plane": chung_ooi.ELASTIC_ON_PLANE}
    for test, impacts in tests.items():
        problem = f"Chung and Ooi test {test}"
        names, cases = list(impacts), list(impacts.values())
        seen = {steps: simulate_impacts(cases, steps, device, PHASES) for steps in HERTZ_ORDERS}
        coarse = simulate_impacts(cases, None, device, PHASES)
        mixed = simulate_impacts(cases, 200, device, PHASES, "mixed")
        errors = np.array([_hertz_errors(seen[steps][0]) for steps in HERTZ_ORDERS])
        both = " and ".join(names)
        slowest = min(impact.production_steps for impact in cases)
        runs = {
            f"{both}, 200 steps, float64": (seen[200], 1e-3),
            f"{both}, 200 steps, production precision": (mixed, 1e-3),
            f"{both}, 25 % of the Rayleigh time (from {slowest:.0f} steps)": (coarse, 0.01),
        }
        for case, (by_material, tolerance) in runs.items():
            rows += hertz_rows(problem, case, [c for phases in by_material for c in phases], tolerance)
        for q, quantity in enumerate(QUANTITIES):
            labels = (problem, names[0], f"order of the {quantity.split(' [')[0]}")
            rows.append(order_row(*labels, HERTZ_ORDERS, errors[:, q], 2.0, 1.9))
        plots.append(_force_plot(test, names, [courses[0] for courses in seen[50]]))
    # the errors of both tests are the same: a Hertz impact is one curve, whatever its size
    plots.append(_order_plot("hertz-order", "Tests 1 and 2", HERTZ_ORDERS, errors.T, QUANTITIES))
    return Result("Elastic normal impact", ELASTIC_TEXT, (*rows, *_grain_rows(device)), tuple(plots))


def _grain_rows(device: str) -> list[Row]:
    rows = []
    for chosen in (1.0, 0.5, 0.18):
        steps, peaks, after = _drop_on_tip(chosen, device)
        case = f"e = {chosen:g}, 25 % of the Rayleigh time ({steps:.0f} steps), production precision"
        problem = f"Buckwheat grain on steel, tip first, {TIP_SPEED:g} m/s"
        if chosen == 1.0:
            impact = _tip_impact(ClumpShape.read(CLUMP))
            rows.append(relative_row((problem, case, QUANTITIES[1], HERTZ), impact.peak_force, peaks, 0.01))
        labels = (problem, case, QUANTITIES[3], AS_CHOSEN)
        rows.append(relative_row(labels, chosen * TIP_SPEED, after, None))
    return rows


def _force_plot(test: str, names: list[str], courses: list[Course]) -> Plot:
    curves = []
    for k, (name, course) in enumerate(zip(names, courses, strict=True)):
        impact = course.impact
        times = np.linspace(0.0, impact.duration, 200)
        shown = (course.time > -course.time_step) & (course.time < impact.duration + course.time_step)
        curves.append(Curve(f"{name}, Hertz", 1e6 * times, 1e-3 * hertz_force(impact, times), colour=k))
        points = (1e6 * course.time[shown], 1e-3 * course.force[shown])
        curves.append(Curve(f"{name}, 50 steps", *points, "points", colour=k))
    return Plot(f"hertz-force-{test[0]}", f"Test {test}", "time [us]", "normal force [kN]", tuple(curves))


def _order_plot(
    name: str, title: str, steps: tuple[int, ...], errors: np.ndarray, labels: tuple[str, ...], power: int = 2
) -> Plot:
    at = np.array(steps, dtype=float)
    pairs = zip(labels, errors, strict=True)
    curves = [Curve(label.split(" [")[0], at, error, "points") for label, error in pairs]
    slope = Curve(f"order {power}", at, float(np.max(errors[:, 0])) * (at[0] / at) ** power, "dashed")
    return Plot(name, title, "steps an impact", "relative error", (*curves, slope), logarithmic=True)


def restitution(device: str) -> Result:
    """Chung and Ooi's test 3: the restitution that was chosen comes back; the clamped form's does not."""
    problem = "Chung and Ooi test 3: restitution"
    rows, seen, chosen = [], {}, np.array(RESTITUTIONS)
    for clamp in (False, True):
        # worlds of both materials together: restitution is a number without material
        impacts = [
            chung_ooi.damped(substance, float(e), clamp)
            for e in chosen
            for substance in chung_ooi.RESTITUTION_MATERIALS.values()
        ]
        courses = simulate_impacts(impacts, FINE, device, PHASES, length=4.0)
        back = [[c.restitution for c in phases] for phases in courses]
        seen[clamp] = np.array(back).reshape(len(chosen), -1)
        for e, comes in zip(chosen, seen[clamp], strict=True):
            want, source = (clamped_restitution(e), CLAMPED) if clamp else (e, AS_CHOSEN)
            case = f"e = {e:g}, {'clamped' if clamp else 'damping may attract'}, {FINE} steps, both materials"
            rows.append(relative_row((problem, case, "restitution", source), want, comes, 5e-3))
    orders, errors = _restitution_orders(problem, device)
    fine = np.linspace(0.05, 1.0, 100)
    curves = (
        Curve("damping may attract", chosen, seen[False].mean(axis=1), "points"),
        Curve("as chosen", fine, fine, "dashed"),
        Curve("clamped", chosen, seen[True].mean(axis=1), "points"),
        Curve("clamped, closed form", fine, np.array([clamped_restitution(e) for e in fine])),
    )
    title = "Test 3: restitution that comes back"
    plot = Plot("restitution", title, "restitution chosen", "restitution simulated", curves)
    labels = tuple(f"e = {e:g}" for e in (0.1, 0.18, 0.5))
    order = _order_plot("restitution-order", "Test 3", RESTITUTION_ORDERS, errors, labels, power=1)
    return Result("Restitution", RESTITUTION_TEXT, (*rows, *orders), (plot, order))


def _restitution_orders(problem: str, device: str) -> tuple[list[Row], np.ndarray]:
    """Orders of convergence and errors at the step of production; mean errors over phases, (e, steps)."""
    chosen = (0.1, 0.18, 0.5)
    substance = chung_ooi.ALUMINIUM_OXIDE
    impacts = [chung_ooi.damped(substance, e) for e in chosen]
    errors = np.empty((len(chosen), len(RESTITUTION_ORDERS)))
    for k, steps in enumerate(RESTITUTION_ORDERS):
        courses = simulate_impacts(impacts, steps, device, PHASES, length=4.0)
        for j, (e, phases) in enumerate(zip(chosen, courses, strict=True)):
            errors[j, k] = abs(np.mean([c.restitution for c in phases]) / e - 1.0)
    rows = [
        order_row(problem, f"e = {e:g}", "order of the restitution", RESTITUTION_ORDERS, errors[j], 1.0, 0.9)
        for j, e in enumerate(chosen)
    ]
    for e, phases in zip(chosen, simulate_impacts(impacts, None, device, PHASES, length=4.0), strict=True):
        case = f"e = {e:g}, 25 % of the Rayleigh time ({impacts[0].production_steps:.1f} steps)"
        labels = (problem, case, "restitution", AS_CHOSEN)
        rows.append(relative_row(labels, e, [c.restitution for c in phases], None))
    return rows, errors
