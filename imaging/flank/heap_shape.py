"""Shape of a heap's outline: single numbers, and its profile at places that scale with its size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from imaging.flank.camera_height import level_outline
from imaging.flank.fit_settings import FITS
from imaging.flank.flank_line import apex_column, fit_flanks
from imaging.flank.outline import Outline
from imaging.geometry import FloatArray
from imaging.picture_error import PictureError

SPACING = 0.2
"""Distance of neighbouring places, over the square root of the outline's area."""
STATIONS = tuple(round(SPACING * number, 1) for number in range(8))
"""Places from the middle outwards, over the square root of the outline's area: a heap of 27 degrees ends at
1.4."""


@dataclass(frozen=True)
class HeapShape:
    """Shape of an outline; lengths are in the outline's pixels, or in metres where its scale is known."""

    height: float
    """Greatest height."""
    width: float
    """Width from end to end on the plate."""
    r50: float
    r90: float
    """Radius that holds 50 and 90 % of the volume of the outline turned about the apex (the mean of both
    flanks)."""
    concavity: float
    """1 - area / (width * height / 2): 0 for straight flanks, positive for hollow, negative for bulging
    ones."""
    asymmetry: float
    """(area right of the apex - area left of it) / area, -1 to 1."""


@dataclass(frozen=True)
class HeapReadings:
    """Angle of a heap as each usual reading of one outline gives it [degrees]: equal for a cone alone."""

    line_angle: float
    middle_angle: float
    """Mean angle of the lines fitted to both whole flanks, and to their middle, 20 to 80 % of the height."""
    height_angle: float
    """Angle from the toe to the apex: atan(height / half the width)."""
    centre_angle: float
    volume_angle: float
    """Angle of the cone of the same width with the same height of the centre of mass, and with the same
    volume, of the outline turned about the apex."""


def heap_readings(outline: Outline, place: str = "outline") -> HeapReadings:
    """Read the angle of an outline in every usual way, corrected for the camera's height.

    Raises
    ------
    PictureError
        When no line can be fitted to a flank; `place` names the outline.
    """
    level = level_outline(outline)
    h, reach = level.height, 0.5 * _width(level)
    ring = h * np.gradient(level.position) * _from_apex(level)
    volume = np.pi * float(ring.sum())
    center = 0.5 * float((ring * h).sum() / ring.sum())
    tangents = float(h.max()) / reach, 4.0 * center / reach, 3.0 * volume / (np.pi * reach**3)
    flanks = (fit_flanks(level, FITS[fit], place) for fit in ("flank", "middle"))
    lines = (float(np.mean([line.angle for line in sides])) for sides in flanks)
    return HeapReadings(*lines, *map(float, np.degrees(np.arctan(tangents))))


def _width(level: Outline) -> float:
    """Width from end to end, the last column included."""
    return float(np.ptp(level.position) + np.gradient(level.position).mean())


def _from_apex(level: Outline) -> FloatArray:
    """Distance of each column from the apex."""
    x, apex = level.position, apex_column(level.position, level.height)
    return np.abs(x - 0.5 * (x[apex - 1] + x[apex]))


def heap_shape(outline: Outline) -> HeapShape:
    """Measure the shape of an outline (see `find_outline`), corrected for the camera's height."""
    level = level_outline(outline)
    x, h = level.position, level.height
    scale = outline.meters_per_pixel or 1.0
    step = np.gradient(x)
    apex = apex_column(x, h)
    radius = _from_apex(level)
    left, right = float((h * step)[:apex].sum()), float((h * step)[apex:].sum())
    width, height = _width(level), float(h.max())
    r50, r90 = _volume_radii(radius, h * step * radius, (0.5, 0.9))
    return HeapShape(
        height=height * scale,
        width=width * scale,
        r50=r50 * scale,
        r90=r90 * scale,
        concavity=1.0 - (left + right) / (0.5 * width * height),
        asymmetry=(right - left) / (right + left),
    )


def _volume_radii(radius: FloatArray, ring_volume: FloatArray, shares: tuple[float, ...]) -> list[float]:
    """Radii within which the given shares of the summed ring volumes are."""
    order = np.argsort(radius)
    volume = np.cumsum(ring_volume[order])
    return [float(np.interp(share * volume[-1], volume, radius[order])) for share in shares]


def heap_profile(outline: Outline) -> FloatArray:
    """Heights of an outline at `STATIONS`, corrected for the camera's height; unit as in `HeapShape`."""
    scale, level = outline.meters_per_pixel or 1.0, level_outline(outline)
    return profile_heights(level.position * scale, level.height * scale)


def profile_heights(position: ArrayLike, height: ArrayLike, place: str = "outline") -> FloatArray:
    """Heights of an outline at `STATIONS`, each the mean over both flanks and over a width of `SPACING`.

    Distances are measured from the middle of the outline's area, in units of the root of that area, so that
    grains that rolled far away hardly change them. Beyond the foot the height is zero.

    Parameters
    ----------
    position : (n,) array
        Positions along the plate, increasing.
    height : (n,) array
        Heights over the plate, in the same unit.
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
        raise PictureError(place, "the area of the outline must be positive", float(below[-1]))
    unit = float(np.sqrt(below[-1]))
    middle = float(np.interp(0.5 * below[-1], below, x))
    inner = (np.array(STATIONS) - 0.5 * SPACING) * unit
    outer = inner + SPACING * unit

    def area_to(distance: FloatArray) -> FloatArray:
        return np.interp(middle + distance, x, below)

    flanks = area_to(outer) - area_to(inner), area_to(-inner) - area_to(-outer)
    return np.asarray(0.5 * (flanks[0] + flanks[1]) / (SPACING * unit))
