"""VTK files with a point for each sphere, from LIGGGHTS, Yade, ParaView and dem-warp (``heap.vtp``)."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from experiments.grains.spheres.sphere_file import Columns, Format, SphereFile, own_bodies, spheres_of
from experiments.io.errors import InputError

RADII, DIAMETERS = ("radius", "radii", "r"), ("diameter",)
BODIES = ("grain", "id_multisphere", "clumpid", "clump_id", "mol")
"""Names of arrays, in lower case."""
_ENDINGS = {
    "PolyData": ".vtp", "UnstructuredGrid": ".vtu",
    "PPolyData": ".pvtp", "PUnstructuredGrid": ".pvtu", "Collection": ".pvd",
}  # fmt: skip


def _read(path: Path) -> SphereFile:
    # PyVista is slow to import, and missing on some machines that only calibrate.
    import pyvista

    ending = _ending(path)
    try:
        with pyvista.vtk_verbosity("off"):
            grid = _last_grid(pyvista.get_reader(str(path), force_ext=ending))
            points, arrays = np.asarray(grid.points), {n.lower(): n for n in grid.point_data}
            values = {low: np.asarray(grid.point_data[name]) for low, name in arrays.items()}
    except Exception as error:  # VTK's readers raise any class
        raise InputError(str(path), f"PyVista cannot read the VTK file: {error}") from None
    if not len(points):
        raise InputError(str(path), "the VTK file has no points")
    size = next((name for name in (*RADII, *DIAMETERS) if name in values), None)
    if size is None:
        named = ", ".join(arrays.values()) or "none"
        raise InputError(str(path), f"the points need an array radius (or radii, diameter), not only {named}")
    table = np.column_stack([points, np.ravel(values[size])[: len(points)]]).astype(np.float64)
    rows = ((n, [repr(float(value)) for value in row]) for n, row in enumerate(table))
    spheres, _ = spheres_of(rows, Columns(0, 1, 2, 3, size in DIAMETERS), path, kind="point")
    body = next((name for name in BODIES if name in values), None)
    bodies = None if body is None else own_bodies(values[body].astype(np.float64))
    return SphereFile(f"VTK file, radii from the array {arrays[size]}", spheres, bodies)


def _last_grid(reader: Any) -> Any:
    """Read a grid; of a collection of times the last one, all of its parts."""
    times = getattr(reader, "number_time_points", 0)
    if times:
        reader.set_active_time_point(times - 1)
    grid = reader.read()
    return grid.combine() if hasattr(grid, "combine") else grid


def _ending(path: Path) -> str:
    """Return the right ending of a VTK file, by its content."""
    with path.open("rb") as file:
        head = file.read(4096).decode("latin-1")
    if head.startswith("# vtk DataFile"):
        return ".vtk"
    match = re.search(r'<VTKFile[^>]*\btype="(\w+)"', head)
    kind = match[1] if match else "unknown"
    if kind not in _ENDINGS:
        raise InputError(str(path), f"the type of the VTK file must be {' or '.join(_ENDINGS)}", kind)
    return _ENDINGS[kind]


VTK = Format("VTK file", lambda head: head.startswith("# vtk DataFile") or "<VTKFile" in head[:4096], _read)
