"""Picture files in and out. Inside, pictures are OpenCV's blue-green-red bytes."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from imaging.errors import PictureError
from imaging.geometry import Picture


def read_picture(path: str | Path) -> Picture:
    """Read a picture file as (rows, columns, 3) uint8 in blue-green-red, upright as its camera says (EXIF).

    Raises
    ------
    PictureError
        When there is no such file, or when it is no picture.
    """
    file = Path(path)
    if not file.is_file():
        raise PictureError("the picture is a file", "no such file", str(path))
    data = np.frombuffer(file.read_bytes(), dtype=np.uint8)
    picture = cv2.imdecode(data, cv2.IMREAD_COLOR) if len(data) else None
    if picture is None:
        raise PictureError("the file is a picture that OpenCV can read", f"{len(data)} bytes", str(path))
    return picture.astype(np.uint8, copy=False)


def save_picture(path: str | Path, image: Picture) -> Path:
    """Write a picture; the ending of the name (.png, .jpg, ...) says how. Return the path."""
    file = Path(path)
    try:
        written, data = cv2.imencode(file.suffix, image)
    except cv2.error:
        written = False
    if not written:
        raise PictureError(
            "the ending names a picture format (.png, .jpg, ...)", repr(file.suffix), str(path)
        )
    file.write_bytes(data.tobytes())
    return file
