"""Photographs to outlines: a heap before a wall, on a plate, under somebody's lamp, in somebody's hand.

A large picture is searched on a reduced copy; the edge that is found there is refined at full size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from imaging.background import (
    LEAST_NOISE,
    Contrast,
    contrast_with_background,
    otsu_threshold,
    unshaded,
)
from imaging.doubts import (
    LARGEST_LEAN,
    LARGEST_MISFIT,
    LARGEST_SHIFT,
    LARGEST_UNSEEN_TILT,
    doubts_of,
    relative_misfit,
)
from imaging.errors import PictureError
from imaging.flanks import FitSettings, fit_flanks
from imaging.foot import below_plate, front_of_base, joined_foot
from imaging.geometry import FloatArray, Picture
from imaging.outline import (
    Outline,
    bottom_edge,
    inner_contrast,
    largest_pieces,
    levelled,
    refine_thin,
    top_edge,
)
from imaging.plate import PlateLine, find_plate
from imaging.reasons import Doubt
from imaging.view import View, level_angle

FLOATING = 0.1
"""A piece that ends this far over the plate's line, in its own heights, does not stand on it."""
SEARCHED_PIXELS = 800_000
"""A larger picture is searched on a copy of about this many pixels."""
RIVAL_SHARE = 0.25
"""A second piece larger than this share of the largest is a second heap or an object."""
FAINT = 6.0
"""Multiple of the wall's noise at which the faintest parts of a heap are cut out."""
GRAIN_SHARE = 0.005
"""Radius of a window that holds a grain or two, in the picture's widths."""
BOARD_SHARE = 0.08
"""Part of a board's width, at either end, that shows its colours."""
BOARD_SAMPLES = 4000
"""Pixels that a board's colours are taken from."""
VIEW_FROM_ABOVE = 0.5
"""Depth of the base over its half width: from here on, a camera 30 degrees up, flanks are hidden."""


@dataclass(frozen=True)
class Sighting:
    """A heap found in a picture.

    Attributes
    ----------
    rows : (columns,) array
        Upper edge of the heap; NaN beside it.
    plate : PlateLine
    elevation, elevation_se : float
    doubts : tuple of Doubt
    """

    rows: FloatArray
    plate: PlateLine
    elevation: float
    elevation_se: float
    doubts: tuple[Doubt, ...]


def photographed_outline(picture: Picture, view: View, meters_per_pixel: float | None, place: str) -> Outline:
    """Find the heap of a photograph (see `find_outline`)."""
    part = view.inside(picture.shape, place)
    cut = picture[part]
    left, top = part[1].start, part[0].start
    factor = max(1, round(np.sqrt(cut.shape[0] * cut.shape[1] / SEARCHED_PIXELS)))
    small = _reduced(cut, factor)
    given = _given_plate(view, left, top, factor)
    sighting = find_heap(small, given, view, place)
    if view.elevation is not None:
        sighting = replace(sighting, elevation=view.elevation, elevation_se=0.0)
    rows = sighting.rows
    columns = np.flatnonzero(np.isfinite(rows)).astype(np.float64)
    rows = rows[columns.astype(np.intp)]
    plate = sighting.plate
    if factor > 1:
        columns, rows = (factor * (value + 0.5) - 0.5 for value in (columns, rows))
        row = factor * (plate.row + 0.5) - 0.5 - plate.slope * (0.5 * factor - 0.5)
        plate = PlateLine(row, plate.slope, plate.visible)
    columns, rows = columns + left, rows + top
    plate = PlateLine(plate.row - plate.slope * left + top, plate.slope, plate.visible)
    position, height = levelled(columns, rows, plate, place)
    return Outline(
        position,
        height,
        plate,
        meters_per_pixel,
        sighting.elevation,
        sighting.elevation_se,
        view.distance_of(float(np.ptp(position))),
        sighting.doubts,
    )


