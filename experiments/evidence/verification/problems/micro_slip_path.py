"""Oblique elastic impact against the theory of micro-slip: laws of one spring, and a row of springs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dem_warp import ContactLaws
from dem_warp.laws.conventions import TangentialHistory
from dem_warp.laws.micro_slip import MicroSlip
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
from experiments.evidence.verification.problems.impact import Impact, simulate_impacts
from experiments.evidence.verification.problems.kicks import (
    STEPS,
    kicks_of,
    law_rows,
    simulated_courses,
    sliding_rows,
    solved_kicks,
)
from experiments.evidence.verification.problems.partial_slip import rebound_slip

PROBLEM = "Chung and Ooi test 5: micro-slip"
THEORY = "Maw, Barber and Fawcett (1976)"
SLIPS = np.array([0.05, 0.1, 0.2, 0.5, 0.8, 1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0, 8.0, 12.0])
"""Slip before the impact over friction and normal speed."""

RANGES = {
    "slip before up to 1.2 mu v (theory: no gross slip at first)": SLIPS <= 1.2,
    "slip before 1.5 to 3 mu v": (SLIPS > 1.2) & (SLIPS <= 3.0),
    "slip before above 3 mu v": SLIPS > 3.0,
}
PHASES = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Length of the step in which the sphere meets the plane: the springs begin as wide as the first contact."""

LAWS: Mapping[str, tuple[TangentialHistory, float]] = {
    "two thirds of the spring (Di Renzo and Di Maio, 2005)": ("displacement", 2.0 / 3.0),
    "spring, cut in unloading (LAMMPS, mindlin_rescale)": ("rescaled_displacement", 1.0),
    "increments of force (LAMMPS, mindlin/force)": ("force", 1.0),
    "increments, cut in unloading (Thornton, Cummins and Cleary, 2013)": ("rescaled_force", 1.0),
}
"""Other laws of one spring: history, and stiffness over that of the base law."""

ORDERS = (100, 200, 400, 800)
IMPULSE = "tangential impulse / (2 mu m v)"
SPEED = "tangential speed after / before"
REBOUND = "slip after / before"

TEXT = """An elastic impact at constant normal speed, against the theory of N. Maw, J. R. Barber and J. N.
Fawcett (Wear 38 (1976) 101-114), in which a ring of the contact slips from the first moment on. Their curve
is computed here with the method of dimensionality reduction, 2,000 springs that stick or slip by
themselves. Three quantities are compared: the tangential impulse over that of full sliding, the tangential
speed of the centre after over before, and the slip of the contact point after over before. The last is the
non-dimensional angle of rebound over that of incidence, and the most sensitive of the three.

*The base law*, Mindlin without slip, is one spring of stiffness 8 G* sqrt(R* d) on the whole tangential
displacement, which sticks or slides as one. It is the law of EDEM's Hertz-Mindlin (no slip) model, with
which the calibrated paper simulated. The simulator follows it to a few parts in ten thousand, and the gap
closes at first order. The law itself, solved exactly, misses theory by the amounts in the rows below: in
tangential speed it is within about 5 % above a slip of 3 mu v, not below. The two reasons have numbers. In
loading, the stiffness at the present overlap acts on displacement that was made while the contact was
smaller: in proportional loading that is 3/2 of the incremental force. And without the ring that slips, a
sticking contact returns its tangential energy: at small slips the contact point leaves as fast as it came,
where theory has it nearly stop.

*Other laws of one spring* mend a part of this. None of the four below is within 5 %: each misses the
tangential speed by 11 to 25 % somewhere. Two thirds of the stiffness (A. Di Renzo and F. P. Di Maio,
Chemical Engineering Science 60 (2005) 1303-1312) comes nearest, and errs to the other side. Increments of
force that are cut in unloading are those of C. Thornton, S. J. Cummins and P. W. Cleary (Powder Technology
233 (2013) 30-46).

*The mechanism* `micro_slip` puts a row of eight springs in place of the one
(`dem_warp/laws/micro_slip.py`). With it the simulator is within 5 % of theory in all three quantities, at
every slip and for five fits of the row to the contact, which depend on how far the first step reaches into
it. At the production step, 14 steps an impact, the error of the step comes on top: rows of both laws show
it."""


def micro_slip(device: str) -> Result:
    """Chung and Ooi's test 5: elastic impact at constant normal speed, against Maw, Barber and Fawcett."""
    impacts = _impacts(SLIPS)
    ratio = 4.0 * impacts[0].law.shear_modulus / impacts[0].law.modulus
    got, want = kicks_of(simulated_courses(impacts, STEPS, device)), solved_kicks(impacts)
    theory = rebound_slip(ratio, SLIPS)
    case = f"steel, {len(SLIPS)} slips, {STEPS} steps"
    rows = [*law_rows(PROBLEM, case, got, want, 5e-3), *sliding_rows(PROBLEM, "steel", impacts, got)]
    errors = [np.abs(kicks_of(simulated_courses(impacts, s, device)) - want).max() for s in ORDERS]
    rows.append(
        order_row(PROBLEM, "steel", "order of the worst gap to the law", ORDERS, np.array(errors), 1.0, 0.9)
    )
    for part, inside in RANGES.items():
        rows += _theory_rows(f"the law, not the code: {part}", _rebound(want), theory, None, inside)
    laws = {"one spring": got}
    for law, (history, spring) in LAWS.items():
        others = _impacts(SLIPS, laws=ContactLaws(tangential_history=history), spring=spring)
        laws[law] = kicks_of(simulated_courses(others, STEPS, device))
        rows += _theory_rows(law, _rebound(laws[law]), theory, None)
    with_ring = _impacts(SLIPS, mechanisms=(MicroSlip(micro_slip=1.0),))
    laws["with micro_slip"] = ring = kicks_of(simulated_courses(with_ring, STEPS, device))
    rows += _ring_rows(with_ring, ring, theory, device)
    rows += _theory_rows(_production("base law", impacts), _produced(impacts, device), theory, None)
    return Result("Oblique impact and micro-slip", TEXT, tuple(rows), _plots(ratio, theory[0], laws))


