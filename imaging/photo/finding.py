"""Pictures to outlines, drawn and photographed."""

from __future__ import annotations

from imaging.geometry import Picture
from imaging.outline import Outline
from imaging.photo.drawn import drawn_outline
from imaging.photo.photograph import photographed_outline
from imaging.photo.view import View


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
        Grey or blue-green-red, as OpenCV reads it. The heap may be darker or lighter than what is behind it.
    ground_row : float, optional
        Row of the plate's surface in a level picture, where it is known (a drawn snapshot). Otherwise the
        plate line is sought in the picture, and it levels a tilted camera.
    meters_per_pixel : float, optional
        Scale, handed on.
    place : str
        Names the picture in errors.
    view : View, optional
        What is known of a photograph: the part to look at, the plate, which heap, the camera's height.

    Raises
    ------
    PictureError
        When the picture shows no heap, or one that a border crops.
    """
    if ground_row is not None:
        return drawn_outline(picture, ground_row, meters_per_pixel, place)
    return photographed_outline(picture, view or View(), meters_per_pixel, place)
