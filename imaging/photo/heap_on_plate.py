"""A heap in the foreground of a photograph, with or without a visible plate."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from imaging.flank.outline import (
    Doubt,
    bottom_edge,
    cropping_borders,
    inner_contrast,
    largest_pieces,
    refine_thin,
    top_edge,
)
from imaging.flank.plate_line import PLATE_CLEARANCE, PlateLine, find_plate
from imaging.geometry import FloatArray, Layer
from imaging.photo.background import Contrast, unshaded
from imaging.photo.doubts import END_WIDTH, LARGEST_UNSEEN_TILT, LEAST_END
from imaging.photo.foot import Base, below_plate, front_of_base, is_lowest_row, joined_foot
from imaging.photo.view_settings import View
from imaging.picture_error import PictureError

FLOATING = 0.1
"""Gap between a piece and the plate's line, in heights of the piece, above which it is not on the plate."""
RIVAL_SHARE = 0.25
"""Share of the largest piece above which a second one is another heap or an object."""
LEAST_FOOT = 4.0
"""Least depth of a visible foot below the plate's line [pixels]: a lens bends the line by less."""
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
LOW_END = 0.08
"""Height of an outline's lower end over the heap's, above which its ground may be a board's underside."""
VIEW_FROM_ABOVE = 0.5
"""Depth of the base over its half width (a camera 30 degrees up) above which flanks are hidden."""


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


