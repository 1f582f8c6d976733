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
    lowest, first, resting = _layer(spheres)
    if resting < LEAST_RESTING:
        problem = f"at least {LEAST_RESTING} spheres must rest on it: give its height"
        raise PictureError("plate", problem, f"{resting} at one height")
    return float(np.median(lowest[first : first + resting]))


def height_axis(spheres: Spheres) -> str:
    """Return the axis of a heap's height: ``z``, or e.g. ``-x`` where there alone a plate is below it."""
    for name in ("z", "y", "-z", "x", "-y", "-x"):
        lowest, first, resting = _layer(seen_upright(spheres, name))
        heap = lowest[first:] - lowest[first]
        is_heap = name == "z" or (resting >= LEAST_RESTING and np.median(heap) < SKEW * heap[-1])
        if is_heap and first <= FALLEN * len(lowest):
            return name
    return "z"


def seen_upright(spheres: Spheres, axis: str) -> Spheres:
    """Turn spheres so that an axis of `height_axis` is z."""
    up = "xyz".index(axis[-1])
    kept = np.roll(spheres.centers, 2 - up, axis=1)
    return Spheres(kept[:, [1, 0, 2]] * [1.0, 1.0, -1.0] if axis.startswith("-") else kept, spheres.radii)


def _layer(spheres: Spheres) -> tuple[FloatArray, int, int]:
    """Return the sorted lowest points, the first at the plate, and how many rest there."""
    lowest = np.sort(spheres.centers[:, 2] - spheres.radii)
    layer = REST * float(np.median(spheres.radii))
    resting = np.searchsorted(lowest, lowest + layer, side="right") - np.arange(len(lowest))
    first = int(np.argmax(resting))
    return lowest, first, int(resting[first])
