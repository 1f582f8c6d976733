"""A heap's outline as a function: its height over the distance from its middle, at places of its own size."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from imaging.errors import PictureError
from imaging.geometry import FloatArray
from imaging.outline import Outline
from imaging.photo.elevation import level_outline

SPACING = 0.2
"""Distance of neighbouring places, over the square root of the outline's area."""

STATIONS = tuple(round(SPACING * number, 1) for number in range(8))
"""Places from the middle on, over the square root of the outline's area: a heap of 27 degrees ends at 1.4."""


def heap_profile(outline: Outline) -> FloatArray:
    """Heights of an outline at `STATIONS`, in its pixels, or in metres where its scale is known.

    The height of the camera is taken out of it.
    """
    scale, level = outline.meters_per_pixel or 1.0, level_outline(outline)
    return profile_heights(level.position * scale, level.height * scale)


def profile_heights(position: ArrayLike, height: ArrayLike, place: str = "outline") -> FloatArray:
    """Heights of an outline at `STATIONS`, each the mean over both flanks and over a width of `SPACING`.

    Distances count from the middle of the outline's area, and their unit is the root of that area: so one
    outline says where its own places are, and grains that rolled far off hardly move them. Beyond the foot
    the height is zero.

    Parameters
    ----------
    position : (n,) array
        Along the plate, increasing.
    height : (n,) array
        Over the plate, in the same unit.
    place : str
        Names the outline in errors.

    Returns
    -------
    (stations,) array
        In the unit of the heights.

    Raises
    ------
    PictureError
        When the outline has no area.
    """
    x, h = np.asarray(position, dtype=np.float64), np.asarray(height, dtype=np.float64)
    below = np.concatenate([[0.0], np.cumsum(0.5 * (h[1:] + h[:-1]) * np.diff(x))])
    if not 0.0 < below[-1] < np.inf:
        raise PictureError(place, "expected an outline has an area", float(below[-1]))
    unit = float(np.sqrt(below[-1]))
    middle = float(np.interp(0.5 * below[-1], below, x))
    inner = (np.array(STATIONS) - 0.5 * SPACING) * unit
    outer = inner + SPACING * unit

    def area_to(distance: FloatArray) -> FloatArray:
        return np.interp(middle + distance, x, below)

    flanks = area_to(outer) - area_to(inner), area_to(-inner) - area_to(-outer)
    return np.asarray(0.5 * (flanks[0] + flanks[1]) / (SPACING * unit))
