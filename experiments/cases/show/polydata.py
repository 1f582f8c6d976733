"""Points, lines and triangles as ``.vtp`` files that ParaView and OVITO read; series as ``.vtkhdf`` files.

OVITO reads neither compressed files nor field data, so ``.vtp`` files have none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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


def save_series(times: Sequence[float], data: Sequence[pyvista.PolyData], path: Path) -> None:
    """Write data at some times [s] into one ``.vtkhdf`` file."""
    from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
    from vtkmodules.vtkIOHDF import vtkHDFWriter

    class Series(VTKPythonAlgorithmBase):  # type: ignore[misc]
        """Source of the data, at the time that the writer asks for; VTK names its functions."""

        def RequestInformation(self, _request: Any, _inputs: Any, outputs: Any) -> int:  # noqa: N802
            of_output = outputs.GetInformationObject(0)
            of_output.Set(Pipeline.TIME_STEPS(), list(times), len(times))
            of_output.Set(Pipeline.TIME_RANGE(), [times[0], times[-1]], 2)
            return 1

        def RequestData(self, _request: Any, _inputs: Any, outputs: Any) -> int:  # noqa: N802
            time = outputs.GetInformationObject(0).Get(Pipeline.UPDATE_TIME_STEP())
            self.GetOutputData(outputs, 0).ShallowCopy(data[list(times).index(time or times[0])])
            return 1

    source, writer = Series(nInputPorts=0, nOutputPorts=1, outputType="vtkPolyData"), vtkHDFWriter()
    writer.SetInputConnection(source.GetOutputPort())
    writer.SetWriteAllTimeSteps(True)
    writer.SetChunkSize(max(each.n_points for each in data) + 1)
    writer.SetFileName(str(path))
    if not writer.Write():
        raise OSError(f"VTK cannot write {path}")
