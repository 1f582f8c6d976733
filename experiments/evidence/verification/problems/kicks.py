"""Impacts along the plane: kicks to speed and spin, against the law's own equation."""

import math
from collections.abc import Sequence

import numpy as np

from experiments.evidence.verification.check import Row, absolute_row, relative_row
from experiments.evidence.verification.problems.contact_ode import solve_impact
from experiments.evidence.verification.problems.impact import Course, Impact, simulate_impacts
from experiments.evidence.verification.problems.normal_impact import clamped_restitution

STEPS = 800
"""Steps an impact: the damping is of first order in the step."""

SAME_LAW = "the same law as a differential equation"
RIGID_BODY = "rigid body in full sliding: impulse mu (1 + e') m v"
"""With e' the restitution at the end of repulsion, where friction ends with the normal force."""

KICKS = ("change of tangential speed over mu (1 + e) v", "change of surface speed by spin over mu (1 + e) v")


def friction_speed(impact: Impact) -> float:
    """Largest change of the sphere's tangential speed by friction [m/s]."""
    share = impact.effective_mass / impact.mass
    return impact.friction * (1.0 + impact.restitution) * impact.normal_speed * share


def simulated_courses(
    impacts: Sequence[Impact], steps: float | None, device: str, precision: str = "double"
) -> list[Course]:
    """Courses of impacts by their numbers of steps, None for those of its production step."""
    return [phases[0] for phases in simulate_impacts(impacts, steps, device, precision=precision, length=2.0)]


def kicks_of(courses: Sequence[Course]) -> np.ndarray:
    """Return changes of tangential speed and of surface speed by spin over the largest friction, (n, 2)."""
    return np.array([_scaled(c.impact, c.velocities[-1, 0, 0], c.spins[-1, 0, 1]) for c in courses])


def solved_kicks(impacts: Sequence[Impact]) -> np.ndarray:
    """Return the same of the law's differential equation."""
    rebounds = [solve_impact(impact) for impact in impacts]
    return np.array([_scaled(i, r.tangential[0], r.spins[0]) for i, r in zip(impacts, rebounds, strict=True)])


def _scaled(impact: Impact, tangential: float, spin: float) -> tuple[float, float]:
    size = friction_speed(impact)
    return (tangential - impact.tangential_speed) / size, impact.radius * (spin - impact.spin) / size


def law_rows(
    problem: str, case: str, got: np.ndarray, want: np.ndarray, tolerance: float | None
) -> list[Row]:
    """Kicks against those of the differential equation."""
    return [
        absolute_row((problem, case, kick, SAME_LAW), want[:, k], got[:, k], tolerance)
        for k, kick in enumerate(KICKS)
    ]


def sliding_rows(problem: str, case: str, impacts: Sequence[Impact], got: np.ndarray) -> list[Row]:
    """Impacts that slide throughout, against those of rigid bodies."""
    repelled = clamped_restitution(impacts[0].restitution)
    slowed = np.array([3.5 * i.friction * (1.0 + repelled) * i.normal_speed for i in impacts])
    slides = np.array([slip_before(i) for i in impacts]) > 1.05 * slowed
    where = f"{case}, {slides.sum()} impacts that slide throughout"
    signs = np.array([math.copysign(1.0, i.tangential_speed - i.spin) for i in impacts])[slides]
    kick = signs * (1.0 + repelled) / (1.0 + impacts[0].restitution)
    return [
        relative_row((problem, where, KICKS[0], RIGID_BODY), -kick, got[slides, 0], 5e-3),
        relative_row((problem, where, KICKS[1], RIGID_BODY), 2.5 * kick, got[slides, 1], 5e-3),
    ]


def slip_before(impact: Impact) -> float:
    """Slip velocity at first touch, its size [m/s]."""
    other = impact.partner.radius * impact.partner.spin if impact.partner else 0.0
    return abs(impact.tangential_speed - impact.radius * impact.spin - other)
