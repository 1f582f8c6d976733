"""Files of Yade: ``export.text``, ``textExt`` and ``textClumps``, and clump templates in its scripts.

The formats are those of Yade 2023.02a, ``yade/export.py``; a clump template is
``clumpTemplate(relRadii=[...], relPositions=[[...], ...])``, with relative numbers.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path

import numpy as np

from experiments.grains.spheres.sphere_file import (
    Columns,
    Format,
    SphereFile,
    content_lines,
    spheres_of,
    text_of,
)
from experiments.io.errors import InputError
from experiments.io.texts import read_text

_HEADER = "#format"
LAYOUTS = {
    "x_y_z_r": Columns(0, 1, 2, 3),
    "x_y_z_r_matId": Columns(0, 1, 2, 3, type=4),
    "x_y_z_r_attrs": Columns(0, 1, 2, 3),
    "id_x_y_z_r_matId": Columns(1, 2, 3, 4, type=5),
    "x_y_z_r_clumpId": Columns(0, 1, 2, 3, body=4),
}
"""Columns of each of Yade's formats."""


def _read_text(path: Path) -> SphereFile:
    text = text_of(path)
    name = text.partition("\n")[0].removeprefix(_HEADER).strip()
    if name not in LAYOUTS:
        problem = f"must be a format of Yade with spheres ({', '.join(LAYOUTS)})"
        raise InputError(f"{path}, line 1", problem, name)
    rows = ((number, line.split()) for number, line in content_lines(text))
    return spheres_of(f"Yade's text format {name}", rows, LAYOUTS[name], path)


def _read_template(path: Path) -> SphereFile:
    try:
        tree = ast.parse(read_text(path))
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise InputError(str(path), f"not a Python script: {error}") from None
    calls = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("clumpTemplate")
    ]
    if len(calls) != 1:
        problem = "must have one clumpTemplate(relRadii, relPositions)"
        raise InputError(str(path), problem, str(len(calls)))
    [call] = calls
    place = f"{path}, line {call.lineno}"
    given = dict(zip(("relRadii", "relPositions"), call.args, strict=False))
    given |= {word.arg: word.value for word in call.keywords if word.arg}
    try:
        radii = np.array(ast.literal_eval(given["relRadii"]), dtype=np.float64)
        centers = np.array(ast.literal_eval(given["relPositions"]), dtype=np.float64)
    except (KeyError, ValueError, TypeError):
        problem = "clumpTemplate needs relRadii and relPositions, both lists of plain numbers"
        raise InputError(place, problem, ast.unparse(call)) from None
    if radii.ndim != 1 or centers.shape != (len(radii), 3):
        problem = "clumpTemplate needs a radius and a position (x, y, z) for each sphere"
        raise InputError(place, problem, f"shapes {radii.shape} and {centers.shape}")
    rows = ((call.lineno, row.astype(str).tolist()) for row in np.column_stack([centers, radii]))
    description = "clump template of Yade (relative sizes: --unit is the size of 1)"
    return spheres_of(description, rows, Columns(0, 1, 2, 3), path)


YADE_TEXT = Format("text of Yade", lambda head: head.startswith(_HEADER), _read_text)
YADE_TEMPLATE = Format(
    "clump template of Yade", lambda head: bool(re.search(r"\bclumpTemplate\s*\(", head)), _read_template
)
