"""The public names: each is loaded with its module when it is first used."""

from .errors import PictureError
from .finding import find_outline
from .fits import FITS, FitSettings
from .heap import HeapAngle, HeapOutlines, heap_angle, heap_outlines
from .outline import Outline
from .overlay import overlay
from .pictures import read_picture, save_picture
from .profile import heap_profile, profile_heights
from .reasons import Doubt
from .render import Snapshot, silhouette, snapshot
from .repose import AngleDifference, ReposeAngle, compare, measure, measure_photograph
from .shape import HeapShape, heap_shape
from .view import View

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
