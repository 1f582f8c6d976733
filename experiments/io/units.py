"""Quantities with units, e.g. "110 mm" in a study file, converted to SI once.

Angles are the one exception to SI: they are in degrees everywhere in ``experiments``.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from experiments.io.errors import InputError

UNITS: dict[str, dict[str, float]] = {
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6},
    "pressure": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9},
    "density": {"kg/m^3": 1.0, "g/cm^3": 1e3},
    "speed": {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3},
    "rate": {"1/s": 1.0, "1/min": 1.0 / 60.0},
    "frequency": {"Hz": 1.0},
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
    "mass": {"kg": 1.0, "g": 1e-3, "mg": 1e-6},
    "mass flow": {"kg/s": 1.0, "g/s": 1e-3},
    "volume": {"m^3": 1.0, "cm^3": 1e-6, "mm^3": 1e-9, "l": 1e-3, "ml": 1e-6, "ul": 1e-9},
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    "energy": {"J": 1.0, "mJ": 1e-3},
    "surface energy": {"J/m^2": 1.0, "mJ/m^2": 1e-3, "N/m": 1.0, "mN/m": 1e-3},
    "energy density": {"J/m^3": 1.0, "kJ/m^3": 1e3, "Pa": 1.0, "kPa": 1e3},
    "angle": {"deg": 1.0, "rad": math.degrees(1.0)},
}
"""Size of each unit in the base unit of its dimension (SI; degrees for angles)."""

_SPELLINGS = str.maketrans({"²": "^2", "³": "^3", "µ": "u", "μ": "u", "°": "deg", "−": "-"})
_POWER = re.compile(r"\b([a-z]*m)(?:\*\*)?([23])\b")
_MARKS = re.compile(r"([+-]?\d+(?:[.,]\d+|[\s'’_]\d{3}(?!\d))+)((?:[eE][+-]?\d+)?(?:\s+\S.*|[^\s\d].*)?)")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(?:([.,\s'’_])\d{3})(?:\1\d{3})*")
_FLOAT = re.compile(r"[+-]?\d+\.\d+")
_TEXT = re.compile(r"([+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)")

LONGEST = 100
"""Characters of the longest text that is read as a quantity."""


@dataclass(frozen=True)
class Quantity:
    """A number and the name of its unit (``""``: a plain number)."""

    number: float
    unit: str = ""

    @classmethod
    def parse(cls, value: object) -> Quantity:
        """Read a number, text such as ``"110 mm"``, or a quantity; ValueError where it is no finite one."""
        if isinstance(value, cls):
            quantity = value
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            quantity = cls(_float(value))
        elif (found := _MARKS.fullmatch(text := _spelled(value))) and not _FLOAT.fullmatch(found[1]):
            raise ValueError(_marks_problem(*found.groups()))
        elif text and (match := _TEXT.fullmatch(text)):
            quantity = cls(float(match[1]), _POWER.sub(r"\1^\2", match[2]))
        else:
            raise ValueError('must be a number, or text with a number and its unit such as "110 mm"')
        if not math.isfinite(quantity.number):
            raise ValueError("must be finite")
        return quantity

    def __str__(self) -> str:
        return f"{self.number!r} {self.unit}".rstrip()

    @property
    def written(self) -> float | str:
        """Number or text that `parse` reads as the same quantity."""
        return str(self) if self.unit else self.number

    def to_base(self, dimension: str) -> float:
        """Convert to SI (degrees for angles); ``dimension`` ``""`` takes plain numbers only.

        Raises
        ------
        ValueError
            When the unit is not one of the dimension's; the message names those.

        Examples
        --------
        >>> Quantity(34.325, "MPa").to_base("pressure")
        34325000.0
        """
        size = unit_size(self.unit, dimension)
        # Dividing by a whole number gives the float nearest to 28 mm in metres; multiplying by 1e-3 may not.
        inverse = round(1.0 / size) if size < 1.0 else 1
        return self.number / inverse if math.isclose(inverse * size, 1.0) else self.number * size


def _marks_problem(number: str, rest: str) -> str:
    """Name both readings of a comma or another mark: a decimal one, and a separator of thousands."""
    head, mark, tail = re.split(r"([.,\s'’_])(?=\d+$)", number)
    whole = re.sub(r"[.,\s'’_]", "", head)
    decimal = mark in ".," and mark not in head and (head == whole or _THOUSANDS.fullmatch(head))
    readings = [f"{whole}.{tail}"] if decimal else []
    readings += [whole + tail] if _THOUSANDS.fullmatch(number) else []
    shown = " or ".join(f'"{reading}{rest}"' for reading in readings) or "one number"
    wrong = "comma" if "," in number else f'"{mark}" in a number'
    return f"must have no {wrong}, but a decimal point if any: {shown}"


def _float(value: float) -> float:
    """Return a number as a float; an integer beyond all floats is infinite."""
    try:
        return float(value)
    except OverflowError:
        return math.inf


def dimension_of_unit(unit: str) -> str:
    """Name the dimension of an SI unit of the engine; ValueError where no known dimension has it."""
    if unit == "1":
        return ""
    for dimension, sizes in UNITS.items():
        if sizes.get(unit) == 1.0 or unit == "rad" in sizes:
            return dimension
    raise ValueError(f"must be an SI unit of a known dimension ({', '.join(UNITS)}), got {unit!r}")


def unit_size(unit: str, dimension: str) -> float:
    """Size of a unit in the base unit of its dimension; ValueError where it is not one of those."""
    unit = unit.translate(_SPELLINGS)
    if not dimension and unit:
        raise ValueError(f"must be a plain number without the unit {unit!r}")
    known = UNITS[dimension] if dimension else {"": 1.0}
    if unit not in known:
        example = f'"1.5 {next(iter(known))}"'
        raise ValueError(f"needs a unit of {dimension} ({', '.join(known)}), for example {example}")
    return known[unit]


def _spelled(value: object) -> str:
    """Return the text of a quantity in plain characters; empty where it cannot be one."""
    return value.strip().translate(_SPELLINGS) if isinstance(value, str) and len(value) <= LONGEST else ""


def read_quantity(text: str, dimension: str, place: str) -> float:
    """Read a quantity of a dimension in SI; an error names its place."""
    try:
        return Quantity.parse(text).to_base(dimension)
    except ValueError as error:
        raise InputError(place, str(error), text) from None


def read_share(text: str, place: str) -> float:
    """Read a share between 0 and 1, such as ``5%`` or ``0.05``; an error names its place."""
    words = text.strip()
    try:
        value = float(words.removesuffix("%")) / (100.0 if words.endswith("%") else 1.0)
    except ValueError:
        value = 0.0
    if not 0.0 < value < 1.0:
        raise InputError(place, "must be a share above 0 and below 1, such as 5% or 0.05", text)
    return value
