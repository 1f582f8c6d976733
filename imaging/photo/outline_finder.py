"""Outlines of heaps on drawn and photographed pictures."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from imaging.flank.outline import Outline, inner_contrast, largest_pieces, levelled, refine_thin, top_edge
from imaging.flank.plate_line import PlateLine
from imaging.geometry import Picture
from imaging.photo.background import contrast_with_background
from imaging.photo.photograph import photographed_outline
from imaging.photo.view_settings import View
from imaging.picture_error import PictureError

RIVAL_SHARE = 0.5
"""Largest second piece, as a share of the heap, in a picture of one heap."""


def find_outline(
    picture: Picture,
    ground_row: float | None = None,
    meters_per_pixel: float | None = None,
    place: str = "picture",
    view: View | None = None,
) -> Outline:
    """Find the heap of a picture and the height of its outline over the plate.

    Parameters
    ----------
    picture : (rows, columns) or (rows, columns, 3) uint8 array
        Grey or blue-green-red, as OpenCV reads it. The heap may be darker or lighter than its background.
    ground_row : float, optional
        Row of the plate's surface in a drawn picture. Default: the plate line is found in the picture, and
        corrects the tilt of the camera.
    meters_per_pixel : float, optional
        Scale of the outline.
    place : str
        Names the picture in errors.
    view : View, optional
        Known facts of a photograph: the part to look at, the plate, the heap, the camera's height.

    Raises
    ------
    PictureError
        When the picture shows no heap, or a cropped one.
    """
    if ground_row is not None:
        return _drawn_outline(picture, ground_row, meters_per_pixel, place)
    return photographed_outline(picture, view or View(), meters_per_pixel, place)


def _drawn_outline(
    picture: Picture, ground_row: float, meters_per_pixel: float | None, place: str
) -> Outline:
    """Find the heap on the known plate of a drawn picture."""
    seen = contrast_with_background(picture, place)
    contrast, plate = seen.values, PlateLine(row=ground_row, slope=0.0, visible=False)
    errors = []
    for threshold in seen.thresholds:
        try:
            heap = _piece_on(plate, contrast > threshold, place)
            threshold = 0.5 * inner_contrast(heap, contrast)
            near = cv2.dilate(heap.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
            heap = _piece_on(plate, near & (contrast > threshold), place)
            rows = refine_thin(top_edge(heap, contrast, threshold), heap, contrast, plate)
            columns = np.flatnonzero(heap.any(axis=0))
            position, height = levelled(columns.astype(np.float64), rows[columns], plate, place)
            return Outline(position, height, plate, meters_per_pixel)
        except PictureError as error:
            errors.append(error)
    raise errors[0]


def _piece_on(plate: PlateLine, front: NDArray[np.bool_], place: str) -> NDArray[np.bool_]:
    """Return the largest piece above the plate line; refuse several pieces, and a cropped one."""
    above = plate.above(front)
    if not above.any():
        raise PictureError(place, "there is nothing above the plate line")
    heap, next_share = largest_pieces(above)
    for border, name in ((heap[:, 0], "left"), (heap[:, -1], "right"), (heap[0], "top")):
        if border.any():
            raise PictureError(place, f"the heap is cropped by the {name} border of the picture")
    if next_share > RIVAL_SHARE:
        raise PictureError(place, "there are several pieces of similar size above the plate line")
    return heap
