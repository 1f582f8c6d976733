"""Pictures of a heap of spheres: plain silhouettes to measure, shaded snapshots to look at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from imaging import raster
from imaging.errors import PictureError
from imaging.geometry import Frame, Picture, Spheres


@dataclass(frozen=True)
class Snapshot:
    """A picture of a heap, with its scale.

    Attributes
    ----------
    image : (rows, columns) or (rows, columns, 3) uint8 array
        Grey or blue-green-red.
    meters_per_pixel : float
        Scale.
    ground_row : float
        Row of the plate's surface, in the middle of a pixel where it is whole.
    azimuth : float
        Direction of the camera [rad]; at 0 the picture's right is +x and the camera looks along +y.
    """

    image: Picture
    meters_per_pixel: float
    ground_row: float
    azimuth: float


def silhouette(
    centers: ArrayLike,
    radii: ArrayLike,
    azimuth: float = 0.0,
    pixels: int = 800,
    backend: str = "raster",
    frame: Frame | None = None,
) -> Snapshot:
    """Draw the black silhouette of a heap on white, without the plate, for measuring."""
    spheres = Spheres.of(centers, radii)
    frame = frame or Frame.around(spheres, pixels)
    shown, _ = frame.select(spheres)
    image = np.uint8(255) - raster.coverage(shown, frame, azimuth)
    return Snapshot(image, frame.meters_per_pixel, frame.ground_rows - 0.5, azimuth)
