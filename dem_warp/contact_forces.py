"""Contact forces of a world between two steps, found without a change of its state."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from dem_warp.entries import max_partners
from dem_warp.kernels.probe import probe_kernels
from dem_warp.rollback import Rollback
from dem_warp.solver import Solver

NO_GRAIN = NO_WALL = -1
"""Grain or wall number of a partner of the other kind."""


@dataclass(frozen=True, eq=False)
class ContactForces:
    """Contacts with a force: each pair of spheres, or of a sphere and a wall, once."""

    grains: np.ndarray
    """Slot of the grain with the force, shape (n,)."""
    partners: np.ndarray
    """Slot of the partner, NO_GRAIN for a wall, shape (n,)."""
    walls: np.ndarray
    """Number of the partner wall, NO_WALL for a grain, shape (n,)."""
    forces: np.ndarray
    """Forces [N], shape (n, 3)."""
    points: np.ndarray
    """Places of the contacts [m], shape (n, 3)."""
    normals: np.ndarray
    """Unit vectors from the partner to the grain, shape (n, 3)."""

    def __len__(self) -> int:
        return len(self.grains)


class ForceProbe:
    """Measurement of the forces at the beginning of a batch's next step.

    The law advances the histories of contacts, so the state is copied before and restored after.
    """

    def __init__(self, solver: Solver) -> None:
        self._solver, self._kept = solver, Rollback(solver)
        self._measure = probe_kernels(solver.build).measure

    def forces(self, world: int) -> ContactForces:
        """Return the contacts of a world, between two calls of `Solver.advance`."""
        solver, real = self._solver, self._solver.precision
        slots, capacity = solver.layout.grain_count, solver.neighbours.capacity
        for wall in range(solver.layout.wall_count):
            solver.wall_pose(world, wall)
        out = [wp.zeros(slots * capacity, dtype=kind, device=solver.device) for kind in (real.vec3, wp.vec3d)]
        forces, points, normals = (*out, wp.zeros_like(out[0]))
        self._kept.keep()
        inputs = [world, solver.model, solver.grains[0], solver.alive, solver.neighbours]
        wp.launch(self._measure, slots, inputs=[*inputs, forces, points, normals], device=solver.device)
        self._kept.restore(world)
        for reactions in (solver.neighbours.reactions.force, solver.neighbours.reactions.torque):
            reactions.zero_()
        borne = forces.numpy()
        found = np.flatnonzero((borne != 0.0).any(axis=1))
        return self._named(world, found, borne[found], points.numpy()[found], normals.numpy()[found])

    def _named(
        self, world: int, found: np.ndarray, forces: np.ndarray, points: np.ndarray, normals: np.ndarray
    ) -> ContactForces:
        """Return the contacts of the entries found; a pair in two lists counts once."""
        solver, setup = self._solver, self._solver.worlds[world]
        layout, capacity = solver.layout, solver.neighbours.capacity
        grains = found // capacity
        entry = solver.neighbours.entry.numpy()[world * layout.grain_count * capacity + found]
        partner = entry % max_partners(layout.sphere_count)
        number = partner - layout.grain_count * layout.sphere_count
        is_wall = number >= 0
        partners = np.where(is_wall, NO_GRAIN, partner // layout.sphere_count)
        # the triangles of the first mesh follow the walls, then those of the next
        counts = [wall.triangle_count for wall, _ in setup.walls]
        owners = np.concatenate([np.arange(layout.wall_count), np.repeat(np.arange(len(counts)), counts)])
        walls = np.where(is_wall, owners[np.where(is_wall, number, 0)], NO_WALL)
        once = is_wall | (grains < partners) | (not solver.build.cooperative)
        columns = (grains, partners, walls, forces.astype(float), points, normals.astype(float))
        return ContactForces(*(column[once] for column in columns))
