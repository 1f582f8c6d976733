"""Contacts of grains, found anew from their poses: every pair of spheres, every sphere and wall."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from dem_warp.model import WorldSetup
from dem_warp.walls import Cone, Cylinder, Plane


@dataclass(frozen=True)
class Touching:
    """Contacts of one moment; arrays by contact."""

    candidate: np.ndarray
    """Number of the pair among all that may ever touch."""
    first: np.ndarray
    second: np.ndarray
    """Grains; walls have the numbers after the last grain."""
    normal: np.ndarray
    """Unit vectors from the second to the first, shape (n, 3)."""
    overlap: np.ndarray
    radius: np.ndarray
    mass: np.ndarray
    """Overlap [m], effective radius [m] and effective mass [kg]."""
    levers: np.ndarray
    """Arms from both grains' centres to the contact [m], shape (2, n, 3)."""


class ContactFinder:
    """Finds the contacts of a world's grains, without neighbour lists."""

    def __init__(self, setup: WorldSetup) -> None:
        grains = setup.grains
        shapes = [setup.shapes[k] for k in grains.shapes]
        self.owner = np.repeat(np.arange(grains.count), [shape.sphere_count for shape in shapes])
        self.local = np.concatenate([s.centers * size for s, size in zip(shapes, grains.sizes, strict=True)])
        self.radii = np.concatenate([s.radii * size for s, size in zip(shapes, grains.sizes, strict=True)])
        self.masses = np.append(setup.masses, np.inf)
        first, second = np.triu_indices(len(self.owner), 1)
        apart = self.owner[first] != self.owner[second]
        self.first, self.second = first[apart], second[apart]
        self.walls = [wall for wall, _ in setup.walls]
        self.wall_body = grains.count
        self.candidate_count = len(self.first) + len(self.walls) * len(self.owner)

    def find(self, positions: np.ndarray, orientations: np.ndarray) -> Touching:
        """Contacts of grains at positions [m], (n, 3), and orientations, quaternions x y z w, (n, 4)."""
        arms = Rotation.from_quat(orientations[self.owner]).apply(self.local)
        centers = positions[self.owner] + arms
        parts = [self._pairs(centers, arms)]
        offset = len(self.first)
        for number, wall in enumerate(self.walls):
            parts.append(self._on_wall(wall, self.wall_body + number, offset, centers, arms))
            offset += len(self.owner)
        names = Touching.__dataclass_fields__
        return Touching(
            *(np.concatenate([getattr(p, n) for p in parts], axis=1 if n == "levers" else 0) for n in names)
        )

    def _pairs(self, centers: np.ndarray, arms: np.ndarray) -> Touching:
        reach = self.radii[self.first] + self.radii[self.second]
        across = centers[self.first] - centers[self.second]
        hit = np.flatnonzero(np.einsum("ij,ij->i", across, across) < reach**2)
        a, b = self.first[hit], self.second[hit]
        distance = np.linalg.norm(across[hit], axis=1)
        normal = across[hit] / distance[:, None]
        overlap = reach[hit] - distance
        ra, rb = self.radii[a], self.radii[b]
        ma, mb = self.masses[self.owner[a]], self.masses[self.owner[b]]
        inwards = arms[a] + normal * (0.5 * overlap - ra)[:, None]
        levers = np.stack([inwards, arms[b] + normal * (rb - 0.5 * overlap)[:, None]])
        radius, mass = ra * rb / (ra + rb), ma * mb / (ma + mb)
        return Touching(hit, self.owner[a], self.owner[b], normal, overlap, radius, mass, levers)

    def move_walls(self, paths: np.ndarray) -> None:
        """Move the walls, (walls, 3) [m]."""
        moved = zip(self.walls, paths, strict=True)
        self.walls = [replace(wall, point=tuple(wall.point + path)) for wall, path in moved]

    def _on_wall(
        self, wall: object, body: int, offset: int, centers: np.ndarray, arms: np.ndarray
    ) -> Touching:
        if isinstance(wall, Plane):
            normals = np.broadcast_to(wall.axis, centers.shape)
            gap = (centers - wall.point) @ np.array(wall.axis)
        elif isinstance(wall, Cylinder):
            out = (centers - wall.point) * [1.0, 1.0, 0.0]
            distance = np.linalg.norm(out, axis=1)
            normals = -out / np.maximum(distance, 1e-300)[:, None]
            gap = wall.radius - distance
        elif isinstance(wall, Cone):  # from outside, above a tip at `point`
            off, flank = centers - wall.point, np.array([0.0, 0.0, wall.length])
            flank = flank + off * [1.0, 1.0, 0.0] * (wall.upper_radius / np.hypot(off[:, :1], off[:, 1:2]))
            flank /= np.hypot(wall.length, wall.upper_radius)
            off -= flank * np.maximum((off * flank).sum(axis=1), 0.0)[:, None]
            gap = np.linalg.norm(off, axis=1)
            normals = off / gap[:, None]
        else:
            rule = "walls are planes, upright cylinders from inside and cones on their tip"
            raise ValueError(f"ContactFinder: {rule}, got {wall!r}")
        hit = np.flatnonzero(gap < self.radii)
        overlap, normal = self.radii[hit] - gap[hit], normals[hit]
        lever = arms[hit] + normal * (0.5 * overlap - self.radii[hit])[:, None]
        owner, wall_body = self.owner[hit], np.full(len(hit), body)
        levers = np.stack([lever, np.zeros_like(lever)])
        radius, mass = self.radii[hit], self.masses[owner]
        return Touching(offset + hit, owner, wall_body, normal, overlap, radius, mass, levers)
