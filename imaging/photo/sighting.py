"""A heap among what stands out of a photograph's background, on a plate that is seen or not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from imaging.errors import PictureError
from imaging.geometry import FloatArray, Layer
from imaging.outline import (
    bottom_edge,
    cropping_borders,
    inner_contrast,
    largest_pieces,
    refine_thin,
    top_edge,
)
from imaging.photo.background import Contrast, unshaded
from imaging.photo.doubts import END_WIDTH, LARGEST_UNSEEN_TILT, LEAST_END
from imaging.photo.foot import Base, below_plate, front_of_base, is_lowest_row, joined_foot
from imaging.photo.view import View
from imaging.plate import PLATE_CLEARANCE, PlateLine, find_plate
from imaging.reasons import Doubt

FLOATING = 0.1
"""A piece that ends this far over the plate's line, in its own heights, does not stand on it."""
RIVAL_SHARE = 0.25
"""A second piece larger than this share of the largest is a second heap or an object."""
LEAST_FOOT = 4.0
"""A foot is seen where it reaches this far below the plate's line [pixels]: a lens bends that by less."""
DEEP_FOOT = 0.05
"""Depth of a foot over its width, a camera 6 degrees up, from which on its colour is asked for."""
LEAST_WIDTH = 100.0
"""Width [pixels] below which the base of a heap is not looked at: a blurred edge is as wide as the strips."""
BRIMFUL_RULE = "expected the heap stands on a plate wider than itself"
BESIDE_NOISE, BESIDE_DIFFERENCE = 6.0, 24.0
"""Multiple of the wall's noise, and difference [of 255], from which on two sides differ: twice a cloth's."""
FADED = 0.7
"""Darkness a tenth of a heap's width below its foot over that at its foot, under which it is a shadow's: good
heaps seen from above have up to 0.65, a dish 1."""
LOW_END = 0.08
"""Height of an outline's lower end over the heap's, from which on its ground may be a board's underside."""
VIEW_FROM_ABOVE = 0.5
"""Depth of the base over its half width: from here on, a camera 30 degrees up, flanks are hidden."""


@dataclass(frozen=True)
class Sighting:
    """A heap found in a picture."""

    rows: FloatArray
    """Upper edge of the heap; NaN beside it, shape (columns,)."""
    plate: PlateLine
    elevation: float
    elevation_se: float
    """Of the camera [degrees]."""
    doubts: tuple[Doubt, ...]
    depth: float = 0.0
    """Reach of the heap's foot below the plate's line [pixels]."""


def sight(seen: Contrast, threshold: float, given: PlateLine | None, view: View, place: str) -> Sighting:
    """The heap among what stands out of the wall by a threshold."""
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
        return Sighting(top_edge(heap, contrast, threshold), plate, 0.0, 0.0, ())
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
    """The plate, the largest piece of what stands out of the wall, and what of it stands on the plate.

    Without `shelf` no plate's edge is looked for beside the heap.
    """
    if not front.any():
        raise PictureError(place, "expected a heap stands out of the background", "nothing that does")
    body, _ = largest_pieces(front)
    plate = _plate_of(body, seen, threshold, place, shelf) if given is None else given
    above = plate.above(front)
    if not above.any():
        raise PictureError(place, "expected a heap stands on the plate", "nothing above the plate line")
    heap = _chosen_piece(above, plate, view, place)
    if given is None and plate.visible and _floats(heap, plate):
        # What was taken for the plate lies before the heap's foot: the front of a table as pale as the wall.
        body = heap
        plate = _plate_of(body, seen, threshold, place)
        heap = plate.above(heap)
        if not heap.any():
            raise PictureError(place, "expected a heap stands on the plate", "nothing above the plate line")
    sought = given is None and plate.visible
    if sought and is_lowest_row(seen.colors, heap, body, plate, _least_difference(seen)):
        return _on_plate(front, seen, threshold, given, view, place, shelf=False)
    if borders := cropping_borders(heap):
        rule = "expected the whole heap is in the picture"
        raise PictureError(place, rule, f"no heap, or one cropped by the {borders}")
    if not plate.visible and body[-1].any():
        rule = "expected the heap stands on its plate, its whole foot in the picture"
        raise PictureError(place, rule, "no heap, or one that goes on below the bottom border")
    return plate, body, heap


def _plate_of(
    body: NDArray[np.bool_], seen: Contrast, threshold: float, place: str, shelf: bool = True
) -> PlateLine:
    upper, lower = (edge(body, seen.values, threshold) for edge in (top_edge, bottom_edge))
    return find_plate(upper, lower, place, shelf)


def _floats(heap: NDArray[np.bool_], plate: PlateLine) -> bool:
    """Tell if a piece ends well above the plate's line."""
    rows, columns = np.nonzero(heap)
    gap = float((plate.rows_at(columns) - rows).min())
    return gap > max(4.0, FLOATING * float(np.ptp(rows)))


