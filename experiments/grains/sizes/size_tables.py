"""Tables of sizes: sieve analyses, and counts of an image analyser."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from experiments.grains.sizes.distribution import Tabulated
from experiments.io.errors import InputError
from experiments.io.rows import Row, read_rows
from experiments.io.units import Quantity

ROUNDING = 0.5
"""Largest deviation of a sum of rounded percentages from 100 [%]."""

SIEVE_COLUMNS = (
    "opening", "number", "retained", "retained_percent", "passing_percent", "cumulative_retained_percent",
)  # fmt: skip
COUNT_COLUMNS = ("diameter", "from", "to", "count")
PANS = ("pan", "receiver", "tray", "bottom", "base", "fines", "boden", "pfanne", "schale", "fond", "bandeja")
SUMS = ("total", "sum", "somm", "gesamt")
"""Beginnings of openings in words: none at all, and rows that are no sieves."""
_HEADS = {
    "opening": "opening|aperture|(?<!under)(?<!over)size|diamet|weite|korngr|kornkl|durchmesser|maille"
    "|ouverture|abertura|malla|^(sieve|sieb|tamis|tamiz|class|klasse|range|mesh)$",
    "passing": "passing|finer|undersize|durchgang|passant|tamisat|pasa",
    "retained": "retain|oversize|ruckstand|refus|reteni|anteil",
    "mass": "^(mass|masse|masa|weight|gewicht|poids|peso)$",
    "cumulative": "cum|kum|summe|oversize",
    "share": "%|percent|prozent|pourcent|porcent",
}
"""Names of columns in English, German, French and Spanish, without accents."""
_MESHES = {
    "3.5": 5.6, "4": 4.75, "5": 4.0, "6": 3.35, "7": 2.8, "8": 2.36, "10": 2.0, "12": 1.7, "14": 1.4,
    "16": 1.18, "18": 1.0, "20": 0.85, "25": 0.71, "30": 0.6, "35": 0.5, "40": 0.425, "45": 0.355, "50": 0.3,
    "60": 0.25, "70": 0.212, "80": 0.18, "100": 0.15, "120": 0.125, "140": 0.106, "170": 0.09, "200": 0.075,
    "230": 0.063, "270": 0.053, "325": 0.045, "400": 0.038, "450": 0.032, "500": 0.025, "635": 0.02,
}  # fmt: skip
"""Opening of each sieve by its number [mm]: ASTM E11, table 1, alternative designations."""
_MESH = re.compile(r"(?:#|no\.?)\s*([\d.]+)|([\d.]+)[\s-]*mesh", re.IGNORECASE)
_UNIT = re.compile(r"[(\[]([^()\[\]]*)[)\]]|[\s,/]+(?:in |en )?([mµu]m|k?g|%)$")
"""Unit in the brackets of a column's name, or at its end."""
_CLASS = re.compile(r"([\d.]+)\s*(?:[mµμu]m)?\s*(?:[-–—…]|\.\.+|to|bis|à|a)\s*([\d.]+)\s*([a-zµμ]*)")
"""Class of grains between two openings."""


def read_sieves(path: Path, unit: str | None = None) -> tuple[Tabulated, float]:
    """Read a sieve analysis with one sieve per row, in any order, as laboratories write it.

    Columns: ``opening``, and one of ``retained`` (mass on the sieve), ``retained_percent``,
    ``passing_percent`` and ``cumulative_retained_percent``, or what sheets call them (see `_sieve_column`);
    of several the first in this order counts. The opening of a pan is 0 or in words, here or as its
    ``number``; ``#40`` and ``40 mesh`` are of ASTM E11; ``2-4.75`` is what a sieve of 2 retains below one of
    4.75. ``unit`` is that of openings without one. Return the distribution by mass between the finest and
    the coarsest opening, and the part of the mass beyond them.
    """
    header = UnitHeader(_sieve_column)
    found = list(read_rows(path, ("opening",), SIEVE_COLUMNS, header))
    column = next((name for name in SIEVE_COLUMNS[2:] if name in found[0].cells), None)
    if column is None:
        raise InputError(str(path), f"needs one column of {', '.join(SIEVE_COLUMNS[2:])}", "none")
    unit = header.units.get("opening") or unit
    sieves = [(*_ends(row, unit), row) for row in found if not _name(row).startswith(SUMS)]
    openings, tops, rows = zip(*sorted(sieves, key=lambda sieve: sieve[0]), strict=True)
    for row, (finer, coarser) in zip(rows[1:], pairwise(openings), strict=True):
        if not coarser > finer:
            raise row.error("must be another opening than that of the other rows", "opening")
    for row, top, coarser in zip(rows, tops, (*openings[1:], tops[-1]), strict=True):
        if top and not column.startswith("retained"):
            raise row.error("may have two ends only in a table of what each class retains", "opening")
        if top and not math.isclose(top, coarser):
            raise row.error("must end at the opening that the next row begins with", "opening")
    values = [_number(row, column, "mass" if column == "retained" else "") for row in rows]
    _one_kind(rows, column)
    if column == "cumulative_retained_percent":
        values = [100.0 - value for value in values]
    if column.startswith(("passing", "cumulative")):
        on_each, total = _from_passing(rows, values, column), 100.0
    else:
        on_each, total = values, sum(values)
        if column == "retained_percent" and abs(total - 100.0) > ROUNDING:
            problem = f"must add up to 100 within {ROUNDING:g}"
            raise InputError(f"{path}: retained_percent", problem, f"{total:g}")
    # grains on a sieve are larger than its opening, and smaller than the next
    classes = zip(openings, (*openings[1:], *filter(None, tops[-1:])), on_each, strict=False)
    between = [(low, high, on) for low, high, on in classes if low > 0.0]
    kept = sum(on for *_, on in between)
    if not kept > 0.0:
        raise InputError(f"{path}: {column}", "must have mass between two sieves", f"{kept:g}")
    return _tabulated(between, kept), 1.0 - kept / total


