"""Contacts counted on the host from spheres in place: one way for the states of all codes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from dem_warp import ClumpShape
from dem_warp.walls import Cylinder, Plane, Wall


def placed_centers(
    shape: ClumpShape, positions: np.ndarray, orientations: np.ndarray, sizes: np.ndarray
) -> np.ndarray:
    """Centres of the spheres of n grains of one shape [m], (n * S, 3), grain by grain."""
    turns = Rotation.from_quat(orientations).as_matrix()
    local = shape.centers * sizes[:, None, None]
    return (positions[:, None] + np.einsum("nij,nsj->nsi", turns, local)).reshape(-1, 3)


@dataclass(frozen=True)
class ContactCounts:
    """Touching pairs of one world."""

    grain_pairs: int
    """Pairs of spheres of different grains."""
    wall_pairs: int
    """Spheres that touch a wall, once for each wall."""

    def entries(self, mutual: bool) -> int:
        """Entries of the grains' lists: each pair stands in both lists if they are mutual, else in one."""
        return (2 if mutual else 1) * self.grain_pairs + self.wall_pairs


def count_contacts(
    centers: np.ndarray, radii: np.ndarray, grain: np.ndarray, walls: Sequence[Wall]
) -> ContactCounts:
    """Count the touching pairs of spheres in place [m]; `grain` is the one that each belongs to.

    Walls are planes, and cylinders of which the rims are left out.
    """
    pairs = cKDTree(centers).query_pairs(2 * radii.max(), output_type="ndarray")
    a, b = pairs[grain[pairs[:, 0]] != grain[pairs[:, 1]]].T
    reach = radii[a] + radii[b]
    touching = np.einsum("ij,ij->i", centers[a] - centers[b], centers[a] - centers[b]) < reach**2
    on_walls = sum(int(np.count_nonzero(_wall_distance(wall, centers) < radii)) for wall in walls)
    return ContactCounts(int(np.count_nonzero(touching)), on_walls)


def _wall_distance(wall: Wall, points: np.ndarray) -> np.ndarray:
    """Distance of points from a wall [m]; infinite beyond a cylinder's rims."""
    if not isinstance(wall, Plane | Cylinder):
        raise ValueError(f"count_contacts.walls: must be planes and cylinders, got {wall!r}")
    offset = points - np.asarray(wall.point)
    along = offset @ np.asarray(wall.axis)
    if isinstance(wall, Plane):
        return along
    aside = np.abs(np.linalg.norm(offset - np.outer(along, wall.axis), axis=1) - wall.radius)
    return np.where((along >= 0.0) & (along <= wall.length), aside, np.inf)
