"""Height of the plate under a heap of spheres."""

from __future__ import annotations

import numpy as np

from imaging.geometry import FloatArray, Spheres
from imaging.picture_error import PictureError

REST = 0.02
"""Thickness of the layer with the lowest points of spheres on a plate, over the median radius: soft grains
sink in by a hundredth or two, and a second layer starts half a radius higher."""
LEAST_RESTING = 5
"""Fewest spheres that show a plate."""


FALLEN, SKEW = 0.1, 0.4
"""Largest share of spheres that fell off a plate, where another axis could be the height, and greatest median
height of a heap, over its own: a cone's is 0.2, and 0.5 along its other axes."""


def find_ground(spheres: Spheres) -> float:
    """Find the height of the plate on which most spheres rest, in the unit of the spheres.

    Spheres that fell off the plate, and those on other spheres, do not count.
    """
    lowest, first, resting = _layer(spheres, 2)
    if resting < LEAST_RESTING:
        problem = f"at least {LEAST_RESTING} spheres must rest on it: give its height"
        raise PictureError("plate", problem, f"{resting} at one height")
    return float(np.median(lowest[first : first + resting]))


def height_is_along_y(spheres: Spheres) -> bool:
    """Return whether a plate is below the spheres along y, and none is below them along z."""
    (lowest, below_y, resting), (_, below_z, _) = (_layer(spheres, axis) for axis in (1, 2))
    heap = lowest[below_y:] - lowest[below_y]
    is_skew = float(np.median(heap)) < SKEW * float(heap[-1])
    return is_skew and resting >= LEAST_RESTING and below_y < FALLEN * len(lowest) < below_z


def _layer(spheres: Spheres, axis: int) -> tuple[FloatArray, int, int]:
    """Return the sorted lowest points along an axis, the first at the plate, and how many rest there."""
    lowest = np.sort(spheres.centers[:, axis] - spheres.radii)
    layer = REST * float(np.median(spheres.radii))
    resting = np.searchsorted(lowest, lowest + layer, side="right") - np.arange(len(lowest))
    first = int(np.argmax(resting))
    return lowest, first, int(resting[first])
