"""Reading of a file of spheres in any format, compressed by gzip or not."""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, cast

from experiments.grains.spheres.column_table import TABLE
from experiments.grains.spheres.frame_tables import MERCURY, XYZ
from experiments.grains.spheres.lammps_dump import DUMP, YAML_DUMP
from experiments.grains.spheres.numpy_file import NUMPY
from experiments.grains.spheres.plain_lines import PLAIN
from experiments.grains.spheres.sphere_file import LARGEST, Format, SphereFile
from experiments.grains.spheres.vtk_file import VTK
from experiments.grains.spheres.xml_table import XML
from experiments.grains.spheres.yade_file import YADE_TEMPLATE, YADE_TEXT
from experiments.io.errors import InputError
from experiments.io.files import check_file
from experiments.io.texts import decoded

FORMATS: tuple[Format, ...] = (
    DUMP,
    YAML_DUMP,
    VTK,
    NUMPY,
    YADE_TEXT,
    YADE_TEMPLATE,
    XML,
    XYZ,
    MERCURY,
    PLAIN,
    TABLE,
)
"""Formats in order; the first that recognises a file reads it."""
HEAD = 65536
"""Number of first bytes of a file that show its format."""
GZIP = b"\x1f\x8b"
"""First bytes of a file that is compressed by gzip."""

_POINTS = "Write its points as a table of x, y, z, radius."
_CUSTOM = "Write a custom dump with x y z radius."
_BINARY = ("a binary dump of LAMMPS or LIGGGHTS", "Write a text dump: a name that does not end in .bin.")
_VIDEO = ("a video", "Save one frame as PNG or JPEG.")
_PACKED = ("a compressed file", "Decompress it, or compress it by gzip.")
OTHERS = {
    "LAMMPSCUSTOM": _BINARY,
    "DUMPCUSTOM": _BINARY,
    "LammpS RestartT": ("a restart file of LAMMPS or LIGGGHTS", _CUSTOM),
    "LAMMPS data file": ("a data file of LAMMPS", _CUSTOM),
    "Atoms. Timestep": ("an XYZ dump of LAMMPS or LIGGGHTS, without radii", _CUSTOM),
    "Number of particles =": ("an AtomEye configuration (cfg)", _CUSTOM),
    "\x89HDF": ("an HDF5 file", "Export centres and radii as VTK or CSV."),
    "CDF": ("a NetCDF file", "Export centres and radii as VTK or CSV."),
    **dict.fromkeys(("BZh", "\x28\xb5\x2f\xfd", "\xfd7zXZ", "7z\xbc\xaf", "Rar!"), _PACKED),
    **dict.fromkeys(("ply\n", "ply\r\n"), ("a PLY file", _POINTS)),
    **dict.fromkeys((".PCD v", "VERSION .", "VERSION 0."), ("a PCD file", _POINTS)),
    "%PDF": ("a PDF", "Save its picture as PNG or JPEG."),
    "PK\x03\x04": (
        "a ZIP archive or an Office document",
        "Take the file out of it, or save the sheet as CSV.",
    ),
    **dict.fromkeys(("ftypisom", "ftypmp4", "ftypqt", "ftypM4V", "ftyp3g", "AVI LIST"), _VIDEO),
    **dict.fromkeys(("\0\0\1\xba", "\x1aE\xdf\xa3"), _VIDEO),
}
"""Names of other formats, with a hint, by a mark in their first 32 bytes."""

WEB = ("<!doctype html", "<html")
PCD = ("# .pcd v", "version .", "version 0.")
"""Beginnings of a web page, which a download with an error often is, and of points that look like a table."""


@contextmanager
def _opened(path: Path, largest: int = LARGEST) -> Iterator[IO[bytes]]:
    """Open a file, or what gzip has compressed in it."""
    try:
        check_file(path, largest)
        with path.open("rb") as file:
            packed = file.peek(len(GZIP)).startswith(GZIP)
            yield cast(IO[bytes], gzip.GzipFile(fileobj=file)) if packed else file
    except (OSError, EOFError, zlib.error) as error:
        problem = getattr(error, "strerror", None) or str(error)
        raise InputError(str(path), f"cannot be read: {problem}") from None


def head_of(path: Path) -> str:
    """Return the first bytes of a file, decompressed, as text of Latin-1; where they are cut, whole lines."""
    with _opened(path) as file:
        data = file.read(HEAD)
    head = data.removeprefix(b"\xef\xbb\xbf").decode("latin-1")
    # A format of text needs complete lines.
    return head if len(data) < HEAD or "\0" in head else head.rpartition("\n")[0] or head


def format_of(path: Path) -> Format | None:
    """Find the format of a file by its content; None if it has none of `FORMATS`."""
    head = head_of(path)
    if head.lstrip().lower().startswith((*WEB, *PCD)):
        return None
    if VTK.recognises(head):
        return VTK
    return next((each for each in ([NUMPY] if "\0" in head else FORMATS) if each.recognises(head)), None)


def require_known(path: Path) -> None:
    """Raise InputError with the name of a format that is neither a picture's nor one of `FORMATS`."""
    start = head_of(path)[:32] if path.is_file() else ""
    if path.is_file() and path.stat().st_size == 0:
        raise InputError(str(path), "is empty")
    for mark, (name, hint) in OTHERS.items():
        if mark in start:
            raise InputError(str(path), f"is {name}, neither a picture nor a file of spheres", hint=hint)
    if path.suffix == ".bin" and "\0" in start:  # that of LIGGGHTS has no mark
        name, hint = _BINARY
        raise InputError(str(path), f"seems to be {name}", hint=hint)
    if start.lstrip().lower().startswith(WEB):
        raise InputError(str(path), "is a web page", hint="Download the file that the page shows.")


def require_no_text(path: Path) -> None:
    """Raise InputError for a text, which is no picture."""
    head = head_of(path) if path.is_file() else ""
    start = " ".join(head[:32].split())
    if start and "\0" not in head and start.isascii() and start.isprintable():
        problem = "is text, neither a picture nor a file of spheres"
        raise InputError(str(path), problem, hint="A table needs columns x, y, z and a radius or a diameter.")


def read_spheres(path: Path, largest: int = LARGEST) -> SphereFile:
    """Read a file of spheres in the format of its content, which gzip may have compressed.

    Raise InputError for a file of more than `largest` bytes, before it is read.
    """
    with _opened(path, largest):
        found = format_of(path)
    if found is None:
        require_known(path)
        with _opened(path) as file:
            decoded(file.read(HEAD), str(path))
        known = "; ".join(each.name for each in FORMATS)
        raise InputError(str(path), f"not a file of spheres ({known})")
    with _opened(path) as file:
        if not isinstance(file, gzip.GzipFile):
            return found.read(path)
        return _read_copy(file, path, found, largest)


def _read_copy(packed: IO[bytes], path: Path, found: Format, largest: int) -> SphereFile:
    with TemporaryDirectory() as folder:
        copy = Path(folder) / path.name.removesuffix(".gz")
        with copy.open("wb") as unpacked:
            for block in iter(partial(packed.read, 1 << 20), b""):
                unpacked.write(block)
                if unpacked.tell() > largest:
                    raise InputError(str(path), f"must have at most {largest:,} bytes when decompressed")
        try:
            return found.read(copy)
        except InputError as error:
            raise InputError.of(
                replace(each, place=each.place.replace(str(copy), str(path))) for each in error.problems
            ) from None
