"""Geometry of heaps and their pictures: checked spheres, the camera's directions, the picture's frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from imaging.picture_error import PictureError

FloatArray = NDArray[np.float64]
Layer = NDArray[np.floating[Any]]
"""Numbers at the pixels of a picture, in single or double precision."""
Picture = NDArray[np.uint8]
"""A picture as OpenCV holds it: (rows, columns) grey or (rows, columns, 3) blue-green-red, top row first."""

CORE_FRACTION = 0.98
"""Share of the spheres whose distance from the axis gives the scale of a picture; the rest may be strays."""
CORE_MARGIN = 1.1
"""Radius of the heap over that of the core: 98 % of a cone are within 0.92 of its base's radius."""
TALLEST = 20.0
"""Largest height in a picture, in heap radii: a filled tube has some 6."""
FIELD_OF_VIEW = 2.0
"""Largest half width of a picture, in heap radii; spheres farther away are not drawn."""


@dataclass(frozen=True)
class Spheres:
    """Spheres of one heap, checked."""

    centers: FloatArray
    """Centres [m]; z is up and the plate is z = 0, shape (n, 3)."""
    radii: FloatArray
    """Radii [m], shape (n,)."""

    def __post_init__(self) -> None:
        if self.centers.ndim != 2 or self.centers.shape[1] != 3 or len(self.centers) == 0:
            raise PictureError("centers", "must be an (n, 3) array with n > 0", self.centers.shape)
        if self.radii.shape != (len(self.centers),):
            raise PictureError("radii", "must be one for each centre", self.radii.shape)
        bad = ~(np.isfinite(self.centers).all(axis=1) & np.isfinite(self.radii) & (self.radii > 0))
        if bad.any():
            row = int(np.argmax(bad))
            received = (*self.centers[row].tolist(), float(self.radii[row]))
            raise PictureError(f"sphere {row}", "must be finite, with a positive radius", received)

    @classmethod
    def of(cls, centers: ArrayLike, radii: ArrayLike) -> Spheres:
        """Check `centers` (n, 3) and `radii` (n,) or a scalar [m]; raise `PictureError` on a bad one."""
        points = np.asarray(centers, dtype=np.float64)
        sizes = np.asarray(radii, dtype=np.float64)
        return cls(points, np.full(len(points), float(sizes)) if sizes.ndim == 0 and points.ndim else sizes)

    def seen_from(self, azimuth: float) -> FloatArray:
        """Return centres in the camera's frame (n, 3): right, away from the camera, up [m].

        At azimuth 0 the picture's right is +x and the camera looks along +y; azimuth + pi mirrors it.
        """
        cosine, sine = np.cos(azimuth), np.sin(azimuth)
        x, y, z = self.centers.T
        return np.column_stack([x * cosine + y * sine, y * cosine - x * sine, z])


@dataclass(frozen=True)
class Frame:
    """The part of space in pictures of one heap: the same for every azimuth."""

    axis: tuple[float, float]
    """Coordinates x and y of the heap's middle [m]."""
    half_width: float
    height: float
    """Reach of the picture to either side of the axis and above the plate [m]."""
    below: float
    """Reach below the plate [m]."""
    meters_per_pixel: float
    """Scale."""

    @classmethod
    def around(cls, spheres: Spheres, pixels: int, margin: float = 0.08) -> Frame:
        """Frame a heap so that it is about `pixels` wide without strays."""
        if pixels < 16:
            raise PictureError("pixels", "must be at least 16", pixels)
        middle = np.median(spheres.centers[:, :2], axis=0)
        reach = np.hypot(*(spheres.centers[:, :2] - middle).T) + spheres.radii
        heap_radius = CORE_MARGIN * float(np.quantile(reach, CORE_FRACTION))
        half_width = min(float(reach.max()), FIELD_OF_VIEW * heap_radius) * (1.0 + margin)
        kept = reach <= half_width
        top = float((spheres.centers[:, 2] + spheres.radii)[kept].max())
        if not 0.0 < top <= TALLEST * heap_radius:
            problem = f"must rise above the plate z = 0, by at most {TALLEST:g} radii of the heap"
            raise PictureError("centers", problem, f"{top:.4g} m at a radius of {heap_radius:.4g} m")
        return cls(
            axis=(float(middle[0]), float(middle[1])),
            half_width=half_width,
            height=top + margin * heap_radius,
            below=margin * heap_radius,
            meters_per_pixel=2.0 * heap_radius / pixels,
        )

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the picture."""
        rows = self.ground_rows + int(np.ceil(self.below / self.meters_per_pixel))
        return rows, 2 * int(np.ceil(self.half_width / self.meters_per_pixel))

    @property
    def ground_rows(self) -> int:
        """Rows above the plate."""
        return int(np.ceil(self.height / self.meters_per_pixel))

    @property
    def ground_row(self) -> float:
        """Row of the plate's surface; whole numbers are the middles of pixels."""
        return self.ground_rows - 0.5

    def select(self, spheres: Spheres) -> tuple[Spheres, NDArray[np.intp]]:
        """Return the spheres within the frame, moved to an axis at x = y = 0, and their indices."""
        shifted = spheres.centers - np.array([*self.axis, 0.0])
        inside = np.flatnonzero(np.hypot(shifted[:, 0], shifted[:, 1]) + spheres.radii <= self.half_width)
        return Spheres(shifted[inside], spheres.radii[inside]), inside
