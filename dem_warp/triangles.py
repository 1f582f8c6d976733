"""Triangles of the meshes of a batch, and who is beside whom, as device arrays."""

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
"""Triangles of a mesh, at the most, around which the others are counted."""


@dataclass(frozen=True, eq=False)
class TriangleTable:
    """Triangles of one mesh."""

    corners: np.ndarray
    """From the mesh's point [m], each triangle's in the order of the vertices' numbers: so two triangles
    have an edge that they share the same way around, shape (m, 3, 3)."""
    normals: np.ndarray
    """Unit vectors, shape (m, 3)."""
    first: np.ndarray
    count: np.ndarray
    """First place in `beside` of a triangle's neighbours, and their number, shape (m,)."""
    beside: np.ndarray
    """8 times a neighbour's number, plus bits 1, 2 and 4 for the own corners that it shares, shape
    (k,)."""

    @classmethod
    def of(cls, mesh: Mesh) -> "TriangleTable":
        """Table of a mesh; vertices of equal coordinates are one."""
        vertices, number = np.unique(mesh.vertices + 0.0, axis=0, return_inverse=True)
        faces = np.sort(number.ravel()[mesh.faces], axis=1)
        corners = (vertices - np.array(mesh.point))[faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        owner, other, shared = _neighbours(faces)
        first = np.searchsorted(owner, np.arange(len(faces) + 1))
        return cls(corners, normals, first[:-1], np.diff(first), other * 8 + shared)


def _neighbours(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs of triangles that share corners, sorted, and bits for the corners of the first of the pair."""
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
    """Most triangles that lie about as near as `reach` [m] to a point of the mesh."""
    corners = mesh.vertices[mesh.faces]
    lower, upper = corners.min(axis=1) - reach, corners.max(axis=1) + reach
    middles = corners.mean(axis=1)[:: -(-len(corners) // SAMPLE)]
    return max(int(np.count_nonzero(((lower < p) & (p < upper)).all(axis=1))) for p in middles)


def meshes_of(worlds: Sequence[WorldSetup]) -> list[Mesh]:
    """Every different mesh of the worlds."""
    walls = (wall for world in worlds for wall, _ in world.walls)
    return list(dict.fromkeys(wall for wall in walls if isinstance(wall, Mesh)))


def place_triangles(
    model: Any, worlds: Sequence[WorldSetup], precision: Precision, device: Any
) -> list[wp.Mesh]:
    """Fill in the model's triangles; returns the search trees, which must outlive it."""
    types = device_structs(precision)
    meshes = meshes_of(worlds)
    tables = [TriangleTable.of(mesh) for mesh in meshes]
    first = np.cumsum([0, *(len(table.first) for table in tables)])
    beside = np.cumsum([0, *(len(table.beside) for table in tables)])
    trees = [_tree(table, device) for table in tables]
    rows = [
        {"a": a, "b": b, "c": c, "normal": normal, "first": start + begin, "count": count}
        for table, begin in zip(tables, beside, strict=False)
        for (a, b, c), normal, start, count in zip(
            table.corners, table.normals, table.first, table.count, strict=True
        )
    ]
    model.triangle = struct_array(types.Triangle, rows, device)
    together = np.concatenate([np.zeros(0, dtype=int), *(table.beside for table in tables)])
    model.beside = wp.array(together.astype(np.int32), dtype=int, device=device)
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
    """Of each wall: which mesh it is, its first triangle's number after the walls, how many it has."""
    number = len(world.walls)
    for wall, _ in world.walls:
        count = wall.triangle_count
        yield meshes.index(wall) if isinstance(wall, Mesh) else 0, number, count
        number += count