def locate_heap(
    seen: Contrast, threshold: float, given: PlateLine | None, view: View, place: str
) -> FoundHeap:
    """Find the heap in what differs from the wall by more than a threshold."""
    contrast = seen.values
    front = contrast > threshold
    plate, body, heap = _on_plate(front, seen, threshold, given, view, place)
    if not plate.visible:
        threshold = 0.5 * inner_contrast(heap, contrast)
        near = cv2.dilate(heap.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
        front = near & (contrast > threshold)
        plate, body, heap = _on_plate(front, seen, threshold, given, view, place)
        rows = refine_thin(top_edge(heap, contrast, threshold), heap, contrast, plate)
        found = _seen_whole(rows, body, plate, contrast, threshold, place)
        return found if given is not None else _doubted_on_board(seen, found)
    if given is not None:
        return FoundHeap(top_edge(heap, contrast, threshold), plate, 0.0, 0.0, ())
    return _on_seen_plate(seen, threshold, plate, body, heap, place)


def _on_plate(
    front: NDArray[np.bool_],
    seen: Contrast,
    threshold: float,
    given: PlateLine | None,
    view: View,
    place: str,
    shelf: bool = True,
) -> tuple[PlateLine, NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the plate, the largest piece of the foreground, and the part of the piece on the plate.

    Without `shelf` the edge of a plate next to the heap is not looked for.
    """
    if not front.any():
        raise PictureError(place, "no heap differs from the background")
    body, _ = largest_pieces(front)
    plate = _plate_of(body, seen, threshold, place, shelf) if given is None else given
    heap = _chosen_piece(_above(plate, front, place), plate, view, place)
    if given is None and plate.visible and _floats(heap, plate):
        # The supposed plate is in front of the heap's foot: the front of a table as pale as the wall.
        body = heap
        plate = _plate_of(body, seen, threshold, place)
        heap = _above(plate, heap, place)
    sought = given is None and plate.visible
    if sought and is_lowest_row(seen.colors, heap, body, plate, _least_difference(seen)):
        return _on_plate(front, seen, threshold, given, view, place, shelf=False)
    if borders := cropping_borders(heap):
        raise PictureError(place, f"no heap, or the heap is cropped by the {borders} of the picture")
    if not plate.visible and body[-1].any():
        raise PictureError(place, "no heap, or its foot is cropped by the bottom border of the picture")
    return plate, body, heap


def _above(plate: PlateLine, front: NDArray[np.bool_], place: str) -> NDArray[np.bool_]:
    above = plate.above(front)
    if not above.any():
        raise PictureError(place, "there is nothing above the plate line")
    return above


def _plate_of(
    body: NDArray[np.bool_], seen: Contrast, threshold: float, place: str, shelf: bool = True
) -> PlateLine:
    upper, lower = (edge(body, seen.values, threshold) for edge in (top_edge, bottom_edge))
    return find_plate(upper, lower, place, shelf)


def _floats(heap: NDArray[np.bool_], plate: PlateLine) -> bool:
    """Return True if a piece ends well above the plate's line."""
    rows, columns = np.nonzero(heap)
    gap = float((plate.rows_at(columns) - rows).min())
    return gap > max(4.0, FLOATING * float(np.ptp(rows)))


def _chosen_piece(above: NDArray[np.bool_], plate: PlateLine, view: View, place: str) -> NDArray[np.bool_]:
    """Return the only large piece above the plate's line, or the one that the view names."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(above.astype(np.uint8), connectivity=8)
    areas = stats[1:, cv2.CC_STAT_AREA]
    large = 1 + np.flatnonzero(areas > RIVAL_SHARE * areas.max())
    large = large[np.argsort(stats[large, cv2.CC_STAT_LEFT])]
    if view.heap is not None:
        if view.heap > len(large):
            shown = f"{len(large)} heap{'s' if len(large) > 1 else ''}"
            raise PictureError(place, f"the picture shows {shown} only", f"heap {view.heap}")
        return np.asarray(labels == large[view.heap - 1])
    if len(large) > 1:
        problem = (
            f"the picture shows {len(large)} heaps or objects of similar size: crop it, or choose a heap"
        )
        raise PictureError(place, problem)
    return np.asarray(labels == large[0])


def _seen_whole(
    rows: FloatArray,
    body: NDArray[np.bool_],
    plate: PlateLine,
    contrast: Layer,
    threshold: float,
    place: str,
) -> FoundHeap:
    """Build a heap without a visible plate: the front of its base is its lower edge."""
    doubts = []
    bottom = bottom_edge(body, contrast, threshold)
    base = front_of_base(bottom, None)
    elevation = elevation_se = 0.0
    depth = 0.0
    if base.seen:
        plate, elevation, elevation_se = _raised(base, rows, plate, place)
        depth = base.row + base.depth - plate.row
    if abs(plate.tilt) > LARGEST_UNSEEN_TILT:
        finding = f"{plate.tilt:.1f} degrees without a visible plate, over {LARGEST_UNSEEN_TILT:g}"
        doubts.append(Doubt("tilt", finding))
    return FoundHeap(rows, plate, elevation, elevation_se, tuple(doubts), depth)


def _on_seen_plate(
    seen: Contrast,
    threshold: float,
    plate: PlateLine,
    body: NDArray[np.bool_],
    heap: NDArray[np.bool_],
    place: str,
) -> FoundHeap:
    """Build a heap on a visible plate: seen from above, its foot goes on below the plate's edge."""
    top = below_plate(seen.colors, heap, body, plate)
    level = np.asarray(seen.values / threshold, dtype=np.float32)
    level_view = FoundHeap(top_edge(heap, level, 1.0), plate, 0.0, 0.0, ())
    if top.alike:
        doubt = Doubt("plate", "heap and plate have similar colours: the heap's foot is not visible")
        return replace(level_view, doubts=(doubt,))
    whole = joined_foot(heap, top.level, plate)
    if whole[:, 0].any() or whole[:, -1].any():
        doubt = Doubt("plate", "the plate differs from its own ends: the heap's foot is not visible")
        return replace(level_view, doubts=(doubt,))
    line = plate.rows_at(np.arange(heap.shape[1]))
    combined = np.where(np.arange(heap.shape[0])[:, None] <= line, level, top.level)
    base = front_of_base(bottom_edge(whole, combined, 1.0), plate.slope)
    if base.row + base.depth - plate.row < LEAST_FOOT:
        return level_view
    cropped = Doubt("border", "the heap's foot is cropped by the bottom border")
    rows = top_edge(whole, combined, 1.0)
    level_line = PlateLine(base.row, plate.slope, visible=True)
    elevation = elevation_se = 0.0
    if base.seen:
        level_line, elevation, elevation_se = _raised(base, rows, plate, place)
    depth = base.row + base.depth - level_line.row
    doubts = (cropped,) if whole[-1].any() else ()
    return FoundHeap(rows, level_line, elevation, elevation_se, doubts, depth)


def _doubted_on_board(seen: Contrast, found: FoundHeap) -> FoundHeap:
    """Doubt a heap with two high ends on a band that differs from what is above it.

    A board seen a little from above may look like this: its ends slant, so its underside is taken for the
    ground, and its ends for the feet of the flanks.
    """
    position, height = found.plate.level(*found.edge())
    size = max(3, round(END_WIDTH * len(height)))
    end = float(min(np.median(height[:size]), np.median(height[-size:])))
    share = end / max(float(height.max()), 1.0)
    if share <= LOW_END or end <= LEAST_END:
        return found
    across = float(position.min()) + np.linspace(0.3, 0.7, 60) * float(np.ptp(position))
    band, above = (
        _sampled(seen, found.plate, across, end * np.linspace(*part, 8)) for part in ((0.25, 0.7), (1.4, 2.0))
    )
    if band is None or above is None:
        return found
    if float(np.linalg.norm(np.median(band, axis=0) - np.median(above, axis=0))) <= _least_difference(seen):
        return found
    finding = f"both ends are {share:.2f} heights high, and of another colour than above: a board?"
    return replace(found, doubts=(*found.doubts, Doubt("plate", finding)))


def without_strays(found: FoundHeap) -> FoundHeap:
    """Remove what is beyond a gap in the outline: grains that rolled off."""
    height = found.plate.rows_at(np.arange(len(found.rows))) - found.rows
    height = np.where(np.isfinite(height), height, 0.0)
    tip = int(height.argmax())
    low = np.flatnonzero(height <= PLATE_CLEARANCE)
    first = int(low[low < tip].max(initial=-1)) + 1
    last = int(low[low > tip].min(initial=len(height)))
    kept = np.zeros(len(height), dtype=np.bool_)
    kept[first:last] = True
    return replace(found, rows=np.where(kept, found.rows, np.nan))


def refuse_narrow_base(seen: Contrast, found: FoundHeap, ends: tuple[float, float], place: str) -> None:
    """Refuse a heap on or in something no wider than itself: a dish, a box, a narrow board.

    What is directly below its foot then differs from both sides at the same level, apart from shadows; on a
    plate it is the plate as well. Or it is round below. `ends` are the positions where the flanks' lines meet
    the plate.
    """
    least = _least_difference(seen)
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
    least = _least_difference(seen)
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


def _least_difference(seen: Contrast) -> float:
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


def _raised(base: Base, rows: FloatArray, plate: PlateLine, place: str) -> tuple[PlateLine, float, float]:
    """Return the line at which the outline of a cone ends, and the camera's height, from its base."""
    if base.depth > VIEW_FROM_ABOVE * base.half_width:
        finding = f"a view from about {base.elevation:.0f} degrees above"
        raise PictureError(place, "the picture must show the heap from the side", finding)
    tip = np.nanmax(base.row + base.slope * np.arange(len(rows)) - rows)
    # The tangents from the tip touch the ellipse this far above its middle.
    touch = base.depth**2 / max(float(tip), 1.0)
    line = PlateLine(base.row - touch, base.slope, plate.visible)
    return line, base.elevation, base.elevation_se
