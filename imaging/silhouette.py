"""Pictures to outlines: contrast with the background, threshold, heap on its plate, height of every column.

A drawn silhouette and a photograph take the same way. The scale of all numbers is the pixel of the picture;
a point (column, row) is the middle of that pixel.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from imaging.background import contrast_with_background
from imaging.errors import PictureError
from imaging.geometry import FloatArray, Picture
from imaging.plate import PlateLine, find_plate

MINIMUM_HEAP_WIDTH = 16
"""A narrower heap [pixels] is not measured."""
RIVAL_SHARE = 0.5
"""Largest second piece, as a share of the heap, of a picture that shows one heap."""
THIN = 4.0
"""Columns up to this high [pixels] are measured by their area."""
PLATE_CLEARANCE = 0.25
"""Height over the plate line [pixels] below which all belongs to the plate."""


@dataclass(frozen=True)
class Outline:
    """Height of a heap over its plate, from one picture."""

    position: FloatArray
    """Distance along the plate [pixels], increasing; 0 is where the plate line meets the picture's left
    border, shape (n,)."""
    height: FloatArray
    """Height over the plate line [pixels], positive, shape (n,)."""
    plate: PlateLine
    """Plate line in the picture."""
    meters_per_pixel: float | None = None
    """Scale, where it is known."""

    def in_part(self, left: int, top: int) -> Outline:
        """The same outline in a part of the picture that begins at this column and row."""
        start = left / np.cos(np.arctan(self.plate.slope))
        return replace(self, position=self.position - start, plate=self.plate.in_part(left, top))

    def mirrored(self) -> Outline:
        """The same heap seen in a mirror."""
        return Outline(-self.position[::-1], self.height[::-1], self.plate, self.meters_per_pixel)


def find_outline(
    picture: Picture,
    ground_row: float | None = None,
    meters_per_pixel: float | None = None,
    place: str = "picture",
) -> Outline:
    """Find the largest heap of a picture and the height of its outline over the plate.

    Parameters
    ----------
    picture : (rows, columns) or (rows, columns, 3) uint8 array
        Grey or blue-green-red, as OpenCV reads it. The heap may be darker or lighter than what is behind it.
    ground_row : float, optional
        Row of the plate's surface in a level picture, where it is known (a drawn snapshot). Otherwise the
        plate line is sought in the picture, and it levels a tilted camera.
    meters_per_pixel : float, optional
        Scale, handed on.
    place : str
        Names the picture in errors.

    Raises
    ------
    PictureError
        When the picture shows no heap, or one that a border crops.
    """
    contrast, thresholds = contrast_with_background(picture, place)
    errors = []
    for threshold in thresholds:
        try:
            return _outline(contrast, threshold, ground_row, meters_per_pixel, place)
        except PictureError as error:
            errors.append(error)
    raise errors[0]


def _outline(
    contrast: FloatArray,
    threshold: float,
    ground_row: float | None,
    meters_per_pixel: float | None,
    place: str,
) -> Outline:
    """Outline of the heap in a contrast picture."""
    plate, heap = _heap_on_plate(contrast > threshold, contrast, threshold, ground_row, place)
    if not plate.visible:
        threshold = 0.5 * _inner_contrast(heap, contrast)
        near = cv2.dilate(heap.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
        front = near & (contrast > threshold)
        plate, heap = _heap_on_plate(front, contrast, threshold, ground_row, place)
    rows = top_edge(heap, contrast, threshold)
    if not plate.visible:
        rows = _refine_thin(rows, heap, contrast, plate)
    columns = np.flatnonzero(heap.any(axis=0))
    position, height = plate.level(columns.astype(np.float64), rows[columns])
    if np.ptp(position) < MINIMUM_HEAP_WIDTH:
        rule = f"a heap is at least {MINIMUM_HEAP_WIDTH} pixels wide"
        raise PictureError(rule, f"{np.ptp(position):.0f}", place)
    order = np.argsort(position, kind="stable")
    return Outline(position[order], np.maximum(height[order], 0.0), plate, meters_per_pixel)


def _heap_on_plate(
    front: NDArray[np.bool_], contrast: FloatArray, threshold: float, ground_row: float | None, place: str
) -> tuple[PlateLine, NDArray[np.bool_]]:
    """The plate, and the heap that stands on it, among what stands out of the background."""
    if ground_row is None:
        body, _ = _largest_pieces(front)
        plate = find_plate(top_edge(body, contrast, threshold), bottom_edge(body, contrast, threshold), place)
    else:
        plate = PlateLine(row=ground_row, slope=0.0, visible=False)
    return plate, _standing_on(plate, front, place)


def top_edge(mask: NDArray[np.bool_], contrast: FloatArray, threshold: float) -> FloatArray:
    """Row at which the contrast crosses the threshold above the topmost masked pixel of each column.

    The crossing is interpolated between two pixels, which makes the edge of an anti-aliased picture exact
    to about a tenth of a pixel. What touches the border ends there. Columns without a masked pixel get NaN.
    """
    first = mask.argmax(axis=0)
    columns = np.arange(mask.shape[1])
    inside = contrast[first, columns]
    outside = contrast[np.maximum(first - 1, 0), columns]
    step = np.where(first > 0, inside - outside, 0.0)
    part = np.divide(inside - threshold, step, out=np.full(len(columns), 0.5), where=step > 0)
    return np.where(mask.any(axis=0), first - np.clip(part, 0.0, 1.0), np.nan)


def bottom_edge(mask: NDArray[np.bool_], contrast: FloatArray, threshold: float) -> FloatArray:
    """The same for the lowest masked pixel of each column."""
    return mask.shape[0] - 1.0 - top_edge(mask[::-1], contrast[::-1], threshold)


def _refine_thin(
    rows: FloatArray, heap: NDArray[np.bool_], contrast: FloatArray, plate: PlateLine
) -> FloatArray:
    """Upper edge whose thin columns, at most `THIN` high, are as high as their summed contrast says.

    No pixel of such a column need be covered whole, so that a threshold says little about its height.
    """
    columns = np.arange(heap.shape[1])
    line = plate.row + plate.slope * columns
    thin = line - rows <= THIN
    share = contrast / _inner_contrast(heap, contrast)
    total = np.vstack([np.zeros(heap.shape[1]), np.cumsum(share, axis=0)])
    first = np.clip(heap.argmax(axis=0) - 2, 0, heap.shape[0])
    last = np.clip(np.ceil(line + 0.5), 0, heap.shape[0]).astype(np.intp)
    return np.where(thin, line - (total[last, columns] - total[first, columns]), rows)


def _inner_contrast(heap: NDArray[np.bool_], contrast: FloatArray) -> float:
    """Contrast of a pixel that the heap covers whole: typical of those with the heap above and below them."""
    inner = heap.copy()
    inner[1:] &= heap[:-1]
    inner[:-1] &= heap[1:]
    return float(np.median(contrast[inner]) if inner.any() else contrast[heap].max())


def _largest_pieces(mask: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], float]:
    """The largest connected piece, and the area of the next as a share of it."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    order = np.argsort(stats[1:, cv2.CC_STAT_AREA])[::-1]
    areas = stats[1:, cv2.CC_STAT_AREA][order]
    return labels == 1 + order[0], float(areas[1] / areas[0]) if len(areas) > 1 else 0.0


def _standing_on(plate: PlateLine, front: NDArray[np.bool_], place: str) -> NDArray[np.bool_]:
    """The largest piece above the plate line; refuse one of several, and one that a border crops."""
    rows, columns = front.shape
    line = plate.row + plate.slope * np.arange(columns)
    above = front & (np.arange(rows)[:, None] < line - PLATE_CLEARANCE)
    if not above.any():
        raise PictureError("a heap stands on the plate", "nothing above the plate line", place)
    heap, next_share = _largest_pieces(above)
    for border, name in ((heap[:, 0], "left"), (heap[:, -1], "right"), (heap[0], "top")):
        if border.any():
            rule = "the whole heap is in the picture"
            raise PictureError(rule, f"a heap cropped by the {name} border", place)
    if next_share > RIVAL_SHARE:
        raise PictureError("one heap stands on the plate", "several pieces of like size", place)
    return heap
