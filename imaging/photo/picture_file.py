"""Reading and writing of picture files. In memory, pictures are OpenCV's blue-green-red bytes."""

from __future__ import annotations

import math
import os
import warnings
from contextlib import suppress
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from imaging.geometry import Picture
from imaging.picture_error import PictureError

MAXIMUM_PIXELS = 120_000_000
"""Largest picture that is read: 360 MB in memory. A file of a few kilobytes may claim as much."""
LARGEST_FILE = 500_000_000
"""Size of the largest file that is read [bytes]."""
PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
HEIC_ENDINGS = (".heic", ".heif")
HEIC_BRANDS = (b"ftypheic", b"ftypheix", b"ftypmif1", b"ftyphevc")
"""Bytes 4 to 12 of a HEIC file."""
RAW_ENDINGS = (
    ".3fr", ".arw", ".cr2", ".cr3", ".crw", ".dcr", ".dng", ".erf", ".iiq", ".kdc", ".mef", ".mos", ".mrw",
    ".nef", ".nrw", ".orf", ".pef", ".raf", ".raw", ".rw2", ".rwl", ".sr2", ".srf", ".srw", ".x3f",
)  # fmt: skip
KIND_TAG, DNG_TAG = 254, 50706
"""TIFF tags: 1 for a smaller copy of another picture of the file; version of DNG."""
SENSOR_BITS, LARGEST_16_BIT = (10, 12, 14), (1 << 16) - 1
"""Bits of cameras that save in files of 16 bits."""
FILM_DIAGONAL = math.hypot(36.0, 24.0)
"""Diagonal of the 35 mm film that cameras' focal lengths are converted to [mm]."""
FOCAL_LENGTH_TAG, WIDTH_TAG, HEIGHT_TAG, CAMERA_TAGS = 0xA405, 0xA002, 0xA003, 0x8769
"""EXIF tags: focal length on 35 mm film [mm], width and height of the picture as taken, their table."""
FRAMES, FRAME_ERROR = (4 / 3, 3 / 2, 16 / 9), 0.01
"""Longer over shorter side of cameras' pictures, and its relative error; pictures cut by hand have others."""
WIDEST = 0.635
"""Focal length over the longer side of the widest usual cameras: 22 mm on film; phones have 23 to 28."""
BROKEN = (OSError, ValueError, TypeError, SyntaxError)
"""Errors of Pillow on a file that it cannot read; an unidentified image is an OSError."""


def read_picture(path: str | Path) -> Picture:
    """Read a picture file as (rows, columns, 3) uint8 in blue-green-red, upright as its camera says (EXIF).

    HEIC needs the optional package pillow-heif.

    Raises
    ------
    PictureError
        When there is no such file, it is not a picture, or it has more than `MAXIMUM_PIXELS`.
    """
    file = Path(path)
    if not os.path.isfile(file):  # unlike Path.is_file, it accepts names that are too long
        problem = "not a regular file" if os.path.exists(file) else "no such file"
        if os.path.isdir(file):
            problem = "is a folder: name the files in it, e.g. FOLDER/*.jpg"
        raise PictureError(str(path), problem)
    if file.suffix.lower() in HEIC_ENDINGS or _is_heic(file):
        return _read_heic(file)
    if file.suffix.lower() in RAW_ENDINGS:
        raise _raw(file)
    if (length := file.stat().st_size) > LARGEST_FILE:
        raise PictureError(str(path), f"must have at most {LARGEST_FILE:,} bytes", f"{length:,}")
    # a file without a size in its header is not decoded: it may have any
    size, picture, content = _claimed_size(file), None, file.read_bytes()
    if size is None:
        raise PictureError(
            str(path), "not a picture in a known format (PNG, JPEG, TIFF, ...)", f"{length} bytes"
        )
    if _holds_its_chunks(content):
        _check_size(size, str(path))
        with suppress(cv2.error):
            picture = _decoded(np.frombuffer(content, dtype=np.uint8))
    if picture is None:
        problem = "the picture is damaged or cut off"
        if not cv2.haveImageReader(str(file)):
            problem = "a picture in a format that is not read here: save it as PNG or JPEG"
        raise PictureError(str(path), f"{problem} ({length} bytes)")
    return picture.astype(np.uint8, copy=False)


