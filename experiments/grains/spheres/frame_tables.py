"""Frames of numbers under a line of their own: extended XYZ, and the ``.data`` files of MercuryDPM."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from experiments.grains.spheres.sphere_file import TYPES, Columns, Format, SphereFile, spheres_of, text_of
from experiments.io.errors import InputError
from experiments.io.texts import is_number

_PROPERTIES = re.compile(r'\bProperties="?([\w:]+)', re.IGNORECASE)
MERCURY_HEAD, MERCURY_ROW = 8, 14
"""Numbers of a frame's first line, ``n time xmin ymin zmin xmax ymax zmax``, and of a particle in space."""
FRAMES = 10
"""Largest frames that a file may have: it is read whole."""


def _is_xyz(head: str) -> bool:
    lines = head.splitlines()[:2]
    return len(lines) == 2 and lines[0].strip().isdigit() and bool(_PROPERTIES.search(lines[1]))


def _is_mercury(head: str) -> bool:
    first, second = (line.split() for line in [*head.splitlines()[:2], "", ""][:2])
    is_frame = (len(first), len(second)) == (MERCURY_HEAD, MERCURY_ROW)
    return is_frame and first[0].isdigit() and all(map(is_number, first + second))


def _columns_of(line: str, path: Path) -> Columns:
    """Find the columns of positions and radius in the properties ``name:kind:count:...`` of extended XYZ."""
    words = _PROPERTIES.search(line)
    fields, start, at = words[1].split(":") if words else [], 0, {}
    for name, count in zip(fields[::3], fields[2::3], strict=False):
        at[name.lower()] = start
        start += int(count) if count.isdigit() else 1
    size = next((name for name in ("radius", "radii", "diameter") if name in at), None)
    if "pos" not in at or size is None:
        raise InputError(f"{path}, line 2", "needs the properties pos and radius (or diameter)", line.strip())
    x, types = at["pos"], next((at[name] for name in TYPES if name in at), None)
    return Columns(x, x + 1, x + 2, at[size], is_diameter=size == "diameter", type=types)


def _last_frame(path: Path, heads: int) -> tuple[list[str], Iterator[tuple[int, list[str]]]]:
    """Return the lines above the last whole frame of a file, and its numbered rows."""
    lines, at, found = text_of(path, FRAMES).splitlines(), 0, None
    while at < len(lines) and (count := lines[at].split()[:1]) and count[0].isdigit():
        begin, end = at + heads, at + heads + int(count[0])
        if end > len(lines):
            break
        found = lines[at:begin], ((n + 1, lines[n].split()) for n in range(begin, end))
        at = end
    if found is None:
        raise InputError(str(path), "has no whole frame: the number of its first line exceeds its rows")
    return found


def _read_xyz(path: Path) -> SphereFile:
    heads, rows = _last_frame(path, 2)
    return spheres_of("extended XYZ, the last frame", rows, _columns_of(heads[1], path), path)


def _read_mercury(path: Path) -> SphereFile:
    _, rows = _last_frame(path, 1)
    columns = Columns(0, 1, 2, 6, type=MERCURY_ROW - 1)
    return spheres_of("data of MercuryDPM, the last frame", rows, columns, path)


XYZ = Format("extended XYZ", _is_xyz, _read_xyz)
MERCURY = Format("data of MercuryDPM", _is_mercury, _read_mercury)
