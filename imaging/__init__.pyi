"""The public names: each is loaded with its module when it is first used."""

from .drawing.heap import HeapAngle, HeapOutlines, heap_angle, heap_outlines
from .drawing.overlay import overlay
from .drawing.render import Snapshot, silhouette, snapshot
from .errors import PictureError
from .fits import FITS, FitSettings
from .outline import Outline
from .photo.finding import find_outline
from .photo.view import View
from .pictures import read_picture, save_picture
from .profile import heap_profile, profile_heights
from .reasons import Doubt
from .repose import AngleDifference, ReposeAngle, compare, measure, measure_photograph
from .shape import HeapShape, heap_shape

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
    "heap_profile",
    "heap_shape",
    "measure",
    "measure_photograph",
    "overlay",
    "profile_heights",
    "read_picture",
    "save_picture",
    "silhouette",
    "snapshot",
]
