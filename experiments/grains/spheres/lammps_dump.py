"""Text dumps of LIGGGHTS and LAMMPS (``dump custom``, ``dump yaml``): the last complete frame.

Columns and scaling follow the manuals of LAMMPS (``dump``) and LIGGGHTS: x or xu are lengths, xs and xsu
parts of the box.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from experiments.grains.spheres.sphere_file import LARGEST, TYPES, Columns, Format, SphereFile, spheres_of
from experiments.io.errors import InputError
from experiments.io.files import check_file

PLACES = ("x", "xu", "xs", "xsu")
"""Columns of a place, in order of preference."""
_SIZE = re.compile(r"(?:[vcfd]_)?(?:radius|diameter)|[vcfd]_(?:r|rad|d|diam)")
"""Column of the size: an attribute, or a variable, compute, fix or own property with such a name."""
BODIES = ("id_multisphere", "mol")
"""Columns of a clump's number."""
UNITS_OF = {"si": 1.0, "cgs": 1e-2, "micro": 1e-6, "nano": 1e-9}
"""Size of a unit of length [m] in LAMMPS's systems of units."""


@dataclass
class _Frame:
    line: int
    items: dict[str, list[str]] = field(default_factory=dict)
    """Lines of each item, by its name."""
    columns: list[str] = field(default_factory=list)
    first_row: int = 0

    @property
    def step(self) -> str:
        return next(iter(self.items.get("TIMESTEP", [])), "?")

    @property
    def is_whole(self) -> bool:
        [count] = self.items.get("NUMBER OF ATOMS", ["-1"])[:1] or ["-1"]
        return count.isdigit() and len(self.items.get("ATOMS", [])) == int(count)


def _frames(path: Path) -> Iterator[_Frame]:
    """Yield the frames, with one in memory at a time.

    An item that a frame has already begins the next: LAMMPS writes UNITS (once) and TIME before TIMESTEP.
    """
    frame, rows = _Frame(1), []
    with path.open(encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, start=1):
            if not line.startswith("ITEM:"):
                rows.append(line.rstrip("\n"))
                continue
            item, rows = " ".join(line.split()[1:]), []
            name = next((each for each in ITEMS.values() if f"{item} ".startswith(f"{each} ")), item)
            columns = item.removeprefix(name).split()
            if name in frame.items:
                yield frame
                frame = _Frame(number, {key: frame.items[key] for key in ("UNITS",) if key in frame.items})
            frame.items[name] = rows
            frame.items[f"{name} columns"] = columns
            if name == "ATOMS":
                frame.columns, frame.first_row = columns, number + 1
    yield frame


ITEMS = {
    "timestep": "TIMESTEP", "units": "UNITS", "natoms": "NUMBER OF ATOMS", "box": "BOX BOUNDS",
    "data": "ATOMS",
}  # fmt: skip
"""Keys of ``dump yaml`` (https://docs.lammps.org/dump.html) that a text dump has too."""


def _yaml_frames(path: Path) -> Iterator[_Frame]:
    """Yield the frames of ``dump yaml`` as those of a text dump."""
    frame, rows = _Frame(1), [""]
    with path.open(encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, start=1):
            key, _, value = line.partition(":")
            if line.startswith("---") and frame.items:
                yield frame
                frame = _Frame(number)
            elif line[0].isalpha():
                rows = [value.strip()] if value.strip() else []
                frame.items[ITEMS.get(key, key)] = rows
                frame.columns = _cells(value) if key == "keywords" else frame.columns
                frame.first_row = number + 1
            elif line.lstrip().startswith("- ["):
                rows.append(" ".join(_cells(line.partition("-")[2])))
    yield frame


def _cells(row: str) -> list[str]:
    return row.translate(str.maketrans("[],", "   ")).split()


def _read(path: Path, frames: Callable[[Path], Iterator[_Frame]] = _frames) -> SphereFile:
    count, chosen, last = 0, None, None
    for frame in frames(path):
        count, last = count + 1, frame
        if frame.is_whole and frame.columns:
            chosen, position = frame, count
    if chosen is None or last is None:
        problem = "has no complete frame: ITEM: ATOMS needs as many lines as its NUMBER OF ATOMS"
        raise InputError(str(path), problem)
    description = f"LIGGGHTS or LAMMPS dump, frame {position} of {count} (timestep {chosen.step})"
    if chosen is not last:
        description += ", the last complete one"
    return _spheres(chosen, description, path)


def read_looks(path: Path) -> Iterator[tuple[int, SphereFile]]:
    """Yield the step and the spheres of each frame of a text dump; raise InputError for an incomplete one."""
    check_file(path, LARGEST)
    for frame in _frames(path):
        if not (frame.is_whole and frame.columns and frame.step.isdecimal()):
            raise InputError(f"{path}, line {frame.line}", "must be a complete frame with its time step")
        yield int(frame.step), _spheres(frame, f"timestep {frame.step}", path)


def _spheres(frame: _Frame, description: str, path: Path) -> SphereFile:
    lengths, scaled = _columns(frame.columns, f"{path}, line {frame.first_row - 1}")
    rows = ((frame.first_row + n, row.split()) for n, row in enumerate(frame.items["ATOMS"]))
    read = spheres_of(description, rows, lengths, path)
    if scaled:
        low, high = _box(frame, f"{path}, line {frame.line}")
        read.spheres[:, :3] = low + read.spheres[:, :3] * (high - low)
    unit = UNITS_OF.get(next(iter(frame.items.get("UNITS", [])), "").strip())
    alone = read.bodies is not None and not read.bodies.any()
    return replace(read, bodies=None if alone else read.bodies, unit=unit)


def _columns(names: list[str], place: str) -> tuple[Columns, bool]:
    """Find the columns of the numbers; return them, and True if positions are parts of the box."""
    start = next((name for name in PLACES if all(axis + name[1:] in names for axis in "xyz")), None)
    size = next((name for name in names if _SIZE.fullmatch(name)), None)
    if start is None or size is None:
        problem = "needs the columns x y z (or xu, xs) and radius (or diameter)"
        hint = "Add radius to the dump's columns; a variable v_radius will do."
        raise InputError(place, problem, " ".join(names) or "no columns", hint)
    x, y, z = (names.index(axis + start[1:]) for axis in "xyz")
    body = next((names.index(name) for name in BODIES if name in names), None)
    types = next((names.index(name) for name in TYPES if name in names), None)
    is_diameter = size.rpartition("_")[2].startswith("d")
    return Columns(x, y, z, names.index(size), is_diameter, body, types), start in ("xs", "xsu")


def _box(frame: _Frame, place: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of a frame's box."""
    rows = [row.split() for row in frame.items.get("BOX BOUNDS", [])]
    kinds = frame.items.get("BOX BOUNDS columns", [])
    if "xy" in kinds or "abc" in kinds:
        found = f"BOX BOUNDS {' '.join(kinds)}"
        raise InputError(place, "positions in a tilted box are not supported", found, "Dump x y z.")
    try:
        low, high = np.array(rows, dtype=np.float64)[:3, :2].T
    except ValueError:
        problem = "BOX BOUNDS must have a lowest and a highest number for x, y and z"
        raise InputError(place, problem, str(rows)) from None
    return low, high


DUMP = Format("dump of LIGGGHTS or LAMMPS", lambda head: head.startswith("ITEM:"), _read)
YAML_DUMP = Format(
    "dump yaml of LAMMPS",
    lambda head: head.startswith("---\ncreator: LAMMPS"),
    partial(_read, frames=_yaml_frames),
)
