"""What a person can say of a photograph: the part to look at, the plate, the heap, the camera's height."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from imaging.errors import PictureError
from imaging.geometry import FloatArray


@dataclass(frozen=True)
class View:
    """What is known of a photograph beforehand.

    Attributes
    ----------
    crop : (int, int, int, int), optional
        Left, top, right and bottom of the part to look at [pixels of the upright picture].
    plate : (float, float, float, float), optional
        x1, y1, x2, y2 of two points on the line at which the heap meets its plate [pixels].
    heap : int, optional
        Which heap of several, counted from the left, from 1.
    elevation : float, optional
        Angle at which the camera looks down on the plate [degrees]; left out, it is seen from the foot.
    """

    crop: tuple[int, int, int, int] | None = None
    plate: tuple[float, float, float, float] | None = None
    heap: int | None = None
    elevation: float | None = None

    def __post_init__(self) -> None:
        if self.crop is not None and not (0 <= self.crop[0] < self.crop[2] and 0 <= self.crop[1] < self.crop[3]):
            raise PictureError("left < right and top < bottom, from 0 on", self.crop, "crop")
        if self.plate is not None and not self.plate[0] < self.plate[2]:
            raise PictureError("x1 < x2: the plate's line from left to right", self.plate, "plate")
        if self.heap is not None and self.heap < 1:
            raise PictureError("heaps are counted from 1", self.heap, "heap")
        if self.elevation is not None and not 0.0 <= self.elevation < 45.0:
            raise PictureError("0 <= elevation < 45 degrees", self.elevation, "elevation")

    def inside(self, shape: tuple[int, ...], place: str) -> tuple[slice, slice]:
        """Rows and columns of the part to look at, in a picture of this shape.

        Raises
        ------
        PictureError
            When the part reaches beyond the picture.
        """
        left, top, right, bottom = self.crop or (0, 0, shape[1], shape[0])
        if right > shape[1] or bottom > shape[0]:
            rule = f"the crop lies in the picture of {shape[1]} x {shape[0]} pixels"
            raise PictureError(rule, (left, top, right, bottom), place)
        return slice(top, bottom), slice(left, right)


def level_angle(seen: float, elevation: float) -> float:
    """Angle of a cone [degrees] that a camera looking down by `elevation` [degrees] sees as `seen`.

    The outline of a cone of height h and base radius r seen from afar at the elevation e is the pair of
    tangents from the tip, h cos e high, to an ellipse of half axes r and r sin e, so that
    tan(seen)^2 = tan(angle)^2 cos(e)^2 - sin(e)^2.
    """
    if elevation == 0.0:
        return seen
    turn = np.radians(elevation)
    slope = np.hypot(np.tan(np.radians(seen)), np.sin(turn)) / np.cos(turn)
    return float(np.degrees(np.arctan(slope)))


def arc(columns: FloatArray, ends: tuple[float, float]) -> FloatArray:
    """Lower half of an ellipse of half axis 1 upright and these ends, 0 at the ends."""
    middle, half = 0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0])
    return np.asarray(np.sqrt(np.clip(1.0 - ((columns - middle) / half) ** 2, 0.0, None)))
