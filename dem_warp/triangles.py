"""Triangles of the meshes of a batch, and their neighbours, as device arrays."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dem_warp.model import WorldSetup
from dem_warp.state import struct_array
from dem_warp.types import Precision, device_structs
from dem_warp.walls import Mesh

SAMPLE = 200
"""Most triangles of a mesh around which the others are counted."""


@dataclass(frozen=True, eq=False)
class TriangleTable:
    """Triangles of one mesh."""

    corners: np.ndarray
    """Corners from the mesh's point [m], sorted by the vertices' numbers, so that two triangles have a shared
    edge in the same direction, shape (m, 3, 3)."""
    normals: np.ndarray
    """Unit vectors, shape (m, 3)."""
    first: np.ndarray
    count: np.ndarray
    """First index in `adjacent` of a triangle's neighbours, and their number, shape (m,)."""
    adjacent: np.ndarray
    """8 times a neighbour's number, plus bits 1, 2 and 4 for the own corners that it shares, shape (k,)."""

    @classmethod
    def of(cls, mesh: Mesh) -> "TriangleTable":
        """Return the table of a mesh, with vertices of equal coordinates merged."""
        vertices, number = np.unique(mesh.vertices + 0.0, axis=0, return_inverse=True)
        faces = np.sort(number.ravel()[mesh.faces], axis=1)
        corners = (vertices - np.array(mesh.point))[faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        owner, other, shared = _neighbours(faces)
        first = np.searchsorted(owner, np.arange(len(faces) + 1))
        return cls(corners, normals, first[:-1], np.diff(first), other * 8 + shared)


def _neighbours(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the sorted pairs of triangles that share corners, and the bits of the first one's corners."""
    order = np.argsort(faces, axis=None, kind="stable")
    vertex, triangle, corner = faces.ravel()[order], order // 3, 1 << (order % 3)
    begin, end = np.searchsorted(vertex, vertex), np.searchsorted(vertex, vertex, side="right")
    around = end - begin
    # every corner with every corner at the same vertex
    own = np.repeat(np.arange(len(vertex)), around)
    step = np.arange(len(own)) - np.repeat(np.cumsum(around) - around, around)
    other = triangle[begin[own] + step]
    apart = triangle[own] != other
    key = triangle[own][apart] * len(faces) + other[apart]
    pairs, place = np.unique(key, return_inverse=True)
    shared = np.zeros(len(pairs), dtype=int)
    np.bitwise_or.at(shared, place, corner[own][apart])
    return pairs // len(faces), pairs % len(faces), shared


def most_within(mesh: Mesh, reach: float) -> int:
    """Return about the largest number of triangles within `reach` [m] of a point of the mesh."""
    corners = mesh.vertices[mesh.faces]
    lower, upper = corners.min(axis=1) - reach, corners.max(axis=1) + reach
    middles = corners.mean(axis=1)[:: -(-len(corners) // SAMPLE)]
    return max(int(np.count_nonzero(((lower < p) & (p < upper)).all(axis=1))) for p in middles)


def meshes_of(worlds: Sequence[WorldSetup]) -> list[Mesh]:
    """Return every different mesh of the worlds."""
    walls = (wall for world in worlds for wall, _ in world.walls)
    return list(dict.fromkeys(wall for wall in walls if isinstance(wall, Mesh)))


def place_triangles(
    model: Any, worlds: Sequence[WorldSetup], precision: Precision, device: Any
) -> list[wp.Mesh]:
    """Fill in the model's triangles; return the search trees, which the model needs."""
    types = device_structs(precision)
    meshes = meshes_of(worlds)
    tables = [TriangleTable.of(mesh) for mesh in meshes]
    first = np.cumsum([0, *(len(table.first) for table in tables)])
    adjacent = np.cumsum([0, *(len(table.adjacent) for table in tables)])
    trees = [_tree(table, device) for table in tables]
    rows = [
        {"a": a, "b": b, "c": c, "normal": normal, "first": start + begin, "count": count}
        for table, begin in zip(tables, adjacent, strict=False)
        for (a, b, c), normal, start, count in zip(
            table.corners, table.normals, table.first, table.count, strict=True
        )
    ]
    model.triangle = struct_array(types.Triangle, rows, device)
    together = np.concatenate([np.zeros(0, dtype=int), *(table.adjacent for table in tables)])
    model.adjacent = wp.array(together.astype(np.int32), dtype=int, device=device)
    facets = [
        {"bvh": trees[i].id, "first": first[i], "number": number, "count": count} if count else {}
        for world in worlds
        for i, number, count in _numbered(world, meshes)
    ]
    model.facets = struct_array(types.Facets, facets, device)
    return trees


def _tree(table: TriangleTable, device: Any) -> wp.Mesh:
    points: Any = wp.array(table.corners.reshape(-1, 3), dtype=wp.vec3, device=device)
    indices: Any = wp.array(np.arange(3 * len(table.corners)), dtype=int, device=device)
    return wp.Mesh(points, indices)


def _numbered(world: WorldSetup, meshes: list[Mesh]) -> Iterator[tuple[int, int, int]]:
    """Yield each wall's mesh index, number of the first triangle after the walls, and triangle count."""
    number = len(world.walls)
    for wall, _ in world.walls:
        count = wall.triangle_count
        yield meshes.index(wall) if isinstance(wall, Mesh) else 0, number, count
        number += count
