"""Meshes of grains as files have them: welded, cleaned, and judged by their surface."""

from __future__ import annotations

import io
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dem_warp.solids import LARGEST_MESH, MESH_KINDS, read_mesh
from experiments.io.errors import InputError

if TYPE_CHECKING:
    from trimesh import Trimesh

WELDED = 1e-6
"""Distance of corners that are one, over the mesh's length: single precision of files is 1e-7."""
CHECKED = 300
"""Faces whose two sides are checked for a surface that crosses itself."""
SIDE = 1e-5
"""Distance of the checked points from their face, over the mesh's length."""
AT_ONCE = 1_000_000
"""Solid angles that are computed at once."""

Corners = NDArray[np.float64]
Faces = NDArray[np.intp]


def read_surface(path: Path, unit: float) -> Trimesh:
    """Read a closed surface [m] from a mesh file; `unit` is its unit [m].

    Corners at one place are welded, empty and doubled triangles dropped. Raise `InputError` with what is
    wrong with the surface, or `ValueError` of `read_mesh`.
    """
    try:
        mesh = read_mesh(path, unit)
    except ValueError:
        corners, faces = _loaded(path)
        if faces is None:
            raise
        mesh = _closed(path, *_cleaned(corners, faces), unit)
    if mesh.body_count == 1 and _crosses_itself(np.asarray(mesh.triangles)):
        problem = "the surface crosses itself"
        hint = "Unite its parts in a mesh program (in Blender: Remesh; in MeshLab: Mesh Boolean)."
        raise InputError(str(path), problem, hint=hint)
    return mesh


def _loaded(path: Path) -> tuple[Corners, Faces | None]:
    """Return the corners and faces of a file as they are; no faces where it cannot be read."""
    import trimesh

    kind = path.suffix.lower().removeprefix(".")
    if kind not in MESH_KINDS:
        problem, hint = f"must be a mesh that ends in {', '.join(MESH_KINDS)}", "Export the shape as STL."
        raise InputError(str(path), problem, kind or "no ending", hint)
    if path.stat().st_size > LARGEST_MESH:
        return np.empty((0, 3)), None
    try:
        mesh = trimesh.load(io.BytesIO(path.read_bytes()), file_type=kind, process=False, force=None)
    except Exception:  # the reader has given its reason
        return np.empty((0, 3)), None
    corners = np.asarray(getattr(mesh, "vertices", []), dtype=np.float64).reshape(-1, 3)
    faces = np.asarray(getattr(mesh, "faces", []), dtype=np.intp).reshape(-1, 3)
    if not len(corners):
        raise InputError(str(path), "has no triangles: it is not a mesh, or an empty one")
    if not len(faces):
        hint = "Make a surface of it, in MeshLab by Screened Poisson reconstruction."
        raise InputError(str(path), "a cloud of points, not a surface", f"{len(corners)} points", hint)
    return corners, faces if len(faces) and np.isfinite(corners).all() else None


def _cleaned(corners: Corners, faces: Faces) -> tuple[Corners, Faces]:
    """Weld corners by position; drop empty and doubled triangles."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    places, own = np.unique(corners, axis=0, return_inverse=True)
    near = cKDTree(places).query_pairs(WELDED * float(np.ptp(places, axis=0).max()), output_type="ndarray")
    links = coo_array((np.ones(len(near)), near.T), shape=(len(places), len(places)))
    count, welded = connected_components(links, directed=False)
    middles = np.zeros((count, 3))
    middles[welded] = places
    faces = welded[own.ravel()[faces]]
    distinct = faces[[len(set(face)) == 3 for face in faces.tolist()]]
    _, first = np.unique(np.sort(distinct, axis=1), axis=0, return_index=True)
    kept = distinct[np.sort(first)]
    sides = middles[kept[:, 1:]] - middles[kept[:, :1]]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    full = kept[areas > WELDED * (sides**2).sum(axis=(1, 2))]
    # an empty triangle with three corners may close a surface, or stick to it
    return middles, full if (_edges(full)[1] == 2).all() else kept


def _edges(faces: Faces) -> tuple[Faces, Faces]:
    """Return the edges of faces, and the number of faces at each."""
    pairs = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return np.unique(pairs, axis=0, return_counts=True)


def _closed(path: Path, corners: Corners, faces: Faces, unit: float) -> Trimesh:
    """Build a closed surface; raise `InputError` with its open edges."""
    edges, counts = _edges(faces)
    for wrong, finding, name, hint in (
        (counts > 2, "has inner walls", "edges of three triangles or more", "Remove them in a mesh program."),
        (counts == 1, "is open", "open edges", "Close the hole in a mesh program (in MeshLab: Close Holes)."),
    ):
        if wrong.any():
            ends = corners[edges[wrong]]
            length = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())
            x, y, z = ends.mean(axis=(0, 1))
            found = (
                f"{int(wrong.sum())} {name} around ({x:.4g}, {y:.4g}, {z:.4g}), {length:.4g} long in all, "
                "in the file's unit"
            )
            raise InputError(str(path), f"the surface {finding}", found, hint)
    import trimesh

    with TemporaryDirectory() as folder:  # the reader turns the faces outward, and checks the volume
        copy = Path(folder) / "surface.off"
        size = float(np.ptp(corners, axis=0).max())
        trimesh.Trimesh(corners / size, faces, process=False).export(copy)
        return read_mesh(copy, unit * size)


def _crosses_itself(triangles: Corners) -> bool:
    """Return whether a side of a face is inside where it must be outside, or twice inside.

    The winding number of a closed surface is 1 inside and 0 outside (Jacobson and others, 2013,
    doi:10.1145/2461912.2461916).
    """
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    chosen = np.unique(np.linspace(0, len(triangles) - 1, CHECKED).astype(int))
    chosen = chosen[areas[chosen] > 0.0]
    step = SIDE * float(np.ptp(triangles.reshape(-1, 3), axis=0).max())
    middles = triangles[chosen].mean(axis=1)
    away = step * normals[chosen] / areas[chosen, None]
    outside, inside = (_winding(middles + side * away, triangles) for side in (1.0, -1.0))
    return bool((np.abs(outside) > 0.5).any() or (np.abs(inside - 1.0) > 0.5).any())


def _winding(points: Corners, triangles: Corners) -> Corners:
    """Winding numbers of a surface about points (van Oosterom and Strackee, 1983)."""
    parts = np.array_split(points, max(1, len(points) * len(triangles) // AT_ONCE))
    return np.concatenate([_solid_angles(part, triangles) for part in parts]) / (4.0 * np.pi)


def _solid_angles(points: Corners, triangles: Corners) -> Corners:
    a, b, c = (triangles[None, :, corner] - points[:, None] for corner in range(3))
    x, y, z = (np.linalg.norm(each, axis=2) for each in (a, b, c))
    across = np.einsum("ijk,ijk->ij", a, np.cross(b, c))
    along = x * y * z + sum(
        np.einsum("ijk,ijk->ij", one, other) * size for one, other, size in ((a, b, z), (b, c, x), (c, a, y))
    )
    return np.asarray(2.0 * np.arctan2(across, along).sum(axis=1))
