"""Text files from any program: byte-order marks, other encodings, decimal commas."""

from __future__ import annotations

import codecs
import difflib
import re
from collections.abc import Iterable
from pathlib import Path

from experiments.io.errors import InputError
from experiments.io.files import read_file

LARGEST = 10_000_000
"""Bytes of the largest text file that is read."""

_MARKS = {
    codecs.BOM_UTF32_LE: "UTF-32", codecs.BOM_UTF32_BE: "UTF-32",
    codecs.BOM_UTF16_LE: "UTF-16", codecs.BOM_UTF16_BE: "UTF-16",
}  # fmt: skip
_HARMLESS = frozenset(" .,:;()[]+-_=/%'")
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
_NUMBER = re.compile(
    r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf|infinity)", re.IGNORECASE
)
_COMMA_NUMBER = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")

LONGEST = 200
"""Characters of the longest text that a file for another program gets."""

DELIMITERS = (";", "\t", None, ",")
"""Delimiters of a table, in the order in which they are tried; None: blanks."""


def read_text(path: Path, largest: int = LARGEST) -> str:
    """Read a text file in UTF-8 of at most `largest` bytes, without its byte-order mark.

    Raise InputError when there is no such file, it is too large, or it is not text in UTF-8; UTF-16 is named.
    """
    try:
        data = read_file(path, largest)
    except OSError as error:
        raise InputError(str(path), unreadable(error)) from None
    return decoded(data, str(path))


def unreadable(error: OSError) -> str:
    """Return the problem of a file that the system cannot open."""
    if isinstance(error, FileNotFoundError):
        return "no such file"
    return f"cannot be read: {(error.strerror or str(error)).lower()}"


def decoded(data: bytes, place: str) -> str:
    """Decode text in UTF-8 as `read_text` does; ``place`` names it in errors."""
    named = next((name for mark, name in _MARKS.items() if data.startswith(mark)), "")
    if not named and data.count(0, 0, 4096) > 0:
        zeros = sorted(half.count(0) / max(len(half), 1) for half in (data[:4096:2], data[1:4096:2]))
        named = "UTF-16" if zeros[0] < 0.05 and zeros[1] > 0.5 else "binary data"
    if named:
        advice = "Save it as UTF-8." if named.startswith("UTF") else ""
        raise InputError(place, "must be text in UTF-8", named, advice)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        received = f"the byte 0x{data[error.start]:02x}, as in Windows-1252 or Latin-1"
        raise InputError(
            f"{place}, line {line}", "must be text in UTF-8", received, "Save it as UTF-8."
        ) from None


def split(line: str, delimiter: str | None) -> list[str]:
    """Cut a line into its cells, quotes and blanks around them removed."""
    return [cell.strip().strip('"').strip() for cell in line.split(delimiter)]


def is_number(text: str, delimiter: str | None = None) -> bool:
    """Return whether a cell is a number, which may have a decimal comma unless commas separate the cells."""
    return bool(_NUMBER.fullmatch(text) or (delimiter != "," and _COMMA_NUMBER.fullmatch(text)))


def number(text: str) -> float:
    """Convert a cell for which `is_number` holds."""
    return float(text.replace(",", "."))


def delimiter_of(line: str) -> str | None:
    """Find the delimiter of a line of numbers: the first one by which every cell is a number."""
    for delimiter in DELIMITERS:
        cells = split(line, delimiter)
        if len(cells) > 1 and all(is_number(cell, delimiter) for cell in cells):
            return delimiter
    return None


def safe_text(text: str) -> str:
    """Return a text as one line that is data in a comment, string, table or heading of any language.

    Everything but letters, digits and marks that end, continue or call nothing becomes a blank: line breaks,
    quotes, backslashes, backticks, ``& $ * # < > { }``. Without a word left it is ``unnamed``.
    """
    kept = "".join(letter if letter.isalnum() or letter in _HARMLESS else " " for letter in text)
    return " ".join(kept.split())[:LONGEST].lstrip("=+-@ ") or "unnamed"


def safe_cell(cell: object) -> object:
    """Return a cell of a table whose text no spreadsheet takes for a formula."""
    formula = isinstance(cell, str) and cell.startswith(_FORMULA) and not is_number(cell)
    return f"'{cell}" if formula else cell


def nearest_name(name: str, known: list[str]) -> str:
    """Suggest the known name nearest to a misspelt one, as the end of a sentence."""
    near = difflib.get_close_matches(name, known, n=1)
    return f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known) or 'none'}"


def enumeration(names: Iterable[str], joined: str = "and") -> str:
    """Write names as "B", "B and E" or "B, E and F"; nothing for none."""
    *first, last = [*names] or [""]
    return f"{', '.join(first)} {joined} {last}" if first else last
