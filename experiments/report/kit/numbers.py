"""Numbers as text: sensible digits, a true minus sign, never an exponent where a reader expects none."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from markupsafe import Markup, escape

from experiments.io.texts import enumeration as enumeration
from experiments.studyfile.campaign import Response

MISSING = "–"
"""Sign for a number that a table lacks."""

SMALLEST_P = 1e-4
"""p values below this are only said to be smaller."""

COLUMN_TOLERANCE = 1e-4
"""A column of settings shows as many decimals as leave this share of its largest value as rounding."""

MOST_DECIMALS = 8


def fixed(value: float | None, decimals: int) -> str:
    """Write a number with a fixed count of decimals; `MISSING` when there is none."""
    if value is None or not math.isfinite(value):
        return MISSING
    text = f"{value:,.{decimals}f}" if abs(value) >= 1e4 else f"{value:.{decimals}f}"
    if float(text.replace(",", "")) == 0.0:
        text = text.removeprefix("-")
    return text.replace("-", "−").replace(",", "\u202f")


def significant(value: float | None, digits: int = 4) -> str:
    """Write a number with some significant digits, without an exponent between 1e-6 and 1e9."""
    if value is None or not math.isfinite(value):
        return MISSING
    size = abs(value)
    if size != 0.0 and not 1e-6 <= size < 1e9:
        return f"{value:.{digits - 1}e}".replace("-", "−")
    exponent = math.floor(math.log10(size)) if size else 0
    return fixed(value, max(0, digits - 1 - exponent))


def trimmed(value: float | None, digits: int = 6) -> str:
    """Write a number with at most some significant digits, without zeros at its end."""
    text = significant(value, digits)
    whole, point, decimals = text.partition(".")
    if not point or "e" in decimals:
        return text
    return f"{whole}.{decimals}".rstrip("0").rstrip(".")


def unit_sign(unit: str) -> str:
    """Write the unit of a response as tables and axes have it; nothing for plain numbers."""
    return {"deg": "°", "1": ""}.get(unit, unit)


def quantity(value: float | None, unit: str, decimals: int = 2) -> str:
    """Write a response with its unit: angles with some decimals, others with four digits."""
    if unit == "deg":
        return f"{fixed(value, decimals)}°"
    return f"{significant(value)} {unit_sign(unit)}".rstrip()


def axis_title(response: Response) -> str:
    """Title of the axis of a response."""
    sign, name = unit_sign(response.unit), response.name.replace("_", " ")
    return f"{name} [{sign}]" if sign else name


def hover(key: str, response: Response) -> str:
    """Format a value of a response under the pointer, as plotly.js reads it."""
    digits, gap = (".2f", "") if response.unit == "deg" else (".4g", " ")
    return f"%{{{key}:{digits}}}{gap}{unit_sign(response.unit)}".rstrip()


def p_value(value: float | None) -> str:
    """Write a p value with four decimals, or that it is smaller than they can show."""
    if value is not None and math.isfinite(value) and value < SMALLEST_P:
        return f"< {SMALLEST_P:.4f}"
    return fixed(value, 4)


def p_clause(value: float | None) -> str:
    """Write a p value behind its sign: "= 0.0312" or "< 0.0001"."""
    text = p_value(value)
    return text if text.startswith("<") else f"= {text}"


def shortest_decimals(values: Iterable[float], tolerance: float = COLUMN_TOLERANCE) -> int:
    """Count the decimals that a column needs: rounding stays below `tolerance` of its largest value."""
    numbers = np.array([value for value in values if math.isfinite(value)], dtype=np.float64)
    if not numbers.size or not numbers.any():
        return 0
    allowed = tolerance * np.abs(numbers).max()
    for decimals in range(MOST_DECIMALS):
        if np.abs(numbers.round(decimals) - numbers).max() <= allowed:
            return decimals
    return MOST_DECIMALS


def measured(value: float | None) -> str:
    """Write a number of a measurement: whole numbers whole, any other to four significant digits."""
    if value is None or not math.isfinite(value):
        return ""
    if value.is_integer() or abs(value) >= 1000.0:
        return f"{value:.0f}"
    return f"{value:.4g}" if abs(value) >= 1e-3 else f"{value:.1e}"


def _per_value(write: Callable[[float | None], str]) -> Callable[[list[float | None]], list[str]]:
    return lambda values: [write(value) for value in values]


def _as_column(values: list[float | None]) -> list[str]:
    decimals = shortest_decimals(value for value in values if value is not None)
    return [fixed(value, decimals) for value in values]


def _sums(values: list[float | None]) -> list[str]:
    """Four significant digits at the column's median size, six at its largest; the same decimals in all."""
    sizes = [abs(value) for value in values if value is not None and math.isfinite(value) and value != 0.0]
    if not sizes:
        return [fixed(value, 0) for value in values]
    median, largest = (math.floor(math.log10(size)) for size in (float(np.median(sizes)), max(sizes)))
    return [fixed(value, min(MOST_DECIMALS, max(0, min(3 - median, 5 - largest)))) for value in values]


