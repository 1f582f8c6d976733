"""Spheres that run out of hoppers: with a flat bottom, against Beverloo's law, and with a cone."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from dem_warp import Case, CaseResult, ClumpShape, GrainPopulation, Hopper, Interaction
from experiments.evidence.verification.check import Curve, Plot, Result, Row, absolute_row, detection_row
from experiments.evidence.verification.problems.janssen import GLASS
from experiments.evidence.verification.problems.setups import GRAVITY, STEEL
from experiments.evidence.verification.problems.stored import finished_cases

K, K_SPREAD = 1.4, 0.2
"""Correction of the outlet, in sphere diameters, fixed before any run."""

EXPONENT = 2.5
LEAST_CONSTANT, LARGEST_CONSTANT = 0.55, 0.65

DIAMETER = 3e-3
"""Mean of the spheres [m]."""

OUTLETS = (6, 7, 8, 9, 10)
"""Diameters of the outlet, in sphere diameters."""

FRICTIONS = {0.092: "spheres of glass", 0.25: "spheres of acetate", 0.5: "rough spheres"}
"""The first two as measured (Foerster et al., 1994); the bounds of C hold for the first."""

ROLLING_FRICTION = 0.01
WIDTH, DEPTH = 2.2, 3.0
"""Sizes of the bin and of its filling, in diameters of the outlet."""

RAIN_SPEED, RAIN_FRACTION = 0.5, 0.07
"""Speed of the rain [m/s], and the part of its volume that is spheres."""

PROBLEM = "Spheres out of a flat-bottomed hopper"
SEEDS = {"cpu": 1, "cuda": 4}

TEXT = f"""Spheres of {1e3 * DIAMETER:g} mm (standard deviation 5 %) fill a round bin with a flat bottom,
and run out of a round hole in it, {OUTLETS[0]} to {OUTLETS[-1]} sphere diameters wide. Bins are {WIDTH:g}
outlets wide, and filled to {DEPTH:g}. The rate is the slope of the mass fallen over time while 20 to 70 %
of it fall.

Beverloo's law is W = C rho sqrt(g) (D - k d)^2.5, with rho the density of the bed as poured (W. A.
Beverloo, H. A. Leniger and J. van de Velde, Chemical Engineering Science 15 (1961) 260-269). k = {K:g} was
fixed before any run, as were the bounds: exponent 2.5 within 0.15, C from {LEAST_CONSTANT:g} to
{LARGEST_CONSTANT:g} at a realistic friction. What k = {K - K_SPREAD:g} and {K + K_SPREAD:g} would give is
stated.

Spheres of glass have a friction of 0.092, and spheres of acetate one of 0.25, as S. F. Foerster, M. Y.
Louge, H. Chang and K. Allia measured (Physics of Fluids 6 (1994) 1108-1115). The bounds of C hold for the
first, whose density the spheres have; with more friction C falls."""


HALF_ANGLES = (30.0, 45.0)
CONE_OUTLET, CONE_SEEDS, CONE_POWER, CONE_BOUND = 6, 4, -0.35, 0.1
"""Half angles of the cones [degrees], their outlet in sphere diameters, and the power of their tangent."""

CONE_TEXT = f"""Rough spheres run out of bins as in the chapter on Beverloo's law, through a cone of a half
angle of {HALF_ANGLES[0]:g} or {HALF_ANGLES[1]:g} degrees in place of the flat bottom: {CONE_SEEDS} bins each,
with holes of {CONE_OUTLET} sphere diameters. H. E. Rose and T. Tanaka (The Engineer 208 (1959) 465-469)
multiply the rate by (tan a tan f)^{CONE_POWER:g}. Their f is the angle of the border of the grains that stand
on a flat bottom; it drops out of the power between two cones. Seeds make that uncertain by .02, and a k that
differs by .1 between the cones would move it by the bound, {CONE_BOUND:g}. The rate over that of a flat
bottom is stated, next to that at f = 45 degrees."""


def hopper_case(outlet: float, friction: float, seed: int, half_angle: float = 90.0) -> Case:
    """Bin with an outlet of some sphere diameters; all bins have the same proportions."""
    width = WIDTH * outlet * DIAMETER
    hopper = Hopper(
        diameter=width,
        fill_depth=DEPTH * outlet * DIAMETER,
        outlet=outlet * DIAMETER,
        wall_material=STEEL,
        rain_speed=RAIN_SPEED,
        rain_rate=RAIN_FRACTION * RAIN_SPEED * 1.5 * width**2 / DIAMETER**3,
        half_angle=math.radians(half_angle),
    )
    surfaces = Interaction(restitution=0.5, static_friction=friction, rolling_friction=ROLLING_FRICTION)
    grains = GrainPopulation(ClumpShape.sphere(DIAMETER / 2.0), GLASS)
    return Case(hopper, grains, surfaces, surfaces, seed=seed)


def scaled_rate(result: CaseResult) -> float:
    """Return the rate over bulk density, root of gravity and diameter of the spheres to the power of 2.5."""
    seen = result.observables
    bulk_density = GLASS.density * seen["solid_fraction"]
    return float(seen["flow_rate"] / (bulk_density * np.sqrt(GRAVITY) * DIAMETER**EXPONENT))


Flows = Sequence[tuple[float, float]]
"""Outlets in sphere diameters, each with a scaled rate."""


def exponent(flows: Flows, k: float) -> float:
    """Power of the outlet less `k` sphere diameters that the rates follow, by least squares."""
    outlets, rates = np.array(flows).T
    return float(np.polyfit(np.log(outlets - k), np.log(rates), 1)[0])


def rate_constant(flows: Flows, k: float) -> float:
    """Beverloo's C, geometric mean over the outlets."""
    outlets, rates = np.array(flows).T
    return float(np.exp(np.log(rates / (outlets - k) ** EXPONENT).mean()))


