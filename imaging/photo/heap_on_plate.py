"""A heap in the foreground of a photograph, with or without a visible plate."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

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
from imaging.flank.plate_line import PlateLine, find_plate
from imaging.geometry import FloatArray, Layer
from imaging.photo.around_foot import FoundHeap, least_difference, run_about
from imaging.photo.background import Contrast
from imaging.photo.doubts import LARGEST_UNSEEN_TILT
from imaging.photo.foot import Base, below_plate, front_of_base, is_lowest_row, joined_foot
from imaging.photo.view_settings import View
from imaging.picture_error import PictureError

FLOATING = 0.1
"""Gap between a piece and the plate's line, in heights of the piece, above which it is not on the plate."""
RIVAL_SHARE = 0.25
"""Share of the largest piece above which a second one is another heap or an object."""
LEAST_FOOT = 4.0
"""Least depth of a visible foot below the plate's line [pixels]: a lens bends the line by less."""
UNSEEN_FOOT = Doubt("plate", "heap and plate have similar colours: the heap's foot is not visible")
UNKNOWN_HEIGHT = Doubt("elevation", "not measured: the heap's foot below the given line is not visible")
WIDER = 1.1
"""Width of the foreground over the heap's, above which it contains the plate."""
VIEW_FROM_ABOVE = 0.5
"""Depth of the base over its half width (a camera 30 degrees up) above which flanks are hidden."""


def locate_heap(
    seen: Contrast, threshold: float, given: PlateLine | None, view: View, place: str
) -> FoundHeap:
    """Find the heap in what differs from the wall by more than a threshold.

    A given line replaces the plate's own, also where a plate is seen above it.
    """
    try:
        return _located(seen, threshold, given, view, place)
    except PictureError:
        if given is None:
            raise
        known = replace(view, elevation=view.elevation or 0.0)
        for each, doubts in ((view, ()), (known, (UNSEEN_FOOT,))):
            with suppress(PictureError):
                found = _located(seen, threshold, None, each, place)
                return _moved_to(given, replace(found, doubts=(*found.doubts, *doubts)), view)
        raise


def _moved_to(line: PlateLine, found: FoundHeap, view: View) -> FoundHeap:
    """Return a heap on a given line; a foot that is not visible leaves only the camera's height unknown."""
    doubts = tuple(doubt for doubt in found.doubts if doubt.name != "plate")
    if doubts != found.doubts and view.elevation is None:
        doubts = (*doubts, UNKNOWN_HEIGHT)
    depth = found.depth + found.plate.row - line.row
    return replace(found, plate=line, depth=depth, doubts=doubts)


