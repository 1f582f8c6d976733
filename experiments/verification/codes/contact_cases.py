"""Two spheres, and a sphere on a plate, through normal, oblique, rolling and twisting contacts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dem_warp import ClumpShape, ContactLaws, Interaction, Material, rayleigh_time
from dem_warp.model import GRAVITY, ContactCoefficients, WorldSetup
from dem_warp.walls import Plane
from experiments.export import Contact
from experiments.verification.problems.setups import STEEL, bodies, material, record, world

RADIUS = 2e-3
"""Radius of the spheres [m]."""

GRAIN = material(1e7, 0.3, 2500.0)
"""Material of the spheres; the plate is of steel."""

SURFACE = Interaction(restitution=0.5, static_friction=0.4, rolling_friction=0.05)
"""Properties of both pairs."""

GAP = 0.02 * RADIUS
"""Between the surfaces at the start of an impact [m]."""

FAINT = 0.01
"""A quantity that stays below this part of what the contact may make of it counts as none."""

SAMPLES = 400
"""States of a trajectory that are compared."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class ContactCase:
    """One or two spheres, on a plate z = 0 or in free space, from a state on for a time."""

    name: str
    positions: tuple[Vector, ...]
    velocities: tuple[Vector, ...]
    spins: tuple[Vector, ...]
    """States of the spheres at the start [m], [m/s], [rad/s]."""
    duration: float
    """[s]."""
    on_plate: bool = False
    gravity: float = 0.0
    """Along -z [m/s2]."""
    step_fraction: float = 0.01
    """Time step over the Rayleigh time."""

    @property
    def partner(self) -> Material:
        """Material of the second body."""
        return STEEL if self.on_plate else GRAIN

    @property
    def time_step(self) -> float:
        """[s]."""
        return self.step_fraction * rayleigh_time(RADIUS, GRAIN)

    @property
    def stride(self) -> int:
        """Steps between two states that are compared."""
        return max(round(self.duration / self.time_step / SAMPLES), 1)

    @property
    def mass(self) -> float:
        """Mass of a sphere [kg]."""
        return GRAIN.density * 4.0 / 3.0 * math.pi * RADIUS**3

    @property
    def sizes(self) -> dict[str, float]:
        """Sizes that positions, velocities and spins come to where a contact changes them, roughly."""
        speed = max(np.abs(self.velocities).max(), RADIUS * np.abs(self.spins).max())
        return {"positions": speed * self.duration, "velocities": speed, "spins": speed / RADIUS}

    def contact(self, laws: ContactLaws) -> Contact:
        """Contact of the bodies under some laws, as exporters translate it."""
        share = 1.0 if self.on_plate else 0.5
        radius, mass = share * RADIUS, share * self.mass
        coefficients = ContactCoefficients.of_pair(
            GRAIN, self.partner, SURFACE, laws, radius=radius, mass=mass
        )
        return Contact(GRAIN, self.partner, SURFACE, coefficients, radius, mass)

    def world(self, laws: ContactLaws) -> WorldSetup:
        """World of the bodies under some laws."""
        grains = bodies(self.positions, GRAIN.density, velocities=self.velocities, spins=self.spins)
        setup = world(
            grains,
            ClumpShape.sphere(RADIUS),
            self.contact(laws).coefficients,
            self.time_step,
            walls=[Plane()] * self.on_plate,
            gravity=(0.0, 0.0, -self.gravity),
        )
        return replace(setup, forms=laws.forms, rolling_holds=laws.rolling != "own_spin_whole_step")


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States of the spheres of a case at every stride: arrays (states, spheres, 3), SI units."""

    positions: np.ndarray
    velocities: np.ndarray
    spins: np.ndarray

    def difference(self, other: Trajectory, case: ContactCase) -> dict[str, float]:
        """Largest difference of each quantity from another's, over the largest size that it has there.

        A position's size is that of the way from the start. A quantity that has none is measured by the speed
        at which surfaces meet, in the case's own time and radius.
        """
        found = {}
        for name, least in case.sizes.items():
            own, reference = getattr(self, name), getattr(other, name)
            size = np.abs(reference - reference[0] * (name == "positions")).max()
            found[name] = float(np.abs(own - reference).max() / max(size, FAINT * least))
        return found


def simulated(cases: Sequence[ContactCase], laws: ContactLaws, device: str) -> list[Trajectory]:
    """Trajectories of cases as dem-warp has them, in double precision."""
    found = []
    for case in cases:
        steps = case.stride * SAMPLES
        motion = record([case.world(laws)], steps, device)
        at = slice(0, steps + 1, case.stride)
        found.append(Trajectory(motion.positions[at, 0], motion.velocities[at, 0], motion.spins[at, 0]))
    return found


def _two(name: str, speed: float, aside: float, spin: Vector, turn: Vector) -> ContactCase:
    """Case of two spheres that meet along x at a speed each, their centres apart by `aside` along y."""
    along = math.sqrt((2.0 * RADIUS + GAP) ** 2 - aside**2) / 2.0
    places = ((-along, -aside / 2.0, 0.0), (along, aside / 2.0, 0.0))
    return ContactCase(name, places, ((speed, 0.0, 0.0), (-speed, 0.0, 0.0)), (spin, turn), duration=2e-3)


def _resting_height() -> float:
    """Height of a sphere that its weight presses into the plate [m]."""
    case = ContactCase("", ((0.0, 0.0, RADIUS),), ((0.0,) * 3,), ((0.0,) * 3,), 0.0, on_plate=True)
    modulus = case.contact(ContactLaws()).coefficients.modulus
    return RADIUS - (case.mass * GRAVITY / (4.0 / 3.0 * modulus * math.sqrt(RADIUS))) ** (2.0 / 3.0)


def _on_plate(
    name: str, height: float, velocity: Vector, spin: Vector, duration: float, step_fraction: float = 0.01
) -> ContactCase:
    place = ((0.0, 0.0, height),)
    return ContactCase(name, place, (velocity,), (spin,), duration, True, GRAVITY, step_fraction)


_NONE = (0.0, 0.0, 0.0)

CASES: tuple[ContactCase, ...] = (
    _two("two spheres, normal", 0.1, 0.0, _NONE, _NONE),
    _two("two spheres, oblique", 0.1, 0.5 * RADIUS, _NONE, _NONE),
    _two("two spheres, rolling on each other", 0.1, 0.0, (0.0, 0.0, 20.0), (0.0, 0.0, -20.0)),
    _two("two spheres, twisting", 0.1, 0.0, (50.0, 0.0, 0.0), (-50.0, 0.0, 0.0)),
    _on_plate("plate, normal", RADIUS + GAP, (0.0, 0.0, -0.1), _NONE, 2e-3),
    _on_plate("plate, oblique", RADIUS + GAP, (0.1, 0.0, -0.1), _NONE, 2e-3),
    _on_plate("plate, rolling", _resting_height(), (0.05, 0.0, 0.0), (0.0, 0.05 / RADIUS, 0.0), 0.2, 0.04),
    _on_plate("plate, twisting", _resting_height(), _NONE, (0.0, 0.0, 50.0), 0.02, 0.02),
)
"""All cases."""
