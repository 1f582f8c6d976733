"""Known facts of a photograph: the part to look at, the plate, the heap, the camera's height."""

from __future__ import annotations

from dataclasses import dataclass

from imaging.picture_error import PictureError

LEAST_DISTANCE = 1.0
"""Distance [heap widths] below which a camera does not see the whole heap."""


@dataclass(frozen=True)
class View:
    """Known facts of a photograph."""

    crop: tuple[int, int, int, int] | None = None
    """Left, top, right and bottom of the part to look at [pixels of the upright picture]."""
    plate: tuple[float, float, float, float] | None = None
    """X1, y1, x2, y2 of two points on the line at which the heap meets its plate [pixels]."""
    heap: int | None = None
    """Number of the heap, counted from the left from 1, where there are several."""
    elevation: float | None = None
    """Angle at which the camera looks down on the plate [degrees]; default: measured at the heap's foot."""
    distance: float | None = None
    """Distance of the camera from the heap, in widths of the heap; default: from the focal length."""
    focal_length: float | None = None
    """Focal length of the camera [pixels]; default: the camera was far away."""
    least_focal_length: float | None = None
    """Least focal length that the camera may have, where its own is unknown [pixels]; default: see there."""
    circle: tuple[float, float, float] | None = None
    """Column, row and radius of the inner edge of a drum, instead of a heap's facts [pixels]."""

    def __post_init__(self) -> None:
        if self.crop is not None and not (
            0 <= self.crop[0] < self.crop[2] and 0 <= self.crop[1] < self.crop[3]
        ):
            raise PictureError("crop", "must have 0 <= left < right and 0 <= top < bottom", self.crop)
        if self.circle is not None and not self.circle[2] > 0.0:
            raise PictureError("circle", "must have a positive radius", self.circle)
        if self.plate is not None and not self.plate[0] < self.plate[2]:
            raise PictureError("plate", "must have x1 < x2: a line from left to right", self.plate)
        if self.heap is not None and self.heap < 1:
            raise PictureError("heap", "must be 1 or more", self.heap)
        if self.elevation is not None and not 0.0 <= self.elevation < 45.0:
            raise PictureError("elevation", "must be at least 0 and below 45 degrees", self.elevation)
        if self.distance is not None and not self.distance > LEAST_DISTANCE:
            raise PictureError("distance", "must be more than one heap width", self.distance)

    def distance_of(self, width: float) -> float | None:
        """Return the distance [heap widths] to a heap of this width [pixels]; None where it is unknown."""
        if self.distance is None and self.focal_length is not None and width > 0.0:
            return max(self.focal_length / width, LEAST_DISTANCE)
        return self.distance

    def nearest_of(self, width: float) -> float | None:
        """Return the least distance [heap widths] to a heap of this width [pixels]; None if unknown."""
        known = self.least_focal_length is None or self.distance_of(width) is not None
        return None if known else max((self.least_focal_length or 0.0) / width, LEAST_DISTANCE)

    def inside(self, shape: tuple[int, ...], place: str) -> tuple[slice, slice]:
        """Return rows and columns of the part to look at; raise `PictureError` if it is outside."""
        left, top, right, bottom = self.crop or (0, 0, shape[1], shape[0])
        if right > shape[1] or bottom > shape[0]:
            problem = f"the crop must be within the {shape[1]} x {shape[0]} pixels of the picture"
            raise PictureError(place, problem, (left, top, right, bottom))
        return slice(top, bottom), slice(left, right)
