"""One impact of a sphere on a plane or another sphere: settings, Hertz solution, simulation."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from dem_warp import EDEM, ClumpShape, ContactLaws, Material, Mechanism, rayleigh_time
from dem_warp.model import ContactCoefficients, WorldSetup
from dem_warp.walls import Plane
from experiments.evidence.verification.problems.setups import RIGID, bodies, contact, record, world

HERTZ_DURATION = 0.8 * math.sqrt(math.pi) * math.gamma(0.4) / math.gamma(0.9)
"""Duration of an elastic Hertz impact over (largest overlap / impact speed): 2.9432750."""


@dataclass(frozen=True)
class Partner:
    """A sphere with a spin about y [rad/s]; the one that is hit, at rest before but for that."""

    material: Material
    radius: float
    spin: float = field(default=0.0, kw_only=True)

    @property
    def mass(self) -> float:
        """Mass of the sphere [kg]."""
        return self.material.density * 4.0 / 3.0 * math.pi * self.radius**3


@dataclass(frozen=True)
class Impact(Partner):
    """A sphere that falls along -z on a plane, rigid or of the `plate`'s material, or on a `partner`.

    Speeds [m/s] are relative to what is hit: `normal_speed` towards it, `tangential_speed` along x.
    """

    normal_speed: float
    tangential_speed: float = 0.0
    restitution: float = 1.0
    friction: float = 0.0
    laws: ContactLaws = EDEM
    partner: Partner | None = None
    plate: Material = RIGID
    mechanisms: tuple[Mechanism, ...] = ()
    spring: float = 1.0
    """Tangential stiffness over that of Mindlin's theory without slip."""

    @cached_property
    def law(self) -> ContactCoefficients:
        """Coefficients of the contact."""
        hit = self.partner.material if self.partner else self.plate
        kinds = self.laws, self.mechanisms
        law = contact(self.material, hit, self.restitution, self.friction, 0.0, *kinds)
        return replace(law, shear_modulus=self.spring * law.shear_modulus)

    @property
    def partner_mass(self) -> float:
        """Mass of what is hit [kg]; a plane's is infinite."""
        return self.partner.mass if self.partner else math.inf

    @property
    def effective_mass(self) -> float:
        """m* [kg]."""
        return 1.0 / (1.0 / self.mass + 1.0 / self.partner_mass)

    @property
    def effective_radius(self) -> float:
        """R* [m]."""
        return 1.0 / (1.0 / self.radius + (1.0 / self.partner.radius if self.partner else 0.0))

    @property
    def peak_overlap(self) -> float:
        """Largest overlap of an elastic impact [m]: Johnson (1985), section 11.4."""
        stiffness = 16.0 * self.law.modulus * math.sqrt(self.effective_radius)
        return (15.0 * self.effective_mass * self.normal_speed**2 / stiffness) ** 0.4

    @property
    def peak_force(self) -> float:
        """Largest force of an elastic impact [N]."""
        return 4.0 / 3.0 * self.law.modulus * math.sqrt(self.effective_radius) * self.peak_overlap**1.5

    @property
    def duration(self) -> float:
        """Duration of an elastic impact [s]."""
        return HERTZ_DURATION * self.peak_overlap / self.normal_speed

    @property
    def production_steps(self) -> float:
        """Steps of an elastic impact when a step is 25 % of the falling sphere's Rayleigh time."""
        return self.duration / (0.25 * rayleigh_time(self.radius, self.material))

    def world(self, time_step: float, phase: float) -> WorldSetup:
        """Return the impact a step before; `phase` of a step later the spheres meet."""
        gap = (1.0 + phase) * time_step * self.normal_speed
        fall = [self.tangential_speed, 0.0, -self.normal_speed]
        positions, velocities = [[0.0, 0.0, self.radius + gap]], [fall]
        spins, sizes, densities = [[0.0, self.spin, 0.0]], [1.0], [self.material.density]
        if self.partner:
            positions.append([0.0, 0.0, -self.partner.radius])
            velocities.append([0.0, 0.0, 0.0])
            spins.append([0.0, self.partner.spin, 0.0])
            sizes.append(self.partner.radius / self.radius)
            densities.append(self.partner.material.density)
        grains = bodies(positions, densities, velocities=velocities, spins=spins, sizes=sizes)
        walls = () if self.partner else (Plane(),)
        setup = world(grains, ClumpShape.sphere(self.radius), self.law, time_step, walls=walls)
        return replace(setup, forms=self.laws.forms)


@dataclass(frozen=True)
class Course:
    """One impact as simulated, step by step."""

    impact: Impact
    time_step: float
    """[s]."""
    overlap: np.ndarray
    force: np.ndarray
    """Overlap [m], and normal force between two states [N]."""
    speed_after: float
    """Last speed of separation [m/s]."""
    velocities: np.ndarray
    spins: np.ndarray
    """[m/s], [rad/s], shape (steps + 1, bodies, 3)."""

    @property
    def duration(self) -> float:
        """Time from first to last touch [s], the overlap being interpolated to zero."""
        d = self.overlap
        first, last = np.flatnonzero(d > 0.0)[[0, -1]]
        before = d[first] / (d[first] - d[first - 1])
        after = d[last] / (d[last] - d[last + 1])
        return float((last - first + before + after) * self.time_step)

    @property
    def restitution(self) -> float:
        """Speed after over speed before."""
        return self.speed_after / self.impact.normal_speed

    @property
    def time(self) -> np.ndarray:
        """Time since the spheres met, of each force [s]."""
        d = self.overlap
        first = int(np.flatnonzero(d > 0.0)[0])
        met = first - d[first] / (d[first] - d[first - 1])
        return (np.arange(len(self.force)) - met) * self.time_step


def simulate_impacts(
    impacts: Sequence[Impact],
    steps: float | None,
    device: str,
    phases: Sequence[float] = (0.5,),
    precision: str = "double",
    length: float = 1.3,
) -> list[list[Course]]:
    """Courses of impacts, `steps` each by its elastic duration, at several phases of the step.

    `steps` None takes each impact's own at production. The record ends after `length` elastic durations. All
    impacts are on planes, or all on partners.
    """
    time_steps = [i.duration / (steps or i.production_steps) for i in impacts]
    worlds = [i.world(dt, phase) for i, dt in zip(impacts, time_steps, strict=True) for phase in phases]
    longest = max(i.duration / dt for i, dt in zip(impacts, time_steps, strict=True))
    motion = record(worlds, int(length * longest) + 3, device, precision)
    courses = []
    for k, world_ in enumerate(worlds):
        impact, dt = impacts[k // len(phases)], world_.time_step
        z, v = motion.positions[:, k, :, 2], motion.velocities[:, k, :, 2]
        reach = impact.radius + (impact.partner.radius if impact.partner else 0.0)
        overlap = reach - (z[:, 0] - (z[:, 1] if impact.partner else 0.0))
        separation = v[:, 0] - (v[:, 1] if impact.partner else 0.0)
        force = impact.effective_mass * np.diff(separation) / dt
        states = motion.velocities[:, k], motion.spins[:, k]
        courses.append(Course(impact, dt, overlap, force, float(separation[-1]), *states))
    each = len(phases)
    return [courses[i : i + each] for i in range(0, len(courses), each)]
