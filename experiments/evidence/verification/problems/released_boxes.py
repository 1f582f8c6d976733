"""A ledge against the law of column collapse, with and without adhesion, and a slab on a tilting floor."""

import math
from dataclasses import replace

from dem_warp import Case, CaseResult, ClumpShape, GrainPopulation, Interaction, Ledge, TiltingBox, simulate
from dem_warp.laws.jkr import JKR
from experiments.evidence.verification.check import Result, Row, absolute_row, detection_row, relative_row
from experiments.evidence.verification.problems.beverloo import GLASS
from experiments.evidence.verification.problems.setups import STEEL

DIAMETER, WIDTH, DEPTH = 3e-3, 20, 15
"""Size of the spheres [m]; width and depth of the box in it."""

SLENDERNESS = (1.0, 1.5, 2.0)
"""Heights of the columns over their width."""

FRICTION, ROLLING = 0.5, 0.1
LAW, TOLERANCE = 1.2, 0.15
ADHESION = 1.0
"""Work of adhesion [J/m2]; its pull is ten times the weight of a sphere."""

SLOPE = 0.3
"""Friction of the slab, a sphere that does not roll."""

TEXT = f"""A box of {WIDTH} by {DEPTH} spheres opens on one side, quickly, into a channel as deep as the box.
E. Lajeunesse, J. B. Monnier and G. M. Homsy (Physics of Fluids 17 (2005) 103302) and G. Lube, H. E.
Huppert, R. S. J. Sparks and A. Freundt (Physical Review E 72 (2005) 041301) found that columns of
height H and width L, up to some two times as high as wide, run out by {LAW:g} H, for sand and other
rough grains; {TOLERANCE:.0%} are allowed. Spheres do so with the rolling friction of {ROLLING:g} that
these have, whose slopes are as steep as those of sand; with less they run farther (1.5 to 1.8 H at
0.05). Spheres that adhere stay behind their door. A slab on a floor that is tilted slides at
atan(friction), seen once it moves at 3 % of sqrt(g d): at 1 degree per second within a degree."""


def released(device: str) -> Result:
    """Return the run-out of ledges, and the angle at which a slab slides."""
    problem = "A box that is opened or tilted"
    box = Ledge(WIDTH * DIAMETER, DEPTH * DIAMETER, 0.01, STEEL, door_speed=2.0, rest_speed=3e-3)
    columns = [_case(replace(box, fill_depth=a * box.width)) for a in SLENDERNESS]
    face = replace(columns[1], mechanisms=(JKR(work_of_adhesion=ADHESION),))
    floor = TiltingBox(0.05, 0.02, 0.01, STEEL, 1.0 / 360.0, grain_count=1)
    results = simulate([*columns, face, _case(floor, SLOPE, 1.0)], device=device)
    rows = [_run_out(problem, a, result) for a, result in zip(SLENDERNESS, results, strict=False)]
    stands = detection_row(
        problem, "spheres that adhere", "the face stands", 1.0, _seen(results[-2], "stands")
    )
    slab = (problem, "slab on a floor", "angle at which it slides [degrees]", "atan(friction)")
    angle = _seen(results[-1], "start_angle")
    slides = absolute_row(slab, math.degrees(math.atan(SLOPE)), angle, 1.0)
    return Result("Opened and tilted boxes", TEXT, (*rows, stands, slides))


def _case(scene: Ledge | TiltingBox, friction: float = FRICTION, rolling: float = ROLLING) -> Case:
    surfaces = Interaction(0.5, friction, rolling)
    return Case(scene, GrainPopulation(ClumpShape.sphere(DIAMETER / 2), GLASS), surfaces, surfaces, seed=1)


def _run_out(problem: str, slenderness: float, result: CaseResult) -> Row:
    labels = (problem, f"column, H/L = {slenderness:g}", "run-out over height", "Lube et al. (2005)")
    return relative_row(labels, LAW, _seen(result, "run_out") / _seen(result, "fill_height"), TOLERANCE)


def _seen(result: CaseResult, name: str) -> float:
    return result.observables.get(name, math.nan)