@dataclass
class UnitHeader:
    """Names of a sheet's columns as this module has them, and the units in their brackets."""

    column: Callable[[str, str], str]
    units: dict[str, str] = field(default_factory=dict)

    def __call__(self, cells: list[str]) -> list[str]:
        names: list[str] = []
        for cell in cells:
            match = _UNIT.search(cell)
            plain, unit = _UNIT.sub("", cell).strip(), (match[1] or match[2]).strip() if match else ""
            names.append(self.column(plain, unit))
            if names[-1] and unit:
                self.units[names[-1]] = "um" if unit.lower().startswith("micro") else unit
        if names.count("opening") > 1 and "opening" in self.units:  # a name or a number of each sieve
            names = [
                "" if name == "opening" and not _UNIT.search(cell) else name
                for name, cell in zip(names, cells, strict=True)
            ]
        if "number" in names and "opening" not in names:
            names[names.index("number")], self.units["opening"] = "opening", "mesh"
        return names


def _sieve_column(name: str, unit: str) -> str:
    """Return the column of `SIEVE_COLUMNS` that a laboratory's name means, or an empty text."""
    plain = unicodedata.normalize("NFKD", name.lower())
    letters = re.sub(r"[^a-z]", "", plain)
    means = {each for each, words in _HEADS.items() if re.search(words, letters)}
    share = re.search(_HEADS["share"], plain + unit)
    if name in SIEVE_COLUMNS:
        return name
    if re.search(r"[+&]|\b(with|and|mit|und|avec|et|con|y)\b", plain):
        return ""  # a sieve and what it holds
    is_number = letters in ("mesh", "meshno", "meshnumber", "sieveno", "sievenumber")
    if is_number and re.fullmatch(
        r"(astm|e ?-?11|u\.?s\.?|\W)*", unit.lower()
    ):  # others' 10 is another sieve
        return "number"
    if "opening" in means:
        return "opening"
    if "passing" in means and (share or not unit):
        return "passing_percent"
    if "retained" in means and share:
        return "cumulative_retained_percent" if "cumulative" in means else "retained_percent"
    return "retained" if "mass" in means or ("retained" in means and "cumulative" not in means) else ""


def _name(row: Row) -> str:
    """Return an opening's text; a comma before one, two, four or more digits is a decimal one."""
    return re.sub(r"(\d),(\d\d?(?!\d)|\d{4})", r"\1.\2", (row["opening"] or row["number"]).lower())


def _ends(row: Row, unit: str | None) -> tuple[float, float | None]:
    """Return the opening below the grains of a row [m], and the one above where the row names both."""
    if match := _CLASS.fullmatch(_name(row)):
        low, high = (_length(row, "opening", unit, True, f"{each} {match[3]}") for each in match.group(1, 2))
        return min(low, high), max(low, high)
    return _opening(row, unit), None


def _opening(row: Row, unit: str | None) -> float:
    """Read an opening [m]: 0 for a pan, or for what is finer than a sieve; also by the number of a mesh."""
    word = _name(row)
    if mesh := _MESH.fullmatch(word) or (_MESH.fullmatch(f"{word} mesh") if unit == "mesh" else None):
        number = mesh[1] or mesh[2]
        if number not in _MESHES:
            raise row.error(
                "must be a sieve of ASTM E11, from 3.5 to 635, or a length with its unit", "opening"
            )
        return 1e-3 * _MESHES[number]
    if word.startswith((*PANS, "<", "≤")):
        return 0.0
    if unit in ("um", "µm", "μm") and re.fullmatch(r"\d{1,3}\.\d{3}", word):
        raise row.error("may be a thousand times as large: write it without a point", "opening")
    return _length(row, "opening", unit, True, word.lstrip(">≥ "))


