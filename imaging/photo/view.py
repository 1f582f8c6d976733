"""Facts that a person gives of a photograph: the part to look at, plate, heap, the camera's height."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from imaging.errors import PictureError

LEAST_DISTANCE = 1.0
"""Distance [heap widths] below which a camera sees no heap whole."""
USUAL_DISTANCE = 10.0
"""Distance [heap widths] that is assumed: its effect lies in the middle of those from `NEAR` to far away."""
NEAR = 4.0
"""Smallest distance [heap widths] that is usual."""
BASE_POINTS = 721
"""Points of half the base's circle."""
LEVEL_ROUNDS = 16
"""Rounds of bringing the seen angle and the cone's to agree; two or three gain a digit."""


@dataclass(frozen=True)
class View:
    """Facts known of a photograph beforehand."""

    crop: tuple[int, int, int, int] | None = None
    """Left, top, right and bottom of the part to look at [pixels of the upright picture]."""
    plate: tuple[float, float, float, float] | None = None
    """X1, y1, x2, y2 of two points on the line at which the heap meets its plate [pixels]."""
    heap: int | None = None
    """Which heap of several, counted from the left, from 1."""
    elevation: float | None = None
    """Angle at which the camera looks down on the plate [degrees]; left out, it is seen from the foot."""
    distance: float | None = None
    """From the camera to the heap, in widths of the heap; left out, it follows from the focal length."""
    focal_length: float | None = None
    """Of the camera [pixels]; left out, the camera was far away."""

    def __post_init__(self) -> None:
        if self.crop is not None and not (
            0 <= self.crop[0] < self.crop[2] and 0 <= self.crop[1] < self.crop[3]
        ):
            raise PictureError("crop", "expected left < right and top < bottom, from 0 on", self.crop)
        if self.plate is not None and not self.plate[0] < self.plate[2]:
            raise PictureError("plate", "expected x1 < x2: the plate's line from left to right", self.plate)
        if self.heap is not None and self.heap < 1:
            raise PictureError("heap", "expected heaps are counted from 1", self.heap)
        if self.elevation is not None and not 0.0 <= self.elevation < 45.0:
            raise PictureError("elevation", "expected 0 <= elevation < 45 degrees", self.elevation)
        if self.distance is not None and not self.distance > LEAST_DISTANCE:
            raise PictureError(
                "distance", "expected the camera is more than one heap width away", self.distance
            )

    def distance_of(self, width: float) -> float | None:
        """Distance [heap widths] from the camera to a heap of this width [pixels], if it is known."""
        if self.distance is None and self.focal_length is not None and width > 0.0:
            return max(self.focal_length / width, LEAST_DISTANCE)
        return self.distance

    def inside(self, shape: tuple[int, ...], place: str) -> tuple[slice, slice]:
        """Rows and columns of the part to look at, in a picture of this shape.

        Raises
        ------
        PictureError
            When the part reaches beyond the picture.
        """
        left, top, right, bottom = self.crop or (0, 0, shape[1], shape[0])
        if right > shape[1] or bottom > shape[0]:
            rule = f"expected the crop lies in the picture of {shape[1]} x {shape[0]} pixels"
            raise PictureError(place, rule, (left, top, right, bottom))
        return slice(top, bottom), slice(left, right)


def seen_angle(angle: float, elevation: float, distance: float) -> float:
    """Angle at which a camera sees the outline of a cone [degrees].

    The outline is the pair of tangents from the tip to the ellipse that the base's circle is seen as. From
    afar, with the height h and the base's radius r, they go from h cos e to half axes r and r sin e, so that
    tan(seen)^2 = tan(angle)^2 cos(e)^2 - sin(e)^2. From nearby the tip, closer to a camera that looks down
    than the foot behind it, takes back part of that.

    Parameters
    ----------
    angle : float
        Of the cone [degrees].
    elevation : float
        At which the camera looks down on the plate [degrees].
    distance : float
        From the camera to the cone's axis, in widths of its base; may be infinite.
    """
    turn, slope = np.radians(elevation), np.tan(np.radians(angle))
    around = np.linspace(-0.5 * np.pi, 0.5 * np.pi, BASE_POINTS)
    x, y = np.cos(around), np.sin(around)
    nearness = 0.5 * np.cos(turn) / distance
    depth = 1.0 + nearness * y * np.cos(turn)
    tip_depth = 1.0 - nearness * slope * np.sin(turn)
    across, up = x / depth, y * np.sin(turn) / depth
    drop = slope * np.cos(turn) / tip_depth - up
    outer = across > 0.2
    return float(np.degrees(np.arctan((drop[outer] / across[outer]).min())))


def level_angle(seen: float, elevation: float, distance: float | None = None) -> float:
    """Angle of a cone [degrees] whose outline a camera sees as `seen`: undoes `seen_angle`.

    Parameters
    ----------
    seen, elevation : float
        As there [degrees].
    distance : float, optional
        As there; left out, a level camera is far away, and another at `USUAL_DISTANCE`.
    """
    if distance is None and elevation == 0.0:
        return seen
    angle = seen
    for _ in range(LEVEL_ROUNDS):
        angle = min(max(angle + seen - seen_angle(angle, elevation, distance or USUAL_DISTANCE), 0.1), 89.0)
    return angle


def level_error(seen: float, elevation: float, error: float, distance: float | None) -> float:
    """Standard error [degrees] that an elevation's own one, and an unknown distance, give to an angle."""
    if elevation == 0.0:
        return 0.0
    higher = level_angle(seen, elevation + error, distance) - level_angle(seen, elevation, distance)
    if distance is not None:
        return abs(higher)
    reach = level_angle(seen, elevation, math.inf) - level_angle(seen, elevation, NEAR)
    return float(np.hypot(higher, 0.5 * reach))