def _decoded(content: Picture) -> Any:
    """Decode a picture to eight bits; values of fewer bits in a file of 16 bits are scaled."""
    deep: Any = cv2.imdecode(content, cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH)
    brightest = int(deep.max()) if deep is not None and deep.dtype == np.uint16 else LARGEST_16_BIT
    bits = next((bits for bits in SENSOR_BITS if brightest < 1 << bits), 16)
    if deep is None or bits == 16:
        return cv2.imdecode(content, cv2.IMREAD_COLOR)
    return (deep >> (bits - 8)).astype(np.uint8)


def _is_heic(file: Path) -> bool:
    """Return whether a file is HEIC by its content: phones' pictures are often renamed to .jpg."""
    with file.open("rb") as opened:
        return opened.read(12)[4:] in HEIC_BRANDS


def _read_heic(file: Path) -> Picture:
    try:
        import pillow_heif
    except ImportError:
        problem = "HEIC needs pillow-heif (pip install 'dem-warp[heic]'), or save the picture as JPEG"
        raise PictureError(str(file), problem) from None
    try:
        image = pillow_heif.open_heif(file, convert_hdr_to_8bit=True)
        _check_size(image.size, str(file))
        colors = np.asarray(image)[:, :, :3]
    except (ValueError, OSError, RuntimeError, SyntaxError) as error:
        raise PictureError(str(file), f"not a HEIC picture: {error}") from None
    return np.ascontiguousarray(colors[:, :, ::-1])


def _check_size(size: tuple[int, int], place: str) -> None:
    if size[0] * size[1] > MAXIMUM_PIXELS:
        raise _too_large(place, f"{size[0]} x {size[1]}")


def _too_large(place: str, size: str) -> PictureError:
    problem = f"must have at most {MAXIMUM_PIXELS // 10**6} million pixels: save it smaller"
    return PictureError(place, problem, size)


def _raw(file: Path) -> PictureError:
    return PictureError(str(file), "is a camera's RAW file: develop it, and save it as JPEG, PNG or TIFF")


def _claimed_size(file: Path) -> tuple[int, int] | None:
    """Read columns and rows from a file's header, without decoding it; None without a known header.

    Raise PictureError for a camera's RAW file based on TIFF, whose first picture is a thumbnail.
    """
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(file) as image:
                tags = getattr(image, "tag_v2", {})
                size, is_raw = image.size, bool(tags.get(KIND_TAG, 0) & 1 or DNG_TAG in tags)
    except Image.DecompressionBombError:
        raise _too_large(str(file), "several times as many") from None
    except BROKEN:
        return None
    if is_raw:
        raise _raw(file)
    return size


def _holds_its_chunks(content: bytes) -> bool:
    """Return False for a PNG with a chunk longer than the file: OpenCV allocates what a chunk claims."""
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
    """Read the focal length [pixels] of a picture's camera (EXIF); None if it is missing or the picture cut.

    An uncut picture has the size that its camera wrote next to the focal length.
    """
    from PIL import Image

    if not os.path.isfile(path):  # opening a pipe would wait for its writer
        return None
    try:
        with warnings.catch_warnings(action="ignore"), Image.open(path) as image:
            tags = image.getexif().get_ifd(CAMERA_TAGS)
            size = sorted(image.size)
        film = float(tags.get(FOCAL_LENGTH_TAG, 0))
        taken = sorted(int(tags.get(tag, 0)) for tag in (WIDTH_TAG, HEIGHT_TAG))
    except (*BROKEN, Image.DecompressionBombError):
        return None
    if not (5.0 <= film <= 2000.0) or taken != size:
        return None
    return film / FILM_DIAGONAL * math.hypot(*size)


def least_focal_length(size: tuple[int, ...]) -> float | None:
    """Return the least focal length [pixels] of the camera of a whole picture; None if it was cut."""
    longer, shorter = max(size), min(size)
    whole = any(abs(longer / shorter - frame) < FRAME_ERROR * frame for frame in FRAMES)
    return WIDEST * longer if whole else None


def save_picture(path: str | Path, image: Picture) -> Path:
    """Write a picture in the format of the name's ending (.png, .jpg, ...), and return the path."""
    file = Path(path)
    try:
        written, data = cv2.imencode(file.suffix, image)
    except cv2.error:
        written = False
    if not written:
        raise PictureError(str(path), "must end in a picture format (.png, .jpg, ...)", repr(file.suffix))
    file.write_bytes(data.tobytes())
    return file
