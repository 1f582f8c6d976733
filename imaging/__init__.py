"""Pictures and repose angles: heaps and photographs in, angles with their uncertainty out.

Pictures are OpenCV's: uint8, row 0 at the top, grey or blue-green-red. Lengths are metres, angles of heaps degrees.
"""

from imaging.errors import PictureError
from imaging.repose import (
    FITS,
    FitSettings,
    HeapAngle,
    ReposeAngle,
    compare,
    heap_angle,
    measure,
    measure_photograph,
)

__all__ = [
    "FITS",
    "FitSettings",
    "HeapAngle",
    "PictureError",
    "ReposeAngle",
    "compare",
    "heap_angle",
    "measure",
    "measure_photograph",
]
