"""The problem of Maw, Barber and Fawcett for laws that let a contact stick or slide as one.

One spring of the no-slip stiffness holds the contact, and friction cuts its force. Published laws differ in
what becomes of the force while the contact radius changes.
"""

from dataclasses import dataclass

import numpy as np

from experiments.evidence.verification.problems.impact import HERTZ_DURATION

STEPS = 4000


@dataclass(frozen=True)
class OneSpring:
    """A tangential law of one spring."""

    name: str
    source: str
    """Description and source."""
    stiffness: float
    """Over the no-slip stiffness 8 G* a of a contact radius a."""
    growing: float
    shrinking: float
    """Power of the contact radius with which a force goes that no motion changes, while the radius grows
    and while it shrinks. 1 keeps the displacement, 0 the force."""


BASE = OneSpring("one spring", "EDEM; this simulator", 1.0, 1.0, 1.0)

LAWS = (
    BASE,
    OneSpring("two thirds of the spring", "Di Renzo and Di Maio, 2005", 2.0 / 3.0, 1.0, 1.0),
    OneSpring("spring, cut in unloading", "LAMMPS, mindlin_rescale", 1.0, 1.0, 2.0),
    OneSpring("increments of force", "LAMMPS, mindlin/force", 1.0, 0.0, 0.0),
    OneSpring("increments, cut in unloading", "Thornton, Cummins and Cleary, 2013", 1.0, 0.0, 1.0),
)


def one_spring_rebound(
    law: OneSpring, stiffness_ratio: float, slips: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Slip after an elastic impact of a sphere on a plane, and the tangential impulse.

    Parameters and units are those of `partial_slip.rebound_slip`, to be compared with it.
    """
    peak = (15.0 / 16.0) ** 0.4
    time_step = HERTZ_DURATION * peak / STEPS
    overlap, speed = time_step, 1.0
    slip = np.array(slips, dtype=float)
    force, impulse = np.zeros_like(slip), np.zeros_like(slip)
    while overlap > 0.0:
        normal, radius = 4.0 / 3.0 * overlap**1.5, np.sqrt(overlap)
        stiffness = 2.0 * law.stiffness * stiffness_ratio * radius
        force = np.clip(force + stiffness * slip * time_step, -normal, normal)
        speed -= normal * time_step
        slip -= 3.5 * force * time_step
        impulse += force * time_step
        overlap += speed * time_step
        power = law.growing if speed > 0.0 else law.shrinking
        force = force * (np.sqrt(max(overlap, 0.0)) / radius) ** power
    return slip, impulse
