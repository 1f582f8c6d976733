"""VTK files with a point for each sphere, from LIGGGHTS, Yade, ParaView and dem-warp (``heap.vtp``).

VTKHDF is the particle file of ON-DEM, the network of DEM codes (COST action CA22132).
"""

from __future__ import annotations

import mmap
import re
from pathlib import Path
from typing import Any

import numpy as np

from experiments.grains.spheres.sphere_file import MANY, MOST, TYPES, Columns, Format, SphereFile, spheres_of
from experiments.io.errors import InputError

RADII, DIAMETERS = ("radius", "radii", "r"), ("diameter",)
BODIES = ("grain", "id_multisphere", "clumpid", "clump_id", "mol")
"""Names of arrays, in lower case."""
_ENDINGS = {
    "PolyData": ".vtp", "UnstructuredGrid": ".vtu",
    "PPolyData": ".pvtp", "PUnstructuredGrid": ".pvtu", "Collection": ".pvd",
}  # fmt: skip
_COUNT = re.compile(rb'\b(?:NumberOf\w+|POINTS)[\s="]+(\d+)')
_PART, _TIME = re.compile(rb'\bSource="([^"]+)"'), re.compile(rb'\bfile="([^"]+)"')
"""Counts in a file, and the files of a whole in parts or of times, of which the last is read."""
HDF, _HDF_ENDING = "\x89HDF", ".hdf"
"""First bytes of an HDF5 file; of these, VTK's have the group VTKHDF."""
_HDF_KINDS = ("PolyData", "UnstructuredGrid")
_PARTS = ("PartitionedDataSet", "PartitionedDataSetCollection", "MultiBlockDataSet")
"""Kinds of data in parts, which are read together."""


def _read(path: Path) -> SphereFile:
    # PyVista is slow to import, and missing on some machines that only calibrate.
    import pyvista

    ending = _ending(path)
    _check_counts(path)
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
    body = next((name for name in BODIES if name in values), None)
    kind = next((name for name in values if name.replace("_", "") in TYPES), None)
    further = [np.ravel(values[name])[: len(points)] for name in (body, kind) if name is not None]
    rows = enumerate(row.astype(str).tolist() for row in np.column_stack([table, *further]))
    at = [None if name is None else 4 for name in (body, kind)]
    columns = Columns(0, 1, 2, 3, size in DIAMETERS, at[0], at[1] if body is None else at[1] and 5)
    return spheres_of(f"VTK file, radii from the array {arrays[size]}", rows, columns, path, kind="point")


def _last_grid(reader: Any) -> Any:
    """Read a grid; of a collection of times the last one, all of its parts."""
    import pyvista

    times = getattr(reader, "number_time_points", 0)
    if times:
        reader.set_active_time_point(times - 1)
    elif hasattr(reader.reader, "SetStep"):  # VTKHDF
        reader.reader.UpdateInformation()
        reader.reader.SetStep(max(reader.reader.GetNumberOfSteps() - 1, 0))
    grid = reader.read()
    if hasattr(grid, "n_partitions"):
        grid = pyvista.MultiBlock(list(grid))
    return grid.combine() if hasattr(grid, "combine") else grid


def _ending(path: Path) -> str:
    """Return the right ending of a VTK file, by its content."""
    with path.open("rb") as file:
        head = file.read(4096).decode("latin-1")
    if head.startswith(HDF):
        _check_hdf(path)
        return _HDF_ENDING
    if head.startswith("# vtk DataFile"):
        return ".vtk"
    match = re.search(r'<VTKFile[^>]*\btype="(\w+)"', head)
    kind = match[1] if match else "unknown"
    if kind not in _ENDINGS:
        raise InputError(str(path), f"the type of the VTK file must be {' or '.join(_ENDINGS)}", kind)
    return _ENDINGS[kind]


def _check_counts(path: Path) -> None:
    """Refuse a file that says it has too many points or cells, before VTK makes room for them."""
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        most = max(map(int, _COUNT.findall(content)), default=0)
        parts = _PART.findall(content) or _TIME.findall(content)[-1:]
    if most > MOST:
        raise InputError(str(path), f"must have at most {MOST:,} spheres", f"{most:,}", MANY)
    for part in parts:
        if (other := path.parent / part.decode("utf-8", errors="replace")).is_file():
            _check_counts(other)


def _check_hdf(path: Path) -> None:
    from vtkmodules.vtkIOHDF import vtkHDFReader

    reader = vtkHDFReader()
    if not reader.CanReadFile(str(path)):
        raise InputError(str(path), "the VTKHDF file is cut off or damaged")
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    kind = reader.GetOutputDataObject(0).GetClassName().removeprefix("vtk")
    if kind not in (*_HDF_KINDS, *_PARTS):
        problem = f"the type of the VTKHDF file must be {' or '.join(_HDF_KINDS)}, whole or in parts"
        raise InputError(str(path), problem, kind, "Write a point for each sphere.")


def _recognises(head: str) -> bool:
    is_hdf = head.startswith(HDF) and "VTKHDF" in head
    return is_hdf or head.startswith("# vtk DataFile") or "<VTKFile" in head[:4096]


VTK = Format("VTK file", _recognises, _read)