def _reduced(picture: Picture, factor: int) -> Picture:
    if factor == 1:
        return picture
    rows, columns = (size // factor for size in picture.shape[:2])
    whole = picture[: rows * factor, : columns * factor]
    return np.asarray(cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _given_plate(view: View, left: int, top: int, factor: int) -> PlateLine | None:
    """The plate's line as a person gave it, in the reduced copy of the part."""
    if view.plate is None:
        return None
    x1, y1, x2, y2 = view.plate
    slope = (y2 - y1) / (x2 - x1)
    row = y1 - top + slope * (left - x1)
    return PlateLine((row + 0.5 - slope * (0.5 - 0.5 * factor)) / factor - 0.5, slope, visible=True)


def find_heap(picture: Picture, given: PlateLine | None, view: View, place: str) -> Sighting:
    """Find the heap in a picture of moderate size: of several thresholds the one that shows it best.

    An edge of a heap stays where it is whatever the threshold; where those that show a heap without a doubt
    disagree on its angle, there is one.
    """
    seen = contrast_with_background(picture, place, np.float32)
    faint = FAINT * max(seen.noise, LEAST_NOISE)
    plain = replace(seen, thresholds=tuple(dict.fromkeys((*seen.thresholds, faint))))
    tries, errors = _tries(plain, given, view, place)
    best = min(tries, key=lambda judged: judged.badness, default=None)
    if best is not None and best.clear and best.shift(tries) <= LARGEST_SHIFT:
        return best.sighting
    for other in (_without_shadows(seen), _grains_together(seen), _apart_from_plate(seen)):
        more, _ = _tries(other, given, view, place)
        tries += more
    if not tries:
        raise errors[0]
    best = min(tries, key=lambda judged: judged.badness)
    shift = best.shift(tries)
    if not best.clear or shift <= LARGEST_SHIFT:
        return best.sighting
    finding = f"the angle moves by {shift:.1f} degrees with the threshold, over {LARGEST_SHIFT:g}"
    return replace(best.sighting, doubts=(*best.sighting.doubts, Doubt("threshold", finding)))


def _tries(
    seen: Contrast, given: PlateLine | None, view: View, place: str
) -> tuple[list[Judged], list[PictureError]]:
    """Heaps at the thresholds of a contrast, and why others show none."""
    tries, errors = [], []
    for threshold in seen.thresholds:
        try:
            tries.append(_judged(_sighting(seen, threshold, given, view, place), place))
        except PictureError as error:
            errors.append(error)
    return tries, errors


def _without_shadows(seen: Contrast) -> Contrast:
    """The same picture with only what no shadow makes of its wall."""
    values = unshaded(seen.colors, seen.background, _grain_reach(seen))
    return replace(seen, values=values, thresholds=_cuts(values, seen.noise))


def _grains_together(seen: Contrast) -> Contrast:
    """The same picture with grains as light as the wall, between darker and lighter ones, filled up."""
    size = 2 * _grain_reach(seen) + 1
    values = np.sqrt(cv2.blur(seen.values**2, (size, size)))
    return replace(seen, values=values, thresholds=_cuts(values, seen.noise))


def _apart_from_plate(seen: Contrast) -> Contrast:
    """The same picture with only what differs from a board as well, whose colours its ends show.

    A board seen from above has ends that slant, and no straight edge behind the heap; but it has two colours
    at the most, of its top and of its front.
    """
    body, _ = largest_pieces(seen.values > seen.thresholds[-1])
    covered = np.flatnonzero(body.any(axis=0))
    size = max(2, round(BOARD_SHARE * len(covered)))
    ends = np.zeros_like(body)
    for side in (covered[:size], covered[-size:]):
        ends[:, side] = body[:, side]
    sample = seen.colors[ends][:: max(1, int(ends.sum()) // BOARD_SAMPLES)]
    if len(sample) < 2:
        return replace(seen, thresholds=())
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 20, 0.5)
    cv2.setRNGSeed(0)
    _, label, tones = cv2.kmeans(sample, 2, None, criteria, 1, cv2.KMEANS_PP_CENTERS)
    spread = float(np.median(np.linalg.norm(sample - tones[label.ravel()], axis=1)))
    values = seen.values
    for tone in tones:
        own = np.broadcast_to(tone.astype(np.float32), seen.colors.shape)
        values = np.minimum(values, unshaded(seen.colors, own, _grain_reach(seen)))
    return replace(seen, values=values, thresholds=_cuts(values, max(seen.noise, spread)))


def _grain_reach(seen: Contrast) -> int:
    return max(2, round(GRAIN_SHARE * seen.values.shape[1]))


def _cuts(values: NDArray[np.float32], noise: float) -> tuple[float, ...]:
    return tuple(dict.fromkeys((otsu_threshold(values.ravel()), FAINT * max(noise, LEAST_NOISE))))


@dataclass(frozen=True)
class Judged:
    """A sighting with the angle of its whole flanks, and how much speaks against it."""

    sighting: Sighting
    mean: float
    badness: float
    clear: bool

    def shift(self, others: Sequence[Judged]) -> float:
        """Greatest change of the angle [degrees] among others without a doubt."""
        return max((abs(other.mean - self.mean) for other in others if other.clear), default=0.0)


def _judged(sighting: Sighting, place: str) -> Judged:
    columns = np.flatnonzero(np.isfinite(sighting.rows)).astype(np.float64)
    rows = sighting.rows[columns.astype(np.intp)]
    position, height = levelled(columns, rows, sighting.plate, place)
    outline = Outline(position, height, sighting.plate, elevation=sighting.elevation)
    left, right = fit_flanks(outline, FitSettings.of("flank"), place)
    mean = 0.5 * (left.angle + right.angle)
    se = 0.5 * float(np.hypot(left.se, right.se))
    doubts = (*sighting.doubts, *doubts_of(left, right, mean, se, outline))
    lean = abs(left.angle - right.angle) / LARGEST_LEAN
    badness = len(doubts) + relative_misfit(left, right, outline) / LARGEST_MISFIT + lean
    return Judged(sighting, level_angle(mean, sighting.elevation), badness, not doubts)


def _sighting(seen: Contrast, threshold: float, given: PlateLine | None, view: View, place: str) -> Sighting:
    """The heap among what stands out of the wall by a threshold."""
    contrast = seen.values
    plate, body, heap = _on_plate(contrast > threshold, seen, threshold, given, view, place)
    if not plate.visible:
        threshold = 0.5 * inner_contrast(heap, contrast)
        near = cv2.dilate(heap.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
        plate, body, heap = _on_plate(near & (contrast > threshold), seen, threshold, given, view, place)
        rows = refine_thin(top_edge(heap, contrast, threshold), heap, contrast, plate)
        return _seen_whole(rows, body, plate, contrast, threshold, place)
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
) -> tuple[PlateLine, NDArray[np.bool_], NDArray[np.bool_]]:
    """The plate, the largest piece of what stands out of the wall, and what of it stands on the plate."""
    if not front.any():
        raise PictureError("a heap stands out of the background", "nothing that does", place)
    body, _ = largest_pieces(front)
    if given is None:
        edges = (edge(body, seen.values, threshold) for edge in (top_edge, bottom_edge))
        plate = find_plate(*edges, place)
    else:
        plate = given
    above = plate.above(front)
    if not above.any():
        raise PictureError("a heap stands on the plate", "nothing above the plate line", place)
    heap = _chosen_piece(above, plate, view, place)
    if given is None and plate.visible and _floats(heap, plate):
        # What was taken for the plate lies before the heap's foot: the front of a table as pale as the wall.
        body = heap
        edges = (edge(body, seen.values, threshold) for edge in (top_edge, bottom_edge))
        plate = find_plate(*edges, place)
        heap = plate.above(heap)
    for border, name in ((heap[:, 0], "left"), (heap[:, -1], "right"), (heap[0], "top")):
        if border.any():
            rule = "the whole heap is in the picture"
            raise PictureError(rule, f"a heap cropped by the {name} border", place)
    if not plate.visible and body[-1].any():
        rule = "the heap stands on its plate, its whole foot in the picture"
        raise PictureError(rule, "something that goes on below the bottom border: no heap?", place)
    return plate, body, heap


def _floats(heap: NDArray[np.bool_], plate: PlateLine) -> bool:
    """Whether a piece ends well above the plate's line."""
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
            raise PictureError(f"the picture shows {len(large)} heaps", f"heap {view.heap}", place)
        return np.asarray(labels == large[view.heap - 1])
    if len(large) > 1:
        rule = "one heap stands on the plate, and nothing of its size beside it (cut it out, or choose one)"
        raise PictureError(
            rule, f"several pieces of like size, {len(large)}: a second heap or objects", place
        )
    return np.asarray(labels == large[0])


def _seen_whole(
    rows: FloatArray,
    body: NDArray[np.bool_],
    plate: PlateLine,
    contrast: FloatArray,
    threshold: float,
    place: str,
) -> Sighting:
    """A heap without a plate's edge in view: the front of its base is its lower edge."""
    doubts = []
    bottom = bottom_edge(body, contrast, threshold)
    base = front_of_base(bottom, None)
    elevation = elevation_se = 0.0
    if base.seen:
        plate, elevation, elevation_se = _raised(base, rows, plate, place)
    if abs(plate.tilt) > LARGEST_UNSEEN_TILT:
        finding = f"{plate.tilt:.1f} degrees without a plate seen, over {LARGEST_UNSEEN_TILT:g}"
        doubts.append(Doubt("tilt", finding))
    return Sighting(rows, plate, elevation, elevation_se, tuple(doubts))


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
    line = plate.rows_at(np.arange(heap.shape[1]))
    combined = np.where(np.arange(heap.shape[0])[:, None] <= line, level, top.level)
    base = front_of_base(bottom_edge(whole, combined, 1.0), plate.slope)
    lowest = base.row + base.depth - plate.row
    if lowest < 4.0:
        return Sighting(top_edge(heap, level, 1.0), plate, 0.0, 0.0, tuple(doubts))
    if whole[-1].any():
        doubts.append(Doubt("border", "the heap's foot goes on below the bottom border"))
    rows = top_edge(whole, combined, 1.0)
    line = PlateLine(base.row, plate.slope, visible=True)
    elevation = elevation_se = 0.0
    if base.seen:
        line, elevation, elevation_se = _raised(base, rows, plate, place)
    return Sighting(rows, line, elevation, elevation_se, tuple(doubts))


def _raised(base, rows: FloatArray, plate: PlateLine, place: str) -> tuple[PlateLine, float, float]:
    """The line at which the straight outline of a cone ends, and the camera's height, from its base."""
    if base.depth > VIEW_FROM_ABOVE * base.half_width:
        rule = "the picture shows the heap from the side"
        raise PictureError(rule, f"a view from above, by some {base.elevation:.0f} degrees", place)
    tip = np.nanmax(base.row + base.slope * np.arange(len(rows)) - rows)
    # The tangents from the tip touch the ellipse this far above its middle.
    touch = base.depth**2 / max(float(tip), 1.0)
    line = PlateLine(base.row - touch, base.slope, plate.visible)
    return line, base.elevation, base.elevation_se
