"""Lines ``x y z r``: dem-warp's clumps, multisphere templates of LIGGGHTS, and others."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from experiments.grains.spheres.sphere_file import (
    SPHERE_RULE,
    Columns,
    Format,
    SphereFile,
    content_lines,
    spheres_of,
    text_of,
)
from experiments.io.errors import InputError
from experiments.io.texts import delimiter_of, is_number, split
from experiments.io.units import UNITS

_DIAMETERS = re.compile(r"^[ \t]*#.*\bx[,; \t]+y[,; \t]+z[,; \t]+d", re.MULTILINE | re.IGNORECASE)
_NAMED_UNIT = re.compile(
    rf"^[ \t]*#(?>.*?\bx,? y,? z,? r\b).*?\bin ({'|'.join(UNITS['length'])})\b", re.MULTILINE
)
"""Unit in a comment of dem-warp, after the names of the columns."""


def _recognises(head: str) -> bool:
    lines = content_lines(head)
    if not lines:
        return False
    line = lines[0][1]
    delimiter = delimiter_of(line)
    cells = split(line, delimiter)
    return len(cells) > 2 and sum(is_number(cell, delimiter) for cell in cells) > 2


def _read(path: Path) -> SphereFile:
    text = text_of(path)
    lines = content_lines(text)
    delimiter = delimiter_of(lines[0][1])
    for number, line in lines:
        if len(cells := split(line, delimiter)) != 4:
            raise InputError(f"{path}, line {number}", SPHERE_RULE, " ".join(cells))
    rows = ((number, split(line, delimiter)) for number, line in lines)
    description = "spheres (x y z r, as in multisphere templates of LIGGGHTS)"
    columns = Columns(0, 1, 2, 3, is_diameter=bool(_DIAMETERS.search(text)))
    if columns.is_diameter:
        description = "spheres (x y z d, by a comment)"
    read = spheres_of(description, rows, columns, path, delimiter)
    named = _NAMED_UNIT.search(text)
    return replace(read, unit=UNITS["length"][named[1]] if named else None)


PLAIN = Format("lines x y z r", _recognises, _read)