def _rows(flows: Mapping[float, Flows]) -> list[Row]:
    law = "Beverloo et al. (1961)"
    middle = 0.5 * (LEAST_CONSTANT + LARGEST_CONSTANT)
    realistic, *_ = FRICTIONS
    rows, constants = [], []
    for friction, each in flows.items():
        case = f"{FRICTIONS[friction]}, friction {friction:g}"
        for k in (K, K - K_SPREAD, K + K_SPREAD):
            power, constant = exponent(each, k), rate_constant(each, k)
            bounds = (0.15, LARGEST_CONSTANT - middle if friction == realistic else None)
            power_bound, constant_bound = bounds if k == K else (None, None)
            labels = (PROBLEM, case, f"exponent, k = {k:.1f}", law)
            rows.append(absolute_row(labels, EXPONENT, power, power_bound))
            labels = (PROBLEM, case, f"C, k = {k:.1f}", law)
            rows.append(absolute_row(labels, middle, constant, constant_bound))
        constants.append(rate_constant(each, K))
    for (friction, name), fall in zip(list(FRICTIONS.items())[1:], -np.diff(constants), strict=True):
        rows.append(detection_row(PROBLEM, f"{name}, friction {friction:g}", "fall of C to it", 0.01, fall))
    return rows


def _plot(flows: Mapping[float, Flows]) -> Plot:
    outlets = np.linspace(OUTLETS[0] - 0.5, OUTLETS[-1] + 0.5, 60)
    curves = []
    for colour, (friction, each) in enumerate(flows.items()):
        constant = rate_constant(each, K)
        law = constant * (outlets - K) ** EXPONENT
        openings, rates = np.array(each).T
        curves += [
            Curve(f"friction {friction:g}", openings, rates, "points", colour),
            Curve(f"{constant:.3f} (D/d - {K:g})^2.5", outlets, law, "line", colour),
        ]
    return Plot("beverloo", "Flow out of a hopper", "outlet D / d", "W / (rho sqrt(g) d^2.5)", tuple(curves))


def beverloo(device: str) -> Result:
    """Rates of flow through five outlets at three frictions."""
    seeds = range(1, 1 + SEEDS["cpu" if device == "cpu" else "cuda"])
    settings = [(friction, outlet, seed) for friction in FRICTIONS for outlet in OUTLETS for seed in seeds]
    cases = [hopper_case(outlet, friction, seed) for friction, outlet, seed in settings]
    flows: dict[float, list[tuple[float, float]]] = {friction: [] for friction in FRICTIONS}
    for (friction, outlet, _), result in zip(settings, finished_cases(cases, device), strict=True):
        if "flow_rate" in result.observables:
            flows[friction].append((outlet, scaled_rate(result)))
    labels = (PROBLEM, f"all {len(cases)} hoppers", "hoppers without a rate", "none clogs")
    lost = len(cases) - sum(len(each) for each in flows.values())
    rows = (absolute_row(labels, 0.0, lost, 0.0), *_rows(flows))
    return Result("Beverloo", TEXT, rows, (_plot(flows),))


def coned(device: str) -> Result:
    """Rates of flow through two cones and a flat bottom."""
    angles, rates = (*HALF_ANGLES, 90.0), []
    friction, name = list(FRICTIONS.items())[-1]
    for angle in angles:
        cases = [hopper_case(CONE_OUTLET, friction, seed, angle) for seed in range(1, 1 + CONE_SEEDS)]
        rates.append(float(np.mean([scaled_rate(result) for result in finished_cases(cases, device)])))
    tangents = np.tan(np.radians(HALF_ANGLES))
    power = float(np.diff(np.log(rates[:2]))[0] / np.diff(np.log(tangents))[0])
    labels = ("Spheres out of a hopper with a cone", name, "power of the tangent", "Rose and Tanaka (1959)")
    rows = [absolute_row(labels, CONE_POWER, power, CONE_BOUND)]
    for angle, rate, tangent in zip(HALF_ANGLES, rates, tangents, strict=False):
        what = f"rate over that of a flat bottom, {angle:g} degrees"
        rows.append(absolute_row((*labels[:2], what, labels[3]), tangent**CONE_POWER, rate / rates[-1], None))
    return Result("Hoppers with a cone", CONE_TEXT, tuple(rows))
