"""Oblique elastic impact of a sphere with micro-slip in the contact: the problem of Maw, Barber and Fawcett.

N. Maw, J. R. Barber and J. N. Fawcett, The oblique impact of elastic spheres, Wear 38 (1976) 101-114, cut
the contact into annuli that each stick or slip. Here the contact is the equivalent row of independent
springs (method of dimensionality reduction: V. L. Popov and M. Hess, 2015), which holds Mindlin's partial
slip for any history of loading; I. A. Lyashenko and V. L. Popov, Scientific Reports 5 (2015) 8479, show that
it gives their solution.
"""

import numpy as np

from experiments.evidence.verification.problems.impact import HERTZ_DURATION

SPRINGS = 2000
STEPS = 4000


def rebound_slip(stiffness_ratio: float, slips: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slip after the impact, and the tangential impulse, of a solid sphere on a plane of friction 1.

    Parameters
    ----------
    stiffness_ratio
        Tangential over normal stiffness, 8 G* / (2 E*): 2 (1 - v) / (2 - v) for like materials.
    slips
        Slip velocities before, over the normal speed and the coefficient of friction, (n,).

    Returns
    -------
    slip, impulse : (n,) arrays
        Slip velocity after, over normal speed and friction; tangential impulse over friction and the
        momentum of the approach (2 in full sliding).

    Notes
    -----
    Units: mass, normal speed, E* and radius are 1. The force changes the slip by 1 + 5/2 of its impulse over
    the mass. Elastic similarity makes friction a factor of all tangential quantities.
    """
    peak = (15.0 / 16.0) ** 0.4
    time_step = HERTZ_DURATION * peak / STEPS
    place = (np.arange(SPRINGS) + 0.5) / SPRINGS * np.sqrt(peak)
    # both halves of the row; its normal stiffness by length is E*, its tangential one E* times the ratio
    normal_stiffness = 2.0 * np.sqrt(peak) / SPRINGS
    overlap, speed = 0.0, 1.0
    slip, spring = np.array(slips, dtype=float), np.zeros((len(slips), SPRINGS))
    impulse = np.zeros(len(slips))
    while overlap >= 0.0:
        normal = normal_stiffness * np.maximum(overlap - place**2, 0.0)
        force = spring.sum(axis=1)
        speed -= normal.sum() * time_step
        slip -= 3.5 * force * time_step
        impulse += force * time_step
        overlap += speed * time_step
        limit = normal_stiffness * np.maximum(overlap - place**2, 0.0)
        moved = normal_stiffness * stiffness_ratio * slip[:, None] * time_step
        spring = np.clip(spring + np.where(limit > 0.0, moved, 0.0), -limit, limit)
    return slip, impulse