def _impacts(slips: np.ndarray, **changes: Any) -> list[Impact]:
    return [replace(chung_ooi.fast_oblique(1.5 * float(s)), **changes) for s in slips]


Rebound = tuple[np.ndarray, np.ndarray]
"""Slip after over mu v, and tangential impulse over mu m v, of each slip before."""


def _rebound(kicks: np.ndarray, slips: np.ndarray = SLIPS) -> Rebound:
    return slips + 2.0 * (kicks[:, 0] - kicks[:, 1]), -2.0 * kicks[:, 0]


def _produced(impacts: Sequence[Impact], device: str) -> Rebound:
    return _rebound(kicks_of(simulated_courses(impacts, None, device, "mixed")))


def _production(what: str, impacts: Sequence[Impact]) -> str:
    steps = impacts[0].production_steps
    return f"{what}, production precision, 25 % of the Rayleigh time ({steps:.1f} steps)"


def _theory_rows(
    case: str, got: Rebound, theory: Rebound, tolerance: float | None, inside: np.ndarray = SLIPS > 0.0
) -> list[Row]:
    """Distance of impacts from the theory of micro-slip."""
    before = SLIPS[inside]
    slip, impulse = (values[..., inside] for values in got)
    slip_wanted, impulse_wanted = (values[inside] for values in theory)
    compared: list[tuple[Callable[..., Row], str, np.ndarray, np.ndarray]] = [
        (absolute_row, IMPULSE, 0.5 * impulse_wanted, 0.5 * impulse),
        (relative_row, SPEED, 1.0 - impulse_wanted / before, 1.0 - impulse / before),
        (absolute_row, REBOUND, slip_wanted / before, slip / before),
    ]
    return [
        row((PROBLEM, case, quantity, THEORY), want, have, tolerance)
        for row, quantity, want, have in compared
    ]


def _ring_rows(impacts: Sequence[Impact], got: np.ndarray, theory: Rebound, device: str) -> list[Row]:
    """Return the simulator with the mechanism, which is to give the theory."""
    case = f"mechanism micro_slip, {len(SLIPS)} slips"
    fits = simulate_impacts(impacts, ORDERS[1], device, PHASES, "mixed", length=2.0)
    where = f"{case}, production precision, {ORDERS[1]} steps, first step at {len(PHASES)} phases"
    slip, impulse = zip(*(_rebound(kicks_of(courses)) for courses in zip(*fits, strict=True)), strict=True)
    return [
        *_theory_rows(f"{case}, {STEPS} steps", _rebound(got), theory, 5e-2),
        *_theory_rows(where, (np.stack(slip), np.stack(impulse)), theory, 5e-2),
        *sliding_rows(PROBLEM, "mechanism micro_slip", impacts, got),
        *_theory_rows(_production("mechanism micro_slip", impacts), _produced(impacts, device), theory, None),
    ]


def _plots(ratio: float, wanted: np.ndarray, laws: Mapping[str, np.ndarray]) -> tuple[Plot, ...]:
    dense = np.linspace(0.02, 12.0, 120)
    theory = rebound_slip(ratio, dense)
    solved = _rebound(solved_kicks(_impacts(dense)), dense)
    names = {
        "micro-slip": ("slip of the contact point", "slip after / (mu v)"),
        "micro-slip-impulse": ("tangential impulse", "tangential impulse / (mu m v)"),
    }
    plots = []
    for k, (name, (title, label)) in enumerate(names.items()):
        curves = (
            Curve("base law, simulated", SLIPS, _rebound(laws["one spring"])[k], "points"),
            Curve("base law, differential equation", dense, solved[k]),
            Curve("with micro_slip, simulated", SLIPS, _rebound(laws["with micro_slip"])[k], "points"),
            Curve(THEORY, dense, theory[k], "dashed"),
        )
        plots.append(Plot(name, f"Test 5: {title}", "slip before / (mu v)", label, curves))
    sticks = SLIPS < 6.5
    gaps = {law: ((_rebound(kicks)[0] - wanted) / SLIPS)[sticks] for law, kicks in laws.items()}
    lines = tuple(Curve(law.split(" (")[0], SLIPS[sticks], gap) for law, gap in gaps.items())
    labels = ("Test 5: gap to theory", "slip before / (mu v)", "(slip after - theory) / slip before")
    return *plots, Plot("micro-slip-laws", *labels, lines)
