"""Pictures and repose angles: heaps and photographs in, angles with their uncertainty out.

Pictures are OpenCV's: uint8, row 0 at the top, grey or blue-green-red. Angles of heaps are in degrees,
directions of cameras in radians, lengths in metres or, where said so, in pixels.
"""

from imaging.errors import PictureError
from imaging.finding import find_outline
from imaging.flanks import FITS, FitSettings
from imaging.heap import HeapAngle, HeapOutlines, heap_angle, heap_outlines
from imaging.outline import Outline
from imaging.overlay import overlay
from imaging.pictures import read_picture, save_picture
from imaging.reasons import Doubt
from imaging.render import Snapshot, silhouette, snapshot
from imaging.repose import AngleDifference, ReposeAngle, compare, measure, measure_photograph
from imaging.shape import HeapShape, heap_shape
from imaging.view import View

__all__ = [
    "FITS",
    "AngleDifference",
    "Doubt",
    "FitSettings",
    "HeapAngle",
    "HeapOutlines",
    "HeapShape",
    "Outline",
    "PictureError",
    "ReposeAngle",
    "Snapshot",
    "View",
    "compare",
    "find_outline",
    "heap_angle",
    "heap_outlines",
    "heap_shape",
    "measure",
    "measure_photograph",
    "overlay",
    "read_picture",
    "save_picture",
    "silhouette",
    "snapshot",
]
