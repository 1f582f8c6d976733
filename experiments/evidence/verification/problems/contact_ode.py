"""The contact law of the simulator as a differential equation, integrated to high accuracy.

An independent solution of one planar impact: the same Hertz spring, damping, no-slip spring and Coulomb limit
as in `dem_warp/laws`, written anew, between events of sticking and sliding.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from experiments.evidence.verification.problems.impact import Impact

START = 1e-7
"""Overlap at the start, of the largest one: what is left out is its power of 2.5."""

ACCURACY = 1e-10
"""Relative tolerance of the integration."""

MOST_ARCS = 50
"""Arcs of stick or slip in one impact; there are four at the most in the tests."""


@dataclass(frozen=True)
class Rebound:
    """Velocities after an impact: along the normal [m/s], along x [m/s] and spins about y [rad/s].

    Each pair holds the falling sphere's and that of what is hit.
    """

    separation: float
    tangential: tuple[float, float]
    spins: tuple[float, float]


class _Contact:
    """Rates of (overlap, its rate, impulse, angular impulses, spring) in a state of stick or slip."""

    def __init__(self, impact: Impact) -> None:
        self.impact = impact
        radii = (impact.radius, impact.partner.radius if impact.partner else math.inf)
        self.masses = np.array([impact.mass, impact.partner_mass])
        self.radii = np.array(radii)
        self.inertias = 0.4 * self.masses * self.radii**2
        self.spins = np.array([impact.spin, impact.partner.spin if impact.partner else 0.0])

    def forces(self, y: np.ndarray) -> tuple[float, float, float]:
        """Return the normal force [N], tangential stiffness [N/m] and damping [N s/m]."""
        law, mass = self.impact.law, self.impact.effective_mass
        root = math.sqrt(self.impact.effective_radius * max(y[0], 0.0))
        stiffness, tangential = 2.0 * law.modulus * root, 8.0 * law.shear_modulus * root
        normal = 2.0 / 3.0 * stiffness * y[0] + law.damping * math.sqrt(stiffness * mass) * y[1]
        if law.clamp_attraction:
            normal = max(normal, 0.0)
        return normal, tangential, law.tangential_damping * law.damping * math.sqrt(tangential * mass)

    def levers(self, y: np.ndarray) -> np.ndarray:
        """Arms from the centres to the contact point, half the overlap inside [m]; 0 for a plane."""
        return np.where(np.isfinite(self.radii), self.radii - 0.5 * y[0], 0.0)

    def tangential_velocities(self, y: np.ndarray) -> np.ndarray:
        """Velocities of the two centres [m/s]."""
        return np.array([self.impact.tangential_speed, 0.0]) + np.array([y[2], -y[2]]) / self.masses

    def spins_at(self, y: np.ndarray) -> np.ndarray:
        """Spins of the two bodies [rad/s]."""
        return self.spins - y[3:5] / self.inertias

    def slip(self, y: np.ndarray) -> float:
        """Velocity of the falling sphere's surface over the other's [m/s]."""
        v, w, arms = self.tangential_velocities(y), self.spins_at(y), self.levers(y)
        return float(v[0] - v[1] - w @ arms)

    def limit(self, y: np.ndarray) -> float:
        """Coulomb limit [N]."""
        return self.impact.law.static_friction * max(self.forces(y)[0], 0.0)

    def friction(self, y: np.ndarray, sliding: float) -> float:
        """Tangential force [N]; `sliding` is the direction of the spring at its limit, 0 in stick."""
        limit = self.limit(y)
        if sliding:
            return -sliding * limit
        _, stiffness, damping = self.forces(y)
        return float(np.clip(-stiffness * y[5] - damping * self.slip(y), -limit, limit))

    def sliding_of(self, y: np.ndarray) -> float:
        """Direction of a spring at or past its limit, 0 of one within it."""
        return math.copysign(1.0, y[5]) if self.forces(y)[1] * abs(y[5]) >= self.limit(y) else 0.0

    def rebound(self, y: np.ndarray) -> Rebound:
        """Velocities of a state."""
        v, w = self.tangential_velocities(y), self.spins_at(y)
        return Rebound(float(-y[1]), (float(v[0]), float(v[1])), (float(w[0]), float(w[1])))

    def rates(self, _: float, y: np.ndarray, sliding: float) -> np.ndarray:
        force = self.friction(y, sliding)
        normal = self.forces(y)[0]
        arms = self.levers(y) * force
        return np.array([y[1], -normal / self.impact.effective_mass, force, *arms, self.slip(y)])

    def spring_limit_rate(self, y: np.ndarray) -> float:
        """Rate at which the displacement grows at which the spring reaches the limit [m/s]."""
        h = 1e-6 * self.impact.duration
        ahead = y + h * self.rates(0.0, y, 0.0)
        behind = y - h * self.rates(0.0, y, 0.0)
        spans = [self.limit(at) / self.forces(at)[1] if at[0] > 0.0 else 0.0 for at in (ahead, behind)]
        return (spans[0] - spans[1]) / (2.0 * h)


def _events(contact: _Contact, sliding: float) -> list:
    def parted(_: float, y: np.ndarray, __: float) -> float:
        return float(y[0])

    def slips(_: float, y: np.ndarray, __: float) -> float:
        return contact.forces(y)[1] * abs(y[5]) - contact.limit(y)

    def sticks(_: float, y: np.ndarray, __: float) -> float:
        if contact.limit(y) <= 0.0:
            return 1.0
        return sliding * contact.slip(y) - contact.spring_limit_rate(y)

    parted.terminal, parted.direction = True, -1  # type: ignore[attr-defined]
    change = sticks if sliding else slips
    change.terminal, change.direction = True, -1 if sliding else 1  # type: ignore[attr-defined]
    return [parted, change]


def solve_impact(impact: Impact) -> Rebound:
    """Rebound of a planar impact under the simulator's law."""
    contact = _Contact(impact)
    y = np.array([START * impact.peak_overlap, impact.normal_speed, 0.0, 0.0, 0.0, 0.0])
    y[5] = contact.slip(y) * y[0] / y[1]
    time, sliding = 0.0, contact.sliding_of(y)
    for _ in range(MOST_ARCS):
        arc = solve_ivp(
            contact.rates,
            (time, time + 20.0 * impact.duration),
            y,
            method="DOP853",
            args=(sliding,),
            events=_events(contact, sliding),
            rtol=ACCURACY,
            atol=ACCURACY * np.array([impact.peak_overlap, impact.normal_speed, *_sizes(impact)]),
            max_step=impact.duration / 200.0,
        )
        time, y = float(arc.t[-1]), arc.y[:, -1]
        if len(arc.t_events[0]):
            return contact.rebound(y)
        if sliding:
            y[5] = sliding * contact.limit(y) / contact.forces(y)[1]
        sliding = 0.0 if sliding else math.copysign(1.0, y[5])
    raise RuntimeError(f"solve_impact: more than {MOST_ARCS} changes of stick and slip in {impact!r}")


def _sizes(impact: Impact) -> tuple[float, float, float, float]:
    """Sizes of impulse [N s], angular impulses [N m s] and spring displacement [m]."""
    impulse = impact.effective_mass * impact.normal_speed
    far = impact.partner.radius if impact.partner else impact.radius
    return impulse, impulse * impact.radius, impulse * far, impact.peak_overlap
