"""Meshes of grains as files have them: welded, cleaned, and judged by their surface."""

from __future__ import annotations

import io
import re
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dem_warp.solids import LARGEST_MESH, MESH_KINDS, read_mesh
from experiments.io.errors import InputError
from experiments.io.files import check_file, check_lines

if TYPE_CHECKING:
    from trimesh import Trimesh

WELDED = 1e-6
"""Distance of corners that are one, over the mesh's length: single precision of files is 1e-7."""
MOST_LINES = 1_000_000
"""Lines of the largest text: corners and faces of the scan of a grain are a tenth of it."""

_COMMAS = re.compile(rb"^[ \t]*(?:v(?:ertex)?[ \t]+)?-?(?=\d)[^\n]*\d,\d[^\r\n]*", re.MULTILINE)
"""Corner of a text with a decimal comma."""

Corners = NDArray[np.float64]
Faces = NDArray[np.intp]


FLAT = 1e-3
"""Least thickness of a body, as a part of its length."""


def read_surface(path: Path, unit: float) -> Trimesh:
    """Read a closed surface [m] from a mesh file; `unit` is its unit [m].

    Corners at one place are welded, empty and doubled triangles dropped. Raise `InputError` with what is
    wrong with the surface, or `ValueError` of `read_mesh`.
    """
    if path.is_file():
        check_file(path, LARGEST_MESH)
        check_lines(path, MOST_LINES, "Simplify it (in MeshLab: Quadric Edge Collapse Decimation).")
        with path.open("rb") as file:
            head = file.read(65536)
        if b"\0" not in head and (found := _COMMAS.search(head)):
            hint = "Write its numbers with a decimal point."
            raise InputError(str(path), "has numbers with a decimal comma", found[0].decode("latin-1"), hint)
    try:
        with np.errstate(invalid="ignore"):  # the centre of an empty volume
            mesh = read_mesh(path, unit)
    except ValueError:
        corners, faces = _loaded(path)
        if faces is None:
            raise
        mesh = _closed(path, *_cleaned(corners, faces), unit)
    if mesh.extents.min() < FLAT * mesh.extents.max():
        problem = f"is too flat to be filled with spheres: {1e3 * mesh.extents.min():.3g} mm"
        raise InputError(str(path), problem, hint="Give it its thickness in a mesh program.")
    if mesh.body_count == 1 and _crosses_itself(mesh):
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
    try:
        mesh = trimesh.load(io.BytesIO(path.read_bytes()), file_type=kind, process=False, force=None)
    except Exception:  # the reader has given its reason
        return np.empty((0, 3)), None
    corners = np.asarray(getattr(mesh, "vertices", []), dtype=np.float64).reshape(-1, 3)
    faces = np.asarray(getattr(mesh, "faces", []), dtype=np.intp).reshape(-1, 3)
    if not len(corners):
        raise InputError(str(path), "has no triangles: it is no mesh, empty, or cut off")
    if not len(faces):
        hint = "Make a surface of it, in MeshLab by Screened Poisson reconstruction."
        raise InputError(str(path), "a cloud of points, not a surface", f"{len(corners)} points", hint)
    if not np.isfinite(corners).all():
        raise InputError(str(path), "a corner has a place that is not a finite number")
    return corners, faces


def _cleaned(corners: Corners, faces: Faces) -> tuple[Corners, Faces]:
    """Weld corners by position; drop empty and doubled triangles."""
    from scipy.spatial import cKDTree
    from trimesh.graph import connected_component_labels

    places, own = np.unique(corners, axis=0, return_inverse=True)
    near = cKDTree(places).query_pairs(WELDED * float(np.ptp(places, axis=0).max()), output_type="ndarray")
    welded = connected_component_labels(near, len(places))
    middles = np.zeros((welded.max() + 1, 3))
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
    import trimesh

    edges, counts = _edges(faces)
    for wrong, finding, name, hint in (
        (counts > 2, "has inner walls", "edges of three triangles or more", "Remove them in a mesh program."),
        (counts == 1, "is open", "open edges", "Close the hole in a mesh program (in MeshLab: Close Holes)."),
    ):
        if wrong.any():
            own = trimesh.graph.connected_component_labels(edges[wrong])[edges[wrong, 0]]
            places, ends = len(np.unique(own)), corners[edges[wrong]]
            length = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())
            x, y, z = ends[own == np.bincount(own).argmax()].mean(axis=(0, 1))
            at = "around" if places == 1 else f"at {places} places, most of them around"
            found = (
                f"{int(wrong.sum())} {name} {at} ({x:.4g}, {y:.4g}, {z:.4g}), {length:.4g} long in all, "
                "in the file's unit"
            )
            raise InputError(str(path), f"the surface {finding}", found, hint)
    with TemporaryDirectory() as folder:  # the reader turns the faces outward, and checks the volume
        copy = Path(folder) / "surface.off"
        size = float(np.ptp(corners, axis=0).max())
        trimesh.Trimesh(corners / size, faces, process=False).export(copy)
        return read_mesh(copy, unit * size)


def _crosses_itself(mesh: Trimesh) -> bool:
    """Return whether an edge passes through a face that has none of its corners."""
    import pyvista
    from vtkmodules.vtkCommonCore import vtkIdList, vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkStaticCellLocator

    tree, places, met = vtkStaticCellLocator(), vtkPoints(), vtkIdList()
    tree.SetDataSet(pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces))
    tree.BuildLocator()
    faces, corners = [set(face) for face in mesh.faces.tolist()], np.asarray(mesh.vertices).tolist()
    for one, other in mesh.edges_unique.tolist():
        tree.IntersectWithLine(corners[one], corners[other], 0.0, places, met)
        if any(faces[met.GetId(n)].isdisjoint((one, other)) for n in range(met.GetNumberOfIds())):
            return True
    return False
