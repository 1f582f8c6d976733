"""A heap found in a picture, and what is around its foot: a dish, a board, a shadow."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from imaging.flank.outline import Doubt
from imaging.flank.plate_line import PLATE_CLEARANCE, PlateLine
from imaging.geometry import FloatArray, Layer
from imaging.photo.background import Contrast, unshaded
from imaging.picture_error import PictureError

DEEP_FOOT = 0.05
"""Depth of a foot over its width (a camera 6 degrees up) above which its colour is checked."""
LEAST_WIDTH = 100.0
"""Least width [pixels] of a heap whose base is checked: a blurred edge is as wide as the strips."""
NARROW_BASE = "the heap must be on a plate wider than itself"
SIDE_NOISE, SIDE_DIFFERENCE = 6.0, 24.0
"""Multiple of the wall's noise, and difference [of 255], above which two sides differ: twice a cloth's."""
FADED = 0.7
"""Darkness a tenth of a heap's width below its foot over that at its foot: a shadow has less (good heaps seen
from above up to 0.65), a dish 1."""


@dataclass(frozen=True)
class FoundHeap:
    """A heap found in a picture."""

    rows: FloatArray
    """Upper edge of the heap; NaN outside, shape (columns,)."""
    plate: PlateLine
    elevation: float
    elevation_se: float
    """Angle at which the camera looks down, and its standard error [degrees]."""
    doubts: tuple[Doubt, ...]
    depth: float = 0.0
    """Depth of the heap's foot below the plate's line [pixels]."""

    def edge(self) -> tuple[FloatArray, FloatArray]:
        """Return columns and rows of the upper edge."""
        columns = np.flatnonzero(np.isfinite(self.rows))
        return columns.astype(np.float64), self.rows[columns]


def without_strays(found: FoundHeap) -> FoundHeap:
    """Remove what is beyond a gap in the outline: grains that rolled off."""
    height = found.plate.rows_at(np.arange(len(found.rows))) - found.rows
    height = np.where(np.isfinite(height), height, 0.0)
    kept = run_about(height > PLATE_CLEARANCE, int(height.argmax()))
    return replace(found, rows=np.where(kept, found.rows, np.nan))


def run_about(kept: NDArray[np.bool_], at: int) -> NDArray[np.bool_]:
    """Keep the columns from one on, in both directions, up to the first that is not kept."""
    labels = np.cumsum(~kept)
    return np.asarray(kept & (labels == labels[at]))


def refuse_narrow_base(seen: Contrast, found: FoundHeap, ends: tuple[float, float], place: str) -> None:
    """Refuse a heap on or in something no wider than itself: a dish, a box, a narrow board.

    What is directly below its foot then differs from both sides at the same level, apart from shadows; on a
    plate it is the plate as well. Or it is round below. `ends` are the positions where the flanks' lines meet
    the plate.
    """
    least = least_difference(seen)
    position, height = found.plate.level(*found.edge())
    span = float(np.ptp(position))
    if found.depth > DEEP_FOOT * span:
        across = float(position.min()) + np.linspace(0.3, 0.7, 60) * span
        low = _sampled(seen, found.plate, across, -found.depth * np.linspace(0.3, 0.7, 8))
        high = _sampled(seen, found.plate, across, float(height.max()) * np.linspace(0.1, 0.3, 8))
        if low is not None and high is not None and min(_differ(low, high), _differ(high, low)) > least:
            raise PictureError(place, NARROW_BASE, "a dish, or an object of another colour below it")
    strips = _foot_and_sides(seen, found, ends)
    if strips is None:
        return
    under, *sides = strips
    if all(_differ(under, side) > least for side in sides):
        raise PictureError(place, NARROW_BASE, "a dish, or a narrow board")
    lower = _strips(seen, found, ends, np.linspace(0.1, 0.14, 8), np.linspace(-0.04, 0.0, 20))
    if lower is None:
        return
    below, *corners = lower
    if all(_differ(below, corner) > least for corner in corners):
        raise PictureError(place, NARROW_BASE, "a dish, round below")


def darker_below(seen: Contrast, found: FoundHeap, ends: tuple[float, float]) -> bool:
    """Return True if it is darker directly below the foot than on both sides of it.

    Possible causes are light from behind, a dish of the wall's colour, and a dark foot below its line. Light
    from one side makes one side darker and the other brighter. The arguments are those of
    `refuse_narrow_base`.
    """
    strips = _foot_and_sides(seen, found, ends)
    if strips is None:
        return False
    least = least_difference(seen)
    if not all(far > least and darker > 0.0 for far, darker in _darkness(strips)):
        return False
    lower = _strips(seen, found, ends, np.linspace(0.08, 0.11, 8), np.linspace(0.05, 0.1, 20))
    if lower is None:
        return True
    # A heap's shadow fades away from its foot; a dish is dark everywhere.
    near, away = (np.mean([darker for _, darker in _darkness(each)]) for each in (strips, lower))
    return bool(away > FADED * near)


def _darkness(strips: tuple[Layer, Layer, Layer]) -> list[tuple[float, float]]:
    """Return how much the strip below differs from that on each side, and how much darker it is."""
    under, *sides = strips
    return [
        (float(np.median(_distance(under, side))), -float(np.median((under - side).mean(axis=-1))))
        for side in sides
    ]


def least_difference(seen: Contrast) -> float:
    return max(SIDE_NOISE * seen.noise, SIDE_DIFFERENCE)


def _distance(one: Layer, other: Layer) -> Layer:
    return np.asarray(np.linalg.norm(one - other, axis=-1), dtype=np.float32)


def _foot_and_sides(
    seen: Contrast, found: FoundHeap, ends: tuple[float, float]
) -> tuple[Layer, Layer, Layer] | None:
    """Colours directly below the foot, and at its left and right; None if the picture does not show them."""
    if ends[1] - ends[0] < LEAST_WIDTH:
        return None
    return _strips(seen, found, ends, np.linspace(0.02, 0.05, 8), np.linspace(0.05, 0.1, 20), blur=1.0)


def _strips(
    seen: Contrast,
    found: FoundHeap,
    ends: tuple[float, float],
    deep: FloatArray,
    beyond: FloatArray,
    blur: float = 0.0,
) -> tuple[Layer, Layer, Layer] | None:
    """Colours under the middle of a heap and near its left and right end; None if they are not shown.

    Depths below the foot and distances beyond the ends are in widths of the heap; `blur` [pixels] is added to
    the depths.
    """
    left, right = ends
    width = right - left
    heights = -found.depth - deep * width - blur
    middle = np.linspace(left + 0.3 * width, right - 0.3 * width, 60)
    under, before, behind = (
        _sampled(seen, found.plate, position, heights)
        for position in (middle, left - beyond * width, right + beyond * width)
    )
    return None if under is None or before is None or behind is None else (under, before, behind)


def _sampled(seen: Contrast, plate: PlateLine, position: FloatArray, heights: FloatArray) -> Layer | None:
    """Median colour of each height's points; None where the picture does not show them."""
    across, up = (grid.ravel() for grid in np.meshgrid(position, heights))
    columns, rows = (np.rint(value).astype(np.intp) for value in plate.picture_point(across, up))
    if min(columns.min(), rows.min()) < 0 or columns.max() >= seen.colors.shape[1]:
        return None
    if rows.max() >= seen.colors.shape[0]:
        return None
    colors = seen.colors[rows, columns].reshape(len(heights), len(position), -1)
    return np.asarray(np.median(colors, axis=1), dtype=np.float32)


def _differ(one: Layer, other: Layer) -> float:
    """Median difference of colours from others that a shadow on the first does not make."""
    return float(np.median(unshaded(one[None], other[None], 0)))