def read_counts(path: Path, unit: str | None = None, column: str | None = None) -> Tabulated:
    """Read counts of an image analyser with one grain or one class per row.

    Columns: ``diameter``, with or without ``count``; or ``from``, ``to`` and ``count``. ``count`` may be any
    share: a number, a volume. ``unit`` is that of diameters without one. ``column`` names the diameter among
    the columns of an analyser's export.
    """

    def named(name: str, unit: str) -> str:
        if column is not None and name.lower() == _UNIT.sub("", column).strip().lower():
            return column
        # a share that is passed over would make each class one grain
        is_share = unit == "%" and re.search("^[pq][0-3]|vol|num|count|freq|mass|anteil", name.lower())
        if column is not None and name.lower() != "count" and not is_share:
            return ""
        return name.lower() if name.lower() in COUNT_COLUMNS else name

    header = UnitHeader(named)
    diameter, needed = column or "diameter", () if column is None else (column,)
    rows = list(read_rows(path, needed, (*COUNT_COLUMNS, *needed), header))
    units = {name: header.units.get(name) or unit for name in (diameter, "from", "to")}
    if diameter in rows[0].cells:
        if both := [name for name in ("from", "to") if name in rows[0].cells]:
            problem = "must have a column diameter, or from, to and count, not both"
            raise InputError(str(path), problem, f"diameter and {', '.join(both)}")
        found = [(_length(row, diameter, units[diameter]), _count(row)) for row in rows]
        between = [(size, size, share) for size, share in sorted(found)]
    else:
        if missing := [name for name in ("from", "to", "count") if name not in rows[0].cells]:
            problem = f"needs a column diameter, or from, to and count; missing: {', '.join(missing)}"
            raise InputError(str(path), problem, ", ".join(rows[0].cells))
        between = [_class(row, units) for row in rows]
        for row, (before, after) in zip(rows[1:], pairwise(between), strict=True):
            if after[0] < before[1]:
                raise row.error("must not be below the class of the row before", "from")
    total = sum(share for *_, share in between)
    if not total > 0.0:
        raise InputError(f"{path}: count", "must count at least one grain", f"{total:g}")
    return _tabulated([each for each in between if each[2] > 0.0], total)


def _tabulated(between: Sequence[tuple[float, float, float]], total: float) -> Tabulated:
    lows, highs, shares = zip(*(each for each in between if each[2] > 0.0), strict=True)
    return Tabulated(lows, highs, tuple(share / total for share in shares))


def _from_passing(rows: Sequence[Row], passing: Sequence[float], column: str) -> list[float]:
    for row, value in zip(rows, passing, strict=True):
        if value > 100.0:
            raise row.error("must be at most 100", column)
    if 0.0 < max(passing) <= 1.0:
        raise rows[-1].error("must be percent, from 0 to 100, not parts of 1", column)
    for row, (finer, coarser) in zip(rows[1:], pairwise(passing), strict=True):
        if coarser < finer:
            raise row.error("must rise with the opening", column)
    return [coarser - finer for finer, coarser in pairwise([*passing, 100.0])]


def _class(row: Row, units: Mapping[str, str | None]) -> tuple[float, float, float]:
    low, high = (_length(row, name, units[name]) for name in ("from", "to"))
    if not high > low:
        raise row.error(f"must be above from, {row['from']}", "to")
    return low, high, _count(row)


def _count(row: Row) -> float:
    return 1.0 if "count" not in row.cells else _number(row, "count", "")


def _length(row: Row, column: str, unit: str | None, zero: bool = False, text: str = "") -> float:
    """Read a diameter [m] from a cell, or a text in it; it may be 0 only where `zero` allows it."""
    try:
        quantity = Quantity.parse(text or row[column])
        if zero and quantity.number == 0.0:
            return 0.0
        value = Quantity(quantity.number, quantity.unit or unit or "").to_base("length")
    except ValueError as error:
        raise row.error(f"{error}; or write the unit of the table in the study", column) from None
    if not value > 0.0:
        raise row.error("must be positive", column)
    return value


def _number(row: Row, column: str, dimension: str) -> float:
    try:
        quantity = Quantity.parse(row[column].rstrip("% "))
        value = quantity.to_base(dimension) if quantity.unit else quantity.number
    except ValueError as error:
        raise row.error(str(error), column) from None
    if not (value >= 0.0 and math.isfinite(value)):
        raise row.error("must be 0 or more", column)
    return value


def _one_kind(rows: Sequence[Row], column: str) -> None:
    """Refuse a column with a unit in some rows only."""
    bare = [not Quantity.parse(row[column]).unit for row in rows]
    for row, without in zip(rows, bare, strict=True):
        if without and not all(bare) and Quantity.parse(row[column]).number != 0.0:
            raise row.error("needs a unit like the other rows", column)
