"""Reading of a file of spheres in any format."""

from __future__ import annotations

from pathlib import Path

from experiments.grains.spheres.column_table import TABLE
from experiments.grains.spheres.lammps_dump import DUMP
from experiments.grains.spheres.plain_lines import PLAIN
from experiments.grains.spheres.sphere_file import LARGEST, Format, SphereFile
from experiments.grains.spheres.vtk_file import VTK
from experiments.grains.spheres.xml_table import XML
from experiments.grains.spheres.yade_file import YADE_TEMPLATE, YADE_TEXT
from experiments.io.errors import InputError
from experiments.io.files import check_file
from experiments.io.texts import decoded

FORMATS: tuple[Format, ...] = (DUMP, VTK, YADE_TEXT, YADE_TEMPLATE, XML, PLAIN, TABLE)
"""Formats in order; the first that recognises a file reads it."""
HEAD = 65536
"""Number of first bytes of a file that show its format."""


def format_of(path: Path) -> Format | None:
    """Find the format of a file by its content; None if it has none of `FORMATS`."""
    try:
        check_file(path, LARGEST)
        with path.open("rb") as file:
            data = file.read(HEAD)
    except OSError as error:
        raise InputError(str(path), f"cannot be read: {error.strerror or error}") from None
    head = data.removeprefix(b"\xef\xbb\xbf").decode("latin-1")
    binary_vtk = head.startswith("# vtk DataFile") or "<VTKFile" in head[:4096]
    if "\0" in head and not binary_vtk:
        return None
    # A format needs complete lines.
    whole = head if len(data) < HEAD else head.rpartition("\n")[0]
    return next((each for each in FORMATS if each.recognises(whole)), None)


def read_spheres(path: Path) -> SphereFile:
    """Read a file of spheres in the format of its content."""
    found = format_of(path)
    if found is not None:
        return found.read(path)
    with path.open("rb") as file:
        decoded(file.read(HEAD), str(path))
    known = "; ".join(each.name for each in FORMATS)
    raise InputError(str(path), f"not a file of spheres ({known})")
