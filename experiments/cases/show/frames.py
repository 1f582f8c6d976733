"""Frames of a simulated case as series of files that ParaView and OVITO read.

Arrays have the names that LIGGGHTS gives them (``v``, ``omega``, ``f``, ``radius``, ``mass``, ``id``), which
OVITO knows.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

import numpy as np

from dem_warp import Film, Frame
from experiments.cases.engines.surfaces import triangles_of
from experiments.cases.show.polydata import poly, save, save_series
from experiments.io.files import replacing, write_text

if TYPE_CHECKING:
    import pyvista

BEYOND = 1.2
"""Half width of an endless plate that is drawn, relative to the farthest grain."""

AXES_OF_TENSOR = 9
"""Components of a matrix, row by row."""

VTK_OF_SERIES = (9, 7)
"""Lowest VTK that writes series: before, a file of a changing number of points is read with wrong ones."""


def write_frames(film: Film, folder: Path) -> list[Path]:
    """Write the frames of a case into a folder: one ``.pvd`` a series, which lists a file for each time [s].

    ``spheres.vtkhdf`` holds all spheres at all times, as the particle file of ON-DEM does; VTK before 9.7
    cannot write it, and it is left out.

    ``spheres`` and ``grains`` are points, ``contacts`` lines from a grain's centre to its partner's or to the
    wall, and each wall has a series of its own, by its name.

    Returns
    -------
    list of Path
        The ``.pvd`` files and the ``.vtkhdf`` file, if there is one.
    """
    import pyvista

    half_width, times, spheres = BEYOND * farthest(film), [frame.time for frame in film.frames], []
    written = {}
    for name in ("spheres", "grains", "contacts", *film.wall_names):
        rows = []
        for number, frame in enumerate(film.frames):
            place, data = Path(name) / f"{number:04d}.vtp", _data_of(name, film, frame, half_width)
            spheres += [data] * (name == "spheres")
            with replacing(folder / place) as temporary:
                save(data, temporary)
            rows.append((frame.time, place.as_posix()))
        written[folder / f"{name}.pvd"] = _collection(rows)
    # last, so that a series that exists is whole
    for path, text in written.items():
        write_text(path, text)
    if pyvista.vtk_version_info[:2] < VTK_OF_SERIES:
        return list(written)
    whole = folder / "spheres.vtkhdf"
    with replacing(whole) as temporary:
        save_series(times, spheres, temporary)
    return [*written, whole]


def farthest(film: Film) -> float:
    """Return the distance from the axis of the farthest grain or finite wall, in any frame [m]."""
    reach = [wall.reach for wall in film.walls if np.isfinite(wall.reach)]
    for frame in film.frames:
        centers, radii, _ = film.spheres(frame)
        reach += [float((np.hypot(centers[:, 0], centers[:, 1]) + radii).max(initial=0.0))]
    return max(reach)


def wall_triangles(film: Film, frame: Frame, wall: int, half_width: float) -> np.ndarray:
    """Return the triangles of a wall in a frame [m], (n, 3, 3); an endless plate has a half width [m]."""
    origin, turn = frame.wall_poses[wall]
    point = np.array(film.walls[wall].point)
    return origin + (triangles_of(film.walls[wall], half_width) - point) @ _matrices(turn[None])[0].T


def _data_of(name: str, film: Film, frame: Frame, half_width: float) -> pyvista.PolyData:
    if name == "spheres":
        return _spheres(film, frame)
    if name == "grains":
        return _grains(film, frame)
    if name == "contacts":
        return _contacts(frame)
    triangles = wall_triangles(film, frame, film.wall_names.index(name), half_width)
    corners = np.arange(3 * len(triangles)).reshape(-1, 3)
    return poly(triangles.reshape(-1, 3), faces=np.insert(corners, 0, 3, axis=1).ravel())


def _spheres(film: Film, frame: Frame) -> pyvista.PolyData:
    """Build one point a sphere, which moves with its grain."""
    centers, radii, rows = film.spheres(frame)
    grains = frame.grains[rows]
    first = np.searchsorted(rows, rows)
    levers = centers - frame.positions[rows]
    return poly(centers, {
        "id": grains * film.clumps.shape[1] + np.arange(len(rows)) - first,
        "radius": radii,
        "grain": grains,
        "shape": film.shapes[grains],
        "v": frame.velocities[rows] + np.cross(frame.spins[rows], levers),
        "omega": frame.spins[rows],
    })  # fmt: skip


def _grains(film: Film, frame: Frame) -> pyvista.PolyData:
    """Build one point a grain, at its centre of mass, with the radius of a ball of its volume."""
    contacts, force = frame.contacts, np.zeros((len(film.sizes), 3))
    np.add.at(force, contacts.grains, contacts.forces)
    between = contacts.partners >= 0
    np.add.at(force, contacts.partners[between], -contacts.forces[between])
    return poly(frame.positions, {
        "id": frame.grains,
        "radius": np.cbrt(0.75 / np.pi * film.volumes[frame.grains]),
        "mass": film.masses[frame.grains],
        "shape": film.shapes[frame.grains],
        "orientation": frame.orientations,
        "tensor": _matrices(frame.orientations).reshape(-1, AXES_OF_TENSOR),
        "v": frame.velocities,
        "omega": frame.spins,
        "f": force[frame.grains],
    })  # fmt: skip


def _contacts(frame: Frame) -> pyvista.PolyData:
    """Build one line a contact, from the grain that the force acts on to its partner or the wall."""
    contacts = frame.contacts
    row = np.full(1 + max(frame.grains.max(initial=0), contacts.partners.max(initial=0)), -1)
    row[frame.grains] = np.arange(len(frame.grains))
    is_wall = contacts.walls >= 0
    ends = contacts.points.copy()
    ends[~is_wall] = frame.positions[row[contacts.partners[~is_wall]]]
    points = np.stack([frame.positions[row[contacts.grains]], ends], axis=1).reshape(-1, 3)
    count = len(contacts)
    lines = np.column_stack([np.full(count, 2), np.arange(2 * count).reshape(-1, 2)]).ravel()
    normal = np.einsum("ij,ij->i", contacts.forces, contacts.normals)
    across = contacts.forces - normal[:, None] * contacts.normals
    return poly(points, {}, {
        "id1": contacts.grains,
        "id2": contacts.partners,
        "wall": contacts.walls,
        "force": contacts.forces,
        "normal_force": normal,
        "tangential_force": np.linalg.norm(across, axis=1),
        "point": contacts.points,
    }, lines=lines)  # fmt: skip


def _collection(rows: list[tuple[float, str]]) -> str:
    """Write a collection of ParaView: a file for each time."""
    sets = [f'  <DataSet timestep="{time:.9g}" part="0" file={quoteattr(file)}/>' for time, file in rows]
    head = '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">'
    return "\n".join(
        ['<?xml version="1.0"?>', head, " <Collection>", *sets, " </Collection>", "</VTKFile>", ""]
    )


def _matrices(quaternions: np.ndarray) -> np.ndarray:
    """Return rotation matrices, (n, 3, 3), of unit quaternions x y z w; columns are the body's axes."""
    x, y, z, w = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)
