"""XML with an element for each sphere: x, y, z and radius as attributes or as elements inside.

EDEM and others keep particle shapes like this, each under names of its own; names are read as a table's.
No file of EDEM itself was at hand to test this with.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from experiments.grains.spheres.sphere_file import LARGEST, Columns, Format, SphereFile, spheres_of
from experiments.grains.spheres.table import column_kind
from experiments.io.errors import InputError
from experiments.io.texts import read_text
from experiments.io.units import UNITS

_NEEDED = ("x", "y", "z")


def _recognises(head: str) -> bool:
    return head.lstrip().startswith("<")


def _read(path: Path) -> SphereFile:
    text = read_text(path, LARGEST)
    if re.search(r"<!(?:DOCTYPE|ENTITY)", text):
        raise InputError(str(path), "expected XML without a document type and entities", "one with them")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InputError(str(path), "needs well-formed XML", str(error)) from None
    found = list(_spheres(root))
    sizes = {"r" if "r" in entries else "d" for entries in found}
    if len(sizes) > 1:
        raise InputError(str(path), "expected all spheres have a radius, or all a diameter", "some of each")
    size = next(iter(sizes), "r")
    rows = ((n, [entries[kind] for kind in (*_NEEDED, size)]) for n, entries in enumerate(found, start=1))
    try:
        spheres, _ = spheres_of(rows, Columns(0, 1, 2, 3, is_diameter=size == "d"), path)
    except InputError as error:
        raise InputError(error.place.replace(", line ", ", sphere "), error.problem, error.value) from None
    named = {element.get(key) for element in root.iter() for key in ("unit", "units") if element.get(key)}
    lengths = [name for name in named if name in UNITS["length"]]
    if len(lengths) > 1:
        raise InputError(str(path), "expected one unit of length", ", ".join(sorted(lengths)))
    return SphereFile(
        "XML with an element for each sphere", spheres, unit=UNITS["length"][lengths[0]] if lengths else None
    )


def _spheres(element: ElementTree.Element) -> Iterator[dict[str, str]]:
    """Entries of every innermost element that has x, y, z and a size, in order."""
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


XML = Format("XML with an element for each sphere", _recognises, _read)
