"""Picture files in and out. Inside, pictures are OpenCV's blue-green-red bytes."""

from __future__ import annotations

import math
import os
import warnings
from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np

from imaging.errors import PictureError
from imaging.geometry import Picture

MAXIMUM_PIXELS = 120_000_000
"""Larger pictures are not read: 360 MB in memory; a file of a few kilobytes may claim as many."""
LARGEST_FILE = 500_000_000
"""Bytes of the largest file that is read."""
PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
HEIC_ENDINGS = (".heic", ".heif")
FILM_DIAGONAL = math.hypot(36.0, 24.0)
"""Of the film that cameras' focal lengths are converted to [mm]."""
FOCAL_LENGTH_TAG, WIDTH_TAG, HEIGHT_TAG, CAMERA_TAGS = 0xA405, 0xA002, 0xA003, 0x8769
"""EXIF: focal length on 35 mm film [mm], the picture's width and height as taken, where these stand."""


def read_picture(path: str | Path) -> Picture:
    """Read a picture file as (rows, columns, 3) uint8 in blue-green-red, upright as its camera says (EXIF).

    HEIC needs the optional package pillow-heif.

    Raises
    ------
    PictureError
        When there is no such file, when it is no picture, or when it has more than `MAXIMUM_PIXELS`.
    """
    file = Path(path)
    if not os.path.isfile(file):  # a name too long is none, and raises nothing
        found = "a pipe or a device" if os.path.exists(file) else "no such file"
        if os.path.isdir(file):
            found = "a folder; name what is in it, as FOLDER/*.jpg"
        raise PictureError(str(path), "expected the picture is a regular file", found)
    if file.suffix.lower() in HEIC_ENDINGS:
        return _read_heic(file)
    if (length := file.stat().st_size) > LARGEST_FILE:
        raise PictureError(str(path), f"expected a picture has at most {LARGEST_FILE:,} bytes", f"{length:,}")
    # a file that does not tell its size is not decoded: it may have any
    size, picture, content = _claimed_size(file), None, file.read_bytes()
    if size is not None and _holds_its_chunks(content):
        _check_size(size, str(path))
        with suppress(cv2.error):
            picture = cv2.imdecode(np.frombuffer(content, dtype=np.uint8), cv2.IMREAD_COLOR)
    if picture is None:
        raise PictureError(
            str(path), "expected the file is a picture that OpenCV can read", f"{length} bytes"
        )
    return picture.astype(np.uint8, copy=False)


def _read_heic(file: Path) -> Picture:
    try:
        import pillow_heif
    except ImportError:
        rule = "expected HEIC is read with pillow-heif (pip install 'dem-warp[heic]'); or save the picture as JPEG"
        raise PictureError(str(file), rule, file.name) from None
    try:
        image = pillow_heif.open_heif(file, convert_hdr_to_8bit=True)
        _check_size(image.size, str(file))
        colors = np.asarray(image)[:, :, :3]
    except (ValueError, OSError, RuntimeError, SyntaxError) as error:
        raise PictureError(str(file), "expected the file is a HEIC picture", str(error)) from None
    return np.ascontiguousarray(colors[:, :, ::-1])


def _check_size(size: tuple[int, int], place: str) -> None:
    if size[0] * size[1] > MAXIMUM_PIXELS:
        rule = f"expected a picture has at most {MAXIMUM_PIXELS // 10**6} million pixels: save it smaller"
        raise PictureError(place, rule, f"{size[0]} x {size[1]}")


def _claimed_size(file: Path) -> tuple[int, int] | None:
    """Columns and rows that a file's header names, before anything is decoded; None without a known one."""
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(file) as image:
                return image.size
    except Image.DecompressionBombError:
        rule = f"expected a picture has at most {MAXIMUM_PIXELS // 10**6} million pixels: save it smaller"
        raise PictureError(str(file), rule, "several times as many") from None
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError):
        return None


def _holds_its_chunks(content: bytes) -> bool:
    """Tell that no chunk of a PNG claims more bytes than there are: OpenCV makes room for all of them.

    It decodes no such file. True of every other format.
    """
    if not content.startswith(PNG_SIGNATURE):
        return True
    at = len(PNG_SIGNATURE)
    while at + 8 <= len(content):
        length, kind = int.from_bytes(content[at : at + 4]), content[at + 4 : at + 8]
        at += 12 + length  # length, kind, content, checksum
        if kind == b"IEND":
            break
    return at <= len(content)


def focal_length(path: str | Path) -> float | None:
    """Focal length [pixels] by which a camera took a picture (EXIF); None where it does not say, or was cut.

    An uncut picture has the size that its camera wrote beside the focal length.
    """
    from PIL import Image, UnidentifiedImageError

    if not os.path.isfile(path):  # to open a pipe is to wait for whoever writes
        return None
    try:
        with warnings.catch_warnings(action="ignore"), Image.open(path) as image:
            tags = image.getexif().get_ifd(CAMERA_TAGS)
            size = sorted(image.size)
        film = float(tags.get(FOCAL_LENGTH_TAG, 0))
        taken = sorted(int(tags.get(tag, 0)) for tag in (WIDTH_TAG, HEIGHT_TAG))
    except (
        UnidentifiedImageError,
        Image.DecompressionBombError,
        OSError,
        ValueError,
        TypeError,
        SyntaxError,
    ):
        return None
    if not (5.0 <= film <= 2000.0) or taken != size:
        return None
    return film / FILM_DIAGONAL * math.hypot(*size)


def save_picture(path: str | Path, image: Picture) -> Path:
    """Write a picture; the ending of the name (.png, .jpg, ...) says how. Return the path."""
    file = Path(path)
    try:
        written, data = cv2.imencode(file.suffix, image)
    except cv2.error:
        written = False
    if not written:
        raise PictureError(
            str(path), "expected the ending names a picture format (.png, .jpg, ...)", repr(file.suffix)
        )
    file.write_bytes(data.tobytes())
    return file
