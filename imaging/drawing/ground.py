"""Height of the plate under a heap of spheres."""

from __future__ import annotations

import numpy as np

from imaging.geometry import Spheres
from imaging.picture_error import PictureError

REST = 0.02
"""Thickness of the layer with the lowest points of spheres on a plate, over the median radius: soft grains
sink in by a hundredth or two, and a second layer starts half a radius higher."""
LEAST_RESTING = 5
"""Fewest spheres that show a plate."""


def find_ground(spheres: Spheres) -> float:
    """Find the height of the plate on which most spheres rest, in the unit of the spheres.

    Spheres that fell off the plate, and those on other spheres, do not count.
    """
    lowest = np.sort(spheres.centers[:, 2] - spheres.radii)
    layer = REST * float(np.median(spheres.radii))
    resting = np.searchsorted(lowest, lowest + layer, side="right") - np.arange(len(lowest))
    first = int(np.argmax(resting))
    if resting[first] < LEAST_RESTING:
        problem = f"at least {LEAST_RESTING} spheres must rest on it: give its height"
        raise PictureError("plate", problem, f"{resting[first]} at one height")
    return float(np.median(lowest[first : first + resting[first]]))
