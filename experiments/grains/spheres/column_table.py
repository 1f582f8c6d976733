"""Tables with a header: clumps and spheres of DEM-Engine (CSV), tables of EDEM, ParaView and spreadsheets.

DEM-Engine's clumps have the columns ``x,y,z,r`` (``data/clumps/*.csv`` of its repository), its spheres
``X,Y,Z,r,...``. EDEM writes spheres as text with physical radius and position X, Y, Z, and results as CSV
under lines of text (not tested with a file of EDEM itself). Columns are found by their names. Sheets of
``dem-warp export`` have a column with the unit.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from experiments.grains.spheres.sphere_file import (
    TYPES,
    Columns,
    Format,
    Row,
    SphereFile,
    content_lines,
    spheres_of,
    text_of,
)
from experiments.io.errors import InputError
from experiments.io.texts import split
from experiments.io.units import UNITS, unit_size

HEADER_LINES = 60
"""Largest number of the line with the names of the columns."""
HEADER_DELIMITERS = (";", "\t", ",", None)
"""Delimiters of names, in the order in which they are tried: names may contain blanks."""
_PLACE = r"(?:particle|sphere)?(?:position|pos|center|centre|coordinate|coord|points)?"
_SIZE = r"(?:particle|sphere|physical)*"
_NAMES = {
    **{
        axis: rf"{_PLACE}(?:{axis}|{n})|(?:particle|sphere)?{axis}(?:position|pos|coordinate|coord)?"
        for n, axis in enumerate("xyz")
    },
    "r": rf"{_SIZE}(?:radius|radii|rad|r)",
    "d": rf"{_SIZE}(?:diameter|d)|particlesize",
    "time": "t|times?|t?steps?|timesteps?|frames?",
    "body": "clumpid|idmultisphere|mol|grain|owner|particleid|clump",
    "type": "|".join(TYPES),
}
SHEET_UNIT, SHEET_SHAPE = "unit", "shape"
"""Columns of a sheet of ``dem-warp export``: the unit, and the sphere's shape."""
_UNIT = re.compile(r"[(\[]([^()\[\]]*)[)\]]")


def column_kind(name: str) -> str | None:
    """Return the kind of a column or an entry: x, y, z, r(adius), d(iameter), body; or None."""
    plain = re.sub(r"^q\d+", "", re.sub(r"[^a-z0-9]", "", _UNIT.sub("", name).lower()))
    return next((kind for kind, pattern in _NAMES.items() if plain and re.fullmatch(pattern, plain)), None)


def _find_header(text: str) -> tuple[int, list[str], str | None] | None:
    """Find the line with the names; return its number, cells and delimiter, or None."""
    for number, line in content_lines(text)[:HEADER_LINES]:
        for delimiter in HEADER_DELIMITERS:
            cells = split(line, delimiter)
            kinds = {column_kind(cell) for cell in cells}
            if {"x", "y", "z"} <= kinds and kinds & {"r", "d"}:
                return number, cells, delimiter
    return None


def _looks_like_a_table(head: str) -> bool:
    if _find_header(head):
        return True
    lines = content_lines(head)
    return bool(lines) and any(len(split(lines[0][1], mark)) > 3 for mark in (";", "\t", ","))


def _read(path: Path) -> SphereFile:
    text = text_of(path)
    found = _find_header(text)
    if found is None:
        lines = content_lines(text)
        received = lines[0][1] if lines else "an empty file"
        problem = "needs the columns x, y, z and radius (or diameter)"
        raise InputError(f"{path}, line {lines[0][0] if lines else 1}", problem, received)
    header, names, delimiter = found
    kinds = [column_kind(name) for name in names]
    size = "r" if "r" in kinds else "d"
    x, y, z, r = (kinds.index(kind) for kind in ("x", "y", "z", size))
    body, types = (kinds.index(kind) if kind in kinds else None for kind in ("body", "type"))
    columns = Columns(x, y, z, r, size == "d", body, types)
    rows: Iterable[Row] = [(n, split(line, delimiter)) for n, line in content_lines(text) if n > header]
    for line, cells in rows:
        if delimiter is None and len(cells) != len(names):
            problem = f"must have as many cells as line {header} has names, {len(names)}"
            raise InputError(f"{path}, line {line}", problem, " ".join(cells), "Names must have no blanks.")
    if "time" in kinds:
        times = [cells[kinds.index("time") :][:1] for _, cells in rows]
        if (name := names[kinds.index("time")]) == "t" and kinds.index("time") > x and times[0] != times[-1]:
            problem = "must say whether it is a time or a type"
            raise InputError(f"{path}, line {header}", problem, name, "Call the column time, or type.")
        rows = [row for row, time in zip(rows, times, strict=True) if time == times[-1]]
    for kind, at in zip(("x", "y", "z", size), (x, y, z, r), strict=True):
        for other in (n for n, each in enumerate(kinds) if each == kind):
            if any(cells[other : other + 1] != cells[at : at + 1] for _, cells in rows):
                problem, twice = f"must have one column {kind}", f"{names[at]}, {names[other]}"
                raise InputError(f"{path}, line {header}", problem, twice, "Rename the others.")
    sizes = [_unit_of(names[column], f"{path}, line {header}") for column in columns.needed()[:4]]
    if SHEET_UNIT in names:
        sizes = [_unit_of_rows(rows, names.index(SHEET_UNIT), path)] * 4
        if columns.body is None and SHEET_SHAPE in names:
            columns = replace(columns, body=names.index(SHEET_SHAPE))
    last = ", the last time" if "time" in kinds else ""
    description = f"table of spheres ({', '.join(names[column] for column in columns.needed())}){last}"
    read = spheres_of(description, rows, columns, path, delimiter)
    if not any(sizes):
        return read
    if not all(sizes):
        problem = "either all of x, y, z and radius must have a unit, or none of them"
        raise InputError(f"{path}, line {header}", problem, ", ".join(names))
    if len(set(sizes)) == 1:
        return replace(read, unit=sizes[0])
    return replace(read, spheres=read.spheres * np.array(sizes, dtype=np.float64), unit=1.0)


def _unit_of_rows(rows: Iterable[Row], column: int, path: Path) -> float:
    """Return the size of the common unit of all rows of a sheet [m]."""
    first: str | None = None
    for line, cells in rows:
        name = cells[column] if len(cells) > column else ""
        if name not in UNITS["length"] or name != (first := first or name):
            problem = f"every row must have the same unit of length ({', '.join(UNITS['length'])})"
            raise InputError(f"{path}, line {line}", problem, name)
    return UNITS["length"][first or "m"]


def _unit_of(name: str, place: str) -> float | None:
    """Size of the unit in a column's name [m], or None."""
    match = _UNIT.search(name)
    unit = match[1].strip() if match else ""
    try:
        return unit_size(unit, "length") if unit else None
    except ValueError:
        problem = f"must have a unit of length ({', '.join(UNITS['length'])})"
        raise InputError(place, problem, name) from None


TABLE = Format("table with the columns x, y, z, radius", _looks_like_a_table, _read)
