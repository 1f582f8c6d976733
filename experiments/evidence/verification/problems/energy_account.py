"""A closed account of a world's energy, kept in float64 next to the simulation.

From the poses and velocities of every step, and from nothing else of the simulator, the account finds the
contacts, works out the documented law anew and books what each part of it does. The kinetic energy at a step
is m v(-) . v(+) / 2, of the velocities half a step before and after: its change is exactly the work of the
forces by the trapezoidal rule. So what is left over is that rule's error in the elastic energies, which
falls with the time step, and any difference between the law as documented and as simulated.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from dem_warp.model import ContactCoefficients, WorldSetup
from experiments.evidence.verification.problems.contact_geometry import ContactFinder, Touching
from experiments.evidence.verification.problems.setups import Motion

STORED = ("kinetic", "height", "normal springs", "tangential springs")
LOST = (
    "normal damping",
    "tangential damping",
    "sliding",
    "rolling friction",
    "tangential stiffness change",
    "turning of tangential springs",
)
PARTS = (*STORED, *LOST)


@dataclass(frozen=True)
class Moment:
    """Forces and powers of the law at one step; arrays by contact, but for the last."""

    touching: Touching
    stiffness: np.ndarray
    """Stiffness of the tangential springs [N/m]."""
    unturned: np.ndarray
    turned: np.ndarray
    displacement: np.ndarray
    slipped: np.ndarray
    """Tangential displacement [m] before it was turned into the contact's plane, after, at the end of the
    step, and the part of it that slid away, shape (n, 3)."""
    spring: np.ndarray
    normal_damping: np.ndarray
    tangential_damping: np.ndarray
    """Forces on the first grain [N], shape (n, 3)."""
    forces: np.ndarray
    torques: np.ndarray
    rolling: np.ndarray
    """Forces and torques of all contacts on each grain [N], [N m], and the torque of its rolling resistance
    [N m], shape (grains, 3)."""


class EnergyAccount:
    """Energies [J] of a world with one contact law for all, step by step.

    `wall_velocities` [m/s], 0 at first, are those of walls that move, from the step on that was seen last.
    The account books by a law of its own, by default that of the world. `force_gap` [N] and `torque_gap`
    [N m] are the largest differences between a force or torque of the law and what moved a grain, over all
    steps and grains; `largest_force` and `largest_torque` are the largest of these themselves.
    """

    def __init__(self, setup: WorldSetup, law: ContactCoefficients | None = None) -> None:
        if len(set(setup.contacts)) > 1 or setup.contacts[0].mechanisms:
            raise ValueError(f"EnergyAccount: needs one base law for all contacts, got {setup.contacts!r}")
        self.setup = setup
        self.law = law or setup.contacts[0]
        self.finder = ContactFinder(setup)
        self.wall_velocities = np.zeros((len(setup.walls), 3))
        self.lost = dict.fromkeys(LOST, 0.0)
        self.force_gap = self.torque_gap = self.largest_force = self.largest_torque = 0.0
        self._displacements = np.zeros((self.finder.candidate_count, 3))
        self._stiffnesses = np.zeros(self.finder.candidate_count)
        self._last: tuple[Motion, Moment, list[float]] | None = None
        self._rows: list[list[float]] = []

    @property
    def parts(self) -> np.ndarray:
        """Energies of the `PARTS` after each step but the last, (steps, parts) [J]."""
        return np.array(self._rows)

    def see(self, state: Any) -> None:
        """Book the step that ends in a state of the solver."""
        now = Motion.of(state, self.setup.grains.count)
        if self._last and self.wall_velocities.any():
            self.finder.move_walls(self.wall_velocities * self.setup.time_step)
        moment = self._moment(now)
        if self._last:
            before, earlier, stored = self._last
            self._rows.append([self._kinetic(before, now), *stored])
            self._compare(before, now, earlier)
            self._book(now, earlier, moment)
        touching = moment.touching
        self._displacements[:] = 0.0
        self._displacements[touching.candidate] = moment.displacement
        self._stiffnesses[:] = 0.0
        self._stiffnesses[touching.candidate] = moment.stiffness
        self._last = now, moment, [*self._potentials(now, moment), *self.lost.values()]

    # ---- the law -------------------------------------------------------------------------------------------

    def _slip_velocities(self, touching: Touching, now: Motion) -> np.ndarray:
        """Velocity of the first surface against the second at each contact [m/s]."""
        velocities = np.vstack([now.velocities, self.wall_velocities])
        spins = np.vstack([now.spins, np.zeros_like(self.wall_velocities)])
        first = velocities[touching.first] + np.cross(spins[touching.first], touching.levers[0])
        return first - velocities[touching.second] - np.cross(spins[touching.second], touching.levers[1])

    def _moment(self, now: Motion) -> Moment:
        law, dt = self.law, self.setup.time_step
        touching = self.finder.find(now.positions, now.orientations)
        normal, overlap = touching.normal, touching.overlap
        velocity = self._slip_velocities(touching, now)
        approach = np.einsum("ij,ij->i", velocity, normal)
        root = np.sqrt(touching.radius * overlap)
        normal_stiffness, stiffness = 2.0 * law.modulus * root, 8.0 * law.shear_modulus * root
        spring = 2.0 / 3.0 * normal_stiffness * overlap
        damping = -law.damping * np.sqrt(normal_stiffness * touching.mass) * approach
        if law.clamp_attraction:
            damping = np.maximum(damping, -spring)
        limit = law.static_friction * np.maximum(spring + damping, 0.0)

        tangential = velocity - normal * approach[:, None]
        unturned = self._displacements[touching.candidate]
        turned = unturned - normal * np.einsum("ij,ij->i", unturned, normal)[:, None]
        advanced = turned + tangential * dt
        keep = _share(stiffness * np.linalg.norm(advanced, axis=1), limit)
        displacement = advanced * keep[:, None]
        pull = -stiffness[:, None] * displacement
        rate = law.tangential_damping * law.damping * np.sqrt(stiffness * touching.mass)
        drag = -rate[:, None] * tangential
        drag = np.where(keep[:, None] < 1.0, 0.0, drag)
        drag = (pull + drag) * _share(np.linalg.norm(pull + drag, axis=1), limit)[:, None] - pull

        force = normal * (spring + damping)[:, None] + pull + drag
        resisted = law.rolling_friction * np.maximum(spring + damping, 0.0)
        forces, torques, most = self._sums(touching, force, resisted)
        return Moment(
            touching,
            stiffness,
            unturned,
            turned,
            displacement,
            advanced - displacement,
            pull,
            normal * damping[:, None],
            drag,
            forces,
            torques,
            self._rolling(now, torques, most),
        )

    def _sums(
        self, touching: Touching, force: np.ndarray, resisted: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Force [N], torque [N m] and largest rolling torque [N m] of each grain."""
        count = self.setup.grains.count
        bodies = count + len(self.wall_velocities)
        forces, torques, most = np.zeros((bodies, 3)), np.zeros((bodies, 3)), np.zeros(bodies)
        sides = ((touching.first, touching.levers[0], 1.0), (touching.second, touching.levers[1], -1.0))
        for grains, levers, sign in sides:
            np.add.at(forces, grains, sign * force)
            np.add.at(torques, grains, sign * np.cross(levers, force))
            np.add.at(most, grains, resisted * np.linalg.norm(levers, axis=1))
        return forces[:count], torques[:count], most[:count]

    def _rolling(self, now: Motion, torques: np.ndarray, most: np.ndarray) -> np.ndarray:
        """Torque [N m] by which rolling resistance, `most` at the most, changes each spin; it may stop it."""
        dt, inertias = self.setup.time_step, self.setup.inertias
        turns = Rotation.from_quat(now.orientations)
        spins = turns.inv().apply(now.spins) + turns.inv().apply(torques) / inertias * dt
        speeds = np.linalg.norm(spins, axis=1)
        loss = spins / inertias * (most * dt / np.maximum(speeds, 1e-300))[:, None]
        stops = (np.einsum("ij,ij->i", loss, spins) >= speeds**2) & (most > 0.0)
        loss = np.where(stops[:, None], spins, loss)
        return turns.apply(-inertias * loss / dt)

    # ---- the books -----------------------------------------------------------------------------------------

    def _compare(self, before: Motion, after: Motion, moment: Moment) -> None:
        """Keep the largest gap between the law's forces and what changed the grains' momenta."""
        dt, masses = self.setup.time_step, self.setup.masses[:, None]
        pushes = masses * ((after.velocities - before.velocities) / dt - np.array(self.setup.gravity))
        twists = (self._spin_momenta(after) - self._spin_momenta(before)) / dt
        gaps = np.abs(pushes - moment.forces).max(), np.abs(twists - moment.torques - moment.rolling).max()
        largest = np.abs(moment.forces).max(), np.abs(moment.torques).max()
        self.force_gap, self.torque_gap = np.maximum((self.force_gap, self.torque_gap), gaps)
        before_it = self.largest_force, self.largest_torque
        self.largest_force, self.largest_torque = np.maximum(before_it, largest)

    def _kinetic(self, before: Motion, after: Motion) -> float:
        """Kinetic energy [J] at a step, from the velocities half a step before it and after."""
        linear = 0.5 * self.setup.masses * np.einsum("ij,ij->i", before.velocities, after.velocities)
        momenta = [self._spin_momenta(at) for at in (before, after)]
        turning = 0.25 * np.sum(before.spins * momenta[1] + after.spins * momenta[0])
        return float(linear.sum() + turning)

    def _spin_momenta(self, at: Motion) -> np.ndarray:
        turns = Rotation.from_quat(at.orientations)
        return turns.apply(self.setup.inertias * turns.inv().apply(at.spins))

    def _potentials(self, now: Motion, moment: Moment) -> tuple[float, float, float]:
        height = -float(self.setup.masses @ (now.positions @ np.array(self.setup.gravity)))
        touching = moment.touching
        normal = 8.0 / 15.0 * self.law.modulus * np.sqrt(touching.radius) * touching.overlap**2.5
        tangential = _spring_energies(moment.stiffness, moment.displacement)
        return height, float(normal.sum()), float(tangential.sum())

    def _book(self, now: Motion, earlier: Moment, moment: Moment) -> None:
        """Add what was lost between two steps, by the trapezoidal rule."""
        half = 0.5 * self.setup.time_step
        first, last = (self._slip_velocities(at.touching, now) for at in (earlier, moment))
        works = np.sum(earlier.normal_damping * first) + np.sum(moment.normal_damping * last)
        self.lost["normal damping"] -= half * float(works)
        works = np.sum(earlier.tangential_damping * first) + np.sum(moment.tangential_damping * last)
        self.lost["tangential damping"] -= half * float(works)
        self.lost["rolling friction"] -= half * float(np.sum((earlier.rolling + moment.rolling) * now.spins))
        at = moment.touching.candidate
        stiffness = self._stiffnesses[at]
        pulls = moment.spring - stiffness[:, None] * moment.unturned
        self.lost["sliding"] -= 0.5 * float(np.sum(pulls * moment.slipped))
        energies = _spring_energies(stiffness, moment.unturned)
        turned = (energies - _spring_energies(stiffness, moment.turned)).sum()
        self.lost["turning of tangential springs"] += float(turned)
        squares = np.sum(moment.displacement**2 + moment.unturned**2, axis=1)
        parted = _spring_energies(self._stiffnesses, self._displacements).sum() - energies.sum()
        changed = parted - 0.25 * np.sum((moment.stiffness - stiffness) * squares)
        self.lost["tangential stiffness change"] += float(changed)


def _share(size: np.ndarray, limit: np.ndarray) -> np.ndarray:
    """Factor that brings a size down to its limit; 1 within it."""
    return np.where(size > limit, limit / np.where(size > limit, size, 1.0), 1.0)


def _spring_energies(stiffness: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    return 0.5 * stiffness * np.einsum("ij,ij->i", displacement, displacement)