KINDS: Mapping[str, Callable[[list[float | None]], list[str]]] = MappingProxyType(
    {
        "angle": _per_value(lambda value: fixed(value, 2)),
        "percent": _per_value(lambda value: fixed(value, 1)),
        "ratio": _per_value(lambda value: fixed(value, 2)),
        "share": _per_value(lambda value: fixed(value, 4)),
        "p": _per_value(p_value),
        "count": _per_value(lambda value: fixed(value, 0)),
        "label": _per_value(lambda value: fixed(value, 0).replace("\u202f", "")),
        "coded": _per_value(lambda value: fixed(value, 3).removesuffix(".000")),
        "value": _as_column,
        "sum": _sums,
        "level": _per_value(trimmed),
        "free": _per_value(significant),
        "measured": _per_value(measured),
    }
)
"""Writers of a column of numbers, by the kind of quantity."""


def plain(value: Any) -> str:
    """Write any value of a setting: numbers with sensible digits, lists and tables in a row."""
    match value:
        case None:
            return MISSING
        case bool() | np.bool_():
            return "yes" if value else "no"
        case int() | np.integer():
            return str(value).replace("-", "−")
        case float() | np.floating():
            number = float(value)
            return trimmed(number, 5 if abs(number) >= 1e3 else 4)
        case Mapping():
            return ", ".join(f"{name} {plain(item)}" for name, item in value.items()) or MISSING
        case list() | tuple() | np.ndarray():
            return ", ".join(plain(item) for item in value) or MISSING
        case _:
            return str(value)


def named_number(value: Any, name: str) -> str:
    """Write a number of a decision: a p value by its name, any other as `plain`."""
    return p_value(value) if name == "p" or name.startswith("p of ") else plain(value)


def prose(text: str) -> str:
    """Typeset a sentence of a campaign: degree signs and true minus signs."""
    return re.sub(r"(?<![\w.])-(?=\d)", "−", re.sub(r" deg\b", "°", text))


def capital(text: str) -> str:
    """Begin a text with a capital letter; the rest stays as it is."""
    return text[:1].upper() + text[1:]


def interval(ends: Iterable[float], decimals: int = 2) -> str:
    """Write an interval as "[low, high]"."""
    return f"[{', '.join(fixed(end, decimals) for end in ends)}]"


def estimate(value: float, low: float, high: float, decimals: int = 2) -> str:
    """Write an estimate before its interval."""
    return f"{fixed(value, decimals)} {interval((low, high), decimals)}"


def open_end(end: str) -> str:
    """Format of the low or high end of a range beyond which nothing was explored."""
    return f"{'≤' if end == 'low' else '≥'} {{}}, not explored beyond"


def span(ends: Iterable[float], unit: str) -> str:
    """Write an interval of a response as "[low, high]" with its unit."""
    numbers = [quantity(end, unit).removesuffix(unit_sign(unit)).strip() for end in ends]
    sign = unit_sign(unit)
    return f"[{', '.join(numbers)}]{'' if sign in ('', '°') else ' '}{sign}"


def term(name: str) -> Markup:
    """Typeset a model term: "E:F" as E·F, "E^2" with a raised 2; other sources as they are."""
    if name.endswith("^2"):
        return Markup("{}<sup>2</sup>").format(name.removesuffix("^2"))
    return escape(name.replace(":", "·"))


def equation(coefficients: Mapping[str, float], digits: int = 5) -> Markup:
    """Typeset a fitted polynomial as a right-hand side, its coefficients with some significant digits."""
    parts: list[Markup] = []
    for name, value in coefficients.items():
        sign = "−" if value < 0.0 else "+" if parts else ""
        gap = Markup("&nbsp;") if parts else ""
        size = significant(abs(value), digits)
        factors = "" if name == "intercept" else Markup("&thinsp;<i>{}</i>").format(term(name))
        parts.append(Markup('<span class="term">{}{}{}{}</span>').format(sign, gap, size, factors))
    return Markup(" ").join(parts)
