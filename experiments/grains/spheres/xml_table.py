"""XML with an element for each sphere: x, y, z and radius as attributes or inner elements.

EDEM and others store particle shapes like this, with different names, which are read like a table's (not
tested with a file of EDEM itself).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

from experiments.grains.spheres.column_table import column_kind
from experiments.grains.spheres.sphere_file import Columns, Format, SphereFile, spheres_of
from experiments.io.errors import InputError
from experiments.io.texts import read_text
from experiments.io.units import UNITS

_NEEDED = ("x", "y", "z")
LARGEST_XML = 100_000_000
"""Bytes of the largest file, whose tree takes ten times as many: a million spheres."""


def _read(path: Path) -> SphereFile:
    text = read_text(path, LARGEST_XML)
    if re.search(r"<!(?:DOCTYPE|ENTITY)", text):
        raise InputError(str(path), "XML with a document type or entities is not read")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InputError(str(path), f"not well-formed XML: {error}") from None
    found = list(_spheres(root))
    sizes = {"r" if "r" in entries else "d" for entries in found}
    if len(sizes) > 1:
        raise InputError(str(path), "either all spheres must have a radius, or all a diameter")
    size = next(iter(sizes), "r")
    rows = ((n, [entries[kind] for kind in (*_NEEDED, size)]) for n, entries in enumerate(found, start=1))
    columns, title = Columns(0, 1, 2, 3, is_diameter=size == "d"), "XML with an element for each sphere"
    read = spheres_of(title, rows, columns, path, kind="sphere")
    named = {element.get(key) for element in root.iter() for key in ("unit", "units") if element.get(key)}
    lengths = [name for name in named if name in UNITS["length"]]
    if len(lengths) > 1:
        raise InputError(str(path), "must have only one unit of length", ", ".join(sorted(lengths)))
    return replace(read, unit=UNITS["length"][lengths[0]] if lengths else None)


def _spheres(element: ElementTree.Element) -> Iterator[dict[str, str]]:
    """Yield the entries of every innermost element with x, y, z and a size, in order."""
    inner = [sphere for child in element for sphere in _spheres(child)]
    if inner:
        yield from inner
        return
    entries = dict(_entries(element))
    if all(kind in entries for kind in _NEEDED) and ("r" in entries or "d" in entries):
        yield entries


def _entries(element: ElementTree.Element) -> Iterator[tuple[str, str]]:
    for part in element.iter():
        pairs = [*part.attrib.items(), (part.tag.rpartition("}")[2], (part.text or "").strip())]
        for name, value in pairs:
            kind = column_kind(name)
            if kind and value:
                yield kind, value


XML = Format("XML with an element for each sphere", lambda head: head.lstrip().startswith("<"), _read)