def _chosen_piece(above: NDArray[np.bool_], plate: PlateLine, view: View, place: str) -> NDArray[np.bool_]:
    """The one large piece above the plate's line, or the one of several that was chosen."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(above.astype(np.uint8), connectivity=8)
    areas = stats[1:, cv2.CC_STAT_AREA]
    large = 1 + np.flatnonzero(areas > RIVAL_SHARE * areas.max())
    large = large[np.argsort(stats[large, cv2.CC_STAT_LEFT])]
    if view.heap is not None:
        if view.heap > len(large):
            shown = f"{len(large)} heap{'s' if len(large) > 1 else ''}"
            raise PictureError(place, f"expected the picture shows {shown}", f"heap {view.heap}")
        return np.asarray(labels == large[view.heap - 1])
    if len(large) > 1:
        rule = "expected one heap stands on the plate, and nothing of its size beside it (cut it out, or choose one)"
        raise PictureError(
            place, rule, f"several pieces of like size, {len(large)}: a second heap or objects"
        )
    return np.asarray(labels == large[0])


def _seen_whole(
    rows: FloatArray,
    body: NDArray[np.bool_],
    plate: PlateLine,
    contrast: Layer,
    threshold: float,
    place: str,
) -> Sighting:
    """A heap without a plate's edge in view: the front of its base is its lower edge."""
    doubts = []
    bottom = bottom_edge(body, contrast, threshold)
    base = front_of_base(bottom, None)
    elevation = elevation_se = 0.0
    depth = 0.0
    if base.seen:
        plate, elevation, elevation_se = _raised(base, rows, plate, place)
        depth = base.row + base.depth - plate.row
    if abs(plate.tilt) > LARGEST_UNSEEN_TILT:
        finding = f"{plate.tilt:.1f} degrees without a plate seen, over {LARGEST_UNSEEN_TILT:g}"
        doubts.append(Doubt("tilt", finding))
    return Sighting(rows, plate, elevation, elevation_se, tuple(doubts), depth)


def _on_seen_plate(
    seen: Contrast,
    threshold: float,
    plate: PlateLine,
    body: NDArray[np.bool_],
    heap: NDArray[np.bool_],
    place: str,
) -> Sighting:
    """A heap on a plate whose edge is seen: a level one ends there, one seen from above goes on below."""
    doubts: list[Doubt] = []
    top = below_plate(seen.colors, heap, body, plate)
    level = np.asarray(seen.values / threshold, dtype=np.float32)
    if top.alike:
        doubts.append(Doubt("plate", "heap and plate are of like colour: the heap's foot is not seen"))
        return Sighting(top_edge(heap, level, 1.0), plate, 0.0, 0.0, tuple(doubts))
    whole = joined_foot(heap, top.level, plate)
    if whole[:, 0].any() or whole[:, -1].any():
        doubts.append(Doubt("plate", "the plate differs from its own ends: the heap's foot is not seen"))
        return Sighting(top_edge(heap, level, 1.0), plate, 0.0, 0.0, tuple(doubts))
    line = plate.rows_at(np.arange(heap.shape[1]))
    combined = np.where(np.arange(heap.shape[0])[:, None] <= line, level, top.level)
    base = front_of_base(bottom_edge(whole, combined, 1.0), plate.slope)
    if base.row + base.depth - plate.row < LEAST_FOOT:
        return Sighting(top_edge(heap, level, 1.0), plate, 0.0, 0.0, tuple(doubts))
    if whole[-1].any():
        doubts.append(Doubt("border", "the heap's foot goes on below the bottom border"))
    rows = top_edge(whole, combined, 1.0)
    level_line = PlateLine(base.row, plate.slope, visible=True)
    elevation = elevation_se = 0.0
    if base.seen:
        level_line, elevation, elevation_se = _raised(base, rows, plate, place)
    depth = base.row + base.depth - level_line.row
    return Sighting(rows, level_line, elevation, elevation_se, tuple(doubts), depth)


def _doubted_on_board(seen: Contrast, found: Sighting) -> Sighting:
    """The same heap, doubted where both of its ends stand high on a band that differs from what is above it.

    So does a board with its heap, seen a little from above: its ends slant, and show no straight edge beside
    the heap; its underside is then taken for the ground, and its slanting ends for the feet of the flanks.
    """
    columns = np.flatnonzero(np.isfinite(found.rows)).astype(np.float64)
    position, height = found.plate.level(columns, found.rows[columns.astype(np.intp)])
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
    finding = f"both ends stand {share:.2f} heights high, in another colour than what is above: a board?"
    return replace(found, doubts=(*found.doubts, Doubt("plate", finding)))


def without_strays(found: Sighting) -> Sighting:
    """The same heap without what lies beyond a gap in its outline: grains that rolled off."""
    height = found.plate.rows_at(np.arange(len(found.rows))) - found.rows
    height = np.where(np.isfinite(height), height, 0.0)
    tip = int(height.argmax())
    low = np.flatnonzero(height <= PLATE_CLEARANCE)
    first = int(low[low < tip].max(initial=-1)) + 1
    last = int(low[low > tip].min(initial=len(height)))
    kept = np.zeros(len(height), dtype=np.bool_)
    kept[first:last] = True
    return replace(found, rows=np.where(kept, found.rows, np.nan))


