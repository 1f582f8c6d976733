"""Drawn silhouettes to outlines: the plate is known, and nothing but the heap stands on it."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from imaging.errors import PictureError
from imaging.geometry import Layer, Picture
from imaging.outline import Outline, inner_contrast, largest_pieces, levelled, refine_thin, top_edge
from imaging.photo.background import contrast_with_background
from imaging.plate import PlateLine

RIVAL_SHARE = 0.5
"""Largest second piece, as a share of the heap, of a picture that shows one heap."""


def drawn_outline(picture: Picture, ground_row: float, meters_per_pixel: float | None, place: str) -> Outline:
    """Find the heap of a drawn picture on the plate at `ground_row` (see `find_outline`)."""
    seen = contrast_with_background(picture, place)
    plate = PlateLine(row=ground_row, slope=0.0, visible=False)
    errors = []
    for threshold in seen.thresholds:
        try:
            heap = _standing_on(plate, seen.values > threshold, place)
            threshold = 0.5 * inner_contrast(heap, seen.values)
            near = cv2.dilate(heap.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
            heap = _standing_on(plate, near & (seen.values > threshold), place)
            return _outline(heap, seen.values, threshold, plate, meters_per_pixel, place)
        except PictureError as error:
            errors.append(error)
    raise errors[0]


def _outline(
    heap: NDArray[np.bool_],
    contrast: Layer,
    threshold: float,
    plate: PlateLine,
    meters_per_pixel: float | None,
    place: str,
) -> Outline:
    rows = refine_thin(top_edge(heap, contrast, threshold), heap, contrast, plate)
    columns = np.flatnonzero(heap.any(axis=0))
    position, height = levelled(columns.astype(np.float64), rows[columns], plate, place)
    return Outline(position, height, plate, meters_per_pixel)


def _standing_on(plate: PlateLine, front: NDArray[np.bool_], place: str) -> NDArray[np.bool_]:
    """The largest piece above the plate line; refuse one of several, and one that a border crops."""
    above = plate.above(front)
    if not above.any():
        raise PictureError(place, "expected a heap stands on the plate", "nothing above the plate line")
    heap, next_share = largest_pieces(above)
    for border, name in ((heap[:, 0], "left"), (heap[:, -1], "right"), (heap[0], "top")):
        if border.any():
            rule = "expected the whole heap is in the picture"
            raise PictureError(place, rule, f"a heap cropped by the {name} border")
    if next_share > RIVAL_SHARE:
        raise PictureError(place, "expected one heap stands on the plate", "several pieces of like size")
    return heap
