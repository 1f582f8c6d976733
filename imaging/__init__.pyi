"""The public names: each is loaded with its module when it is first used."""

from .drawing.angle_overlay import overlay, overlay_drum
from .drawing.render import Snapshot, silhouette, snapshot
from .drawing.simulated_heap import HeapAngle, HeapOutlines, heap_angle, heap_outlines
from .drum.drum_reading import DrumReading, read_drum
from .flank.fit_settings import FITS, FitSettings
from .flank.heap_shape import (
    HeapReadings,
    HeapShape,
    heap_profile,
    heap_readings,
    heap_shape,
    profile_heights,
)
from .flank.outline import Doubt, Outline
from .photo.outline_finder import find_outline
from .photo.picture_file import read_picture, save_picture
from .photo.view_settings import View
from .picture_error import PictureError
from .repose import AngleDifference, ReposeAngle, compare, measure, measure_photograph

__all__ = [
    "FITS",
    "AngleDifference",
    "Doubt",
    "DrumReading",
    "FitSettings",
    "HeapAngle",
    "HeapOutlines",
    "HeapReadings",
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
    "heap_profile",
    "heap_readings",
    "heap_shape",
    "measure",
    "measure_photograph",
    "overlay",
    "overlay_drum",
    "profile_heights",
    "read_drum",
    "read_picture",
    "save_picture",
    "silhouette",
    "snapshot",
]