def refuse_brimful(seen: Contrast, found: Sighting, ends: tuple[float, float], place: str) -> None:
    """Refuse a heap that stands on, or in, something no wider than itself: a dish, a box, a narrow board.

    What is right below its foot then differs from what is beside it at the same level, to the left and to the
    right; on a plate both are the plate, and shadows on it do not count. Or it is round below.

    Parameters
    ----------
    seen : Contrast
    found : Sighting
    ends : (float, float)
        Where the flanks' lines meet the plate [pixels along it].
    place : str
        Names the picture in errors.
    """
    least = _least_difference(seen)
    columns = np.flatnonzero(np.isfinite(found.rows)).astype(np.float64)
    position, height = found.plate.level(columns, found.rows[columns.astype(np.intp)])
    span = float(np.ptp(position))
    if found.depth > DEEP_FOOT * span:
        across = float(position.min()) + np.linspace(0.3, 0.7, 60) * span
        low = _sampled(seen, found.plate, across, -found.depth * np.linspace(0.3, 0.7, 8))
        high = _sampled(seen, found.plate, across, float(height.max()) * np.linspace(0.1, 0.3, 8))
        if low is not None and high is not None and min(_differ(low, high), _differ(high, low)) > least:
            raise PictureError(place, BRIMFUL_RULE, "a dish, or an object of another colour below it")
    strips = _beside(seen, found, ends)
    if strips is None:
        return
    under, *sides = strips
    if all(_differ(under, side) > least for side in sides):
        raise PictureError(place, BRIMFUL_RULE, "a dish, or a narrow board")
    lower = _strips(seen, found, ends, np.linspace(0.1, 0.14, 8), np.linspace(-0.04, 0.0, 20))
    if lower is None:
        return
    below, *corners = lower
    if all(_differ(below, corner) > least for corner in corners):
        raise PictureError(place, BRIMFUL_RULE, "a dish, round below")


def darker_below(seen: Contrast, found: Sighting, ends: tuple[float, float]) -> bool:
    """True if what is right below the foot is darker than beside it, on both sides.

    Light from behind does that, a dish in a shade of the wall's colour, and a dark foot that hangs below its
    line. Light from one side does not: it leaves one side darker, the other one brighter.

    Parameters
    ----------
    seen : Contrast
    found : Sighting
    ends : (float, float)
        Where the flanks' lines meet the plate [pixels along it].
    """
    strips = _beside(seen, found, ends)
    if strips is None:
        return False
    least = _least_difference(seen)
    if not all(far > least and darker > 0.0 for far, darker in _darkness(strips)):
        return False
    lower = _strips(seen, found, ends, np.linspace(0.08, 0.11, 8), np.linspace(0.05, 0.1, 20))
    if lower is None:
        return True
    # What the heap hides of the light comes back away from its foot; a dish is as dark all over.
    near, away = (np.mean([darker for _, darker in _darkness(each)]) for each in (strips, lower))
    return bool(away > FADED * near)


def _darkness(strips: tuple[Layer, Layer, Layer]) -> list[tuple[float, float]]:
    """Difference of what is below from each side, and how much darker it is."""
    under, *sides = strips
    return [
        (float(np.median(_distance(under, side))), -float(np.median((under - side).mean(axis=-1))))
        for side in sides
    ]


def _least_difference(seen: Contrast) -> float:
    return max(BESIDE_NOISE * seen.noise, BESIDE_DIFFERENCE)


def _distance(one: Layer, other: Layer) -> Layer:
    return np.asarray(np.linalg.norm(one - other, axis=-1), dtype=np.float32)


def _beside(seen: Contrast, found: Sighting, ends: tuple[float, float]) -> tuple[Layer, Layer, Layer] | None:
    """Colours right below the foot, and at the same level to the left and to the right; None if not shown."""
    if ends[1] - ends[0] < LEAST_WIDTH:
        return None
    return _strips(seen, found, ends, np.linspace(0.02, 0.05, 8), np.linspace(0.05, 0.1, 20), blur=1.0)


def _strips(
    seen: Contrast,
    found: Sighting,
    ends: tuple[float, float],
    deep: FloatArray,
    beyond: FloatArray,
    blur: float = 0.0,
) -> tuple[Layer, Layer, Layer] | None:
    """Colours under the middle of a heap, and about its left and its right end; None if not shown.

    Depths below the foot and distances beyond the ends count in the heap's widths; the depths begin so many
    pixels lower.
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
    """The line at which the straight outline of a cone ends, and the camera's height, from its base."""
    if base.depth > VIEW_FROM_ABOVE * base.half_width:
        rule = "expected the picture shows the heap from the side"
        raise PictureError(place, rule, f"a view from above, by some {base.elevation:.0f} degrees")
    tip = np.nanmax(base.row + base.slope * np.arange(len(rows)) - rows)
    # The tangents from the tip touch the ellipse this far above its middle.
    touch = base.depth**2 / max(float(tip), 1.0)
    line = PlateLine(base.row - touch, base.slope, plate.visible)
    return line, base.elevation, base.elevation_se
