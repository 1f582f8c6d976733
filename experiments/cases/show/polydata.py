"""Points, lines and triangles as ``.vtp`` files that ParaView and OVITO read.

OVITO reads neither compressed files nor field data, so these files have none.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pyvista


def poly(
    points: np.ndarray,
    of_points: Mapping[str, np.ndarray] | None = None,
    of_cells: Mapping[str, np.ndarray] | None = None,
    **cells: Any,
) -> pyvista.PolyData:
    """Build points [m], with their arrays and those of their cells; without cells, each is a vertex.

    Numbers are kept in single precision, counts as 32-bit integers.
    """
    # PyVista is slow to import, and missing on some machines that only calibrate
    import pyvista
    from vtkmodules.util.numpy_support import numpy_to_vtk

    data = pyvista.PolyData(points.astype(np.float32), **cells) if len(points) else pyvista.PolyData()
    for held, arrays in ((data.GetPointData(), of_points), (data.GetCellData(), of_cells)):
        for name, values in (arrays or {}).items():
            # data without points have the arrays, too, which PyVista refuses
            kind = np.float32 if values.dtype.kind == "f" else np.int32
            array = numpy_to_vtk(np.ascontiguousarray(values, dtype=kind), deep=True)
            array.SetName(name)
            held.AddArray(array)
    return data


def save(data: pyvista.PolyData, path: Path) -> None:
    """Write a ``.vtp`` file."""
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    writer = vtkXMLPolyDataWriter()
    # Python writes the file: it knows every name that the system has
    writer.WriteToOutputStringOn()
    writer.SetInputData(data)
    writer.SetCompressorTypeToNone()
    writer.SetDataModeToBinary()
    writer.Write()
    path.write_text(writer.GetOutputString(), encoding="utf-8", newline="\n")
