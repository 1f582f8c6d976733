"""The plate of a heap of spheres whose height nobody told."""

from __future__ import annotations

import numpy as np

from imaging.errors import PictureError
from imaging.geometry import Spheres

REST = 0.02
"""Depth of the layer in which spheres that rest on a plate have their lowest points, over the median radius:
soft grains sink in by a hundredth or two, and a second layer starts half a radius higher."""
LEAST_RESTING = 5
"""Fewer spheres do not show where the plate is."""


def find_ground(spheres: Spheres) -> float:
    """Find the plate on which most spheres rest: the height at which the lowest points of spheres crowd.

    Spheres that fell off the plate lie below and do not count, nor do those that lie on others.

    Parameters
    ----------
    spheres : Spheres
        Spheres in any unit, z up.

    Returns
    -------
    float
        Height of the plate, in the same unit.

    Raises
    ------
    PictureError
        When no height has `LEAST_RESTING` spheres on it.
    """
    lowest = np.sort(spheres.centers[:, 2] - spheres.radii)
    layer = REST * float(np.median(spheres.radii))
    resting = np.searchsorted(lowest, lowest + layer, side="right") - np.arange(len(lowest))
    first = int(np.argmax(resting))
    if resting[first] < LEAST_RESTING:
        rule = f"expected at least {LEAST_RESTING} spheres rest on the plate: give its height"
        raise PictureError("plate", rule, f"{resting[first]} at one height")
    return float(np.median(lowest[first : first + resting[first]]))