def _located(seen: Contrast, threshold: float, given: PlateLine | None, view: View, place: str) -> FoundHeap:
    contrast = seen.values
    front = contrast > threshold
    plate, body, heap = _on_plate(front, seen, threshold, given, view, place)
    if not plate.visible:
        threshold = 0.5 * inner_contrast(heap, contrast)
        near = cv2.dilate(heap.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
        front = near & (contrast > threshold)
        plate, body, heap = _on_plate(front, seen, threshold, given, view, place)
        rows = refine_thin(top_edge(heap, contrast, threshold), heap, contrast, plate)
        return _seen_whole(rows, body, plate, contrast, threshold, view, place)
    if given is not None:
        return _on_given_plate(seen, threshold, plate, body, heap, view, place)
    return _on_seen_plate(seen, threshold, plate, body, heap, view, place)


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
    if sought and is_lowest_row(seen.colors, heap, body, plate, least_difference(seen)):
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
    view: View,
    place: str,
) -> FoundHeap:
    """Build a heap without a visible plate: the front of its base is its lower edge."""
    doubts = []
    bottom = bottom_edge(body, contrast, threshold)
    base = front_of_base(bottom, None)
    plate, elevation, elevation_se = _raised(base, rows, plate, view, place)
    depth = base.row + base.depth - plate.row if base.seen else 0.0
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
    view: View,
    place: str,
) -> FoundHeap:
    """Build a heap on a visible plate: seen from above, its foot goes on below the plate's edge."""
    top = below_plate(seen.colors, heap, body, plate)
    level = np.asarray(seen.values / threshold, dtype=np.float32)
    level_view = FoundHeap(top_edge(heap, level, 1.0), plate, 0.0, 0.0, ())
    if top is None:
        return replace(level_view, doubts=(UNSEEN_FOOT,))
    whole = joined_foot(heap, top, plate)
    if whole[:, 0].any() or whole[:, -1].any():
        doubt = Doubt("plate", "the plate differs from its own ends: the heap's foot is not visible")
        return replace(level_view, doubts=(doubt,))
    line = plate.rows_at(np.arange(heap.shape[1]))
    combined = np.where(np.arange(heap.shape[0])[:, None] <= line, level, top)
    rows, bottom = (edge(whole, combined, 1.0) for edge in (top_edge, bottom_edge))
    height = np.nan_to_num(line - rows)
    # The bent edge of a plate is no foot, and strays beyond it are not the heap's.
    least = min(max(LEAST_FOOT, FLOATING * height.max()), height.max())
    own = run_about((bottom - line > LEAST_FOOT) | (height >= least), int(height.argmax()))
    base = front_of_base(np.where(own, bottom, np.nan), plate.slope)
    if base.row + base.depth - plate.row < LEAST_FOOT:
        return level_view
    cropped = Doubt("border", "the heap's foot is cropped by the bottom border")
    rows, level_line = np.where(own, rows, np.nan), PlateLine(base.row, plate.slope, visible=True)
    level_line, elevation, elevation_se = _raised(base, rows, level_line, view, place)
    depth = base.row + base.depth - level_line.row
    doubts = (cropped,) if whole[-1].any() else ()
    return FoundHeap(rows, level_line, elevation, elevation_se, doubts, depth)


def _on_given_plate(
    seen: Contrast,
    threshold: float,
    plate: PlateLine,
    body: NDArray[np.bool_],
    heap: NDArray[np.bool_],
    view: View,
    place: str,
) -> FoundHeap:
    """Build a heap on a given line: the part of its base below the line shows the camera's height."""
    ends, own = (np.flatnonzero(piece.any(axis=0)) for piece in (body, heap))
    edge = top_edge(heap, seen.values, threshold)
    try:
        if np.ptp(ends) > WIDER * np.ptp(own):
            found = _on_seen_plate(seen, threshold, plate, body, heap, view, place)
        else:
            found = _seen_whole(edge, body, plate, seen.values, threshold, view, place)
    except PictureError:
        found = FoundHeap(edge, plate, 0.0, 0.0, (UNSEEN_FOOT,))
    return _moved_to(plate, replace(found, rows=edge), view)


def _raised(
    base: Base, rows: FloatArray, plate: PlateLine, view: View, place: str
) -> tuple[PlateLine, float, float]:
    """Return the line at which the outline of a cone ends, and the camera's height, from its base.

    A given height of the camera replaces the measured one, with the front of the base where it is.
    """
    if not base.seen:
        return plate, 0.0, base.elevation_se
    if view.elevation is not None:
        depth = base.half_width * np.sin(np.radians(view.elevation))
        base = replace(base, row=base.row + base.depth - depth, depth=depth, depth_se=0.0)
    elif base.depth > VIEW_FROM_ABOVE * base.half_width:
        finding = f"a view from about {base.elevation:.0f} degrees above"
        raise PictureError(place, "the picture must show the heap from the side", finding)
    tip = np.nanmax(base.row + base.slope * np.arange(len(rows)) - rows)
    # The tangents from the tip touch the ellipse this far above its middle.
    touch = base.depth**2 / max(float(tip), 1.0)
    line = PlateLine(base.row - touch, base.slope, plate.visible)
    return line, base.elevation, base.elevation_se
