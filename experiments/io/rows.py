"""Rows of a CSV file with their places, so that every error can say where it is."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from experiments.io import excel_files
from experiments.io.errors import InputError
from experiments.io.texts import is_number, nearest_name, read_text

_COMMA = re.compile(r"^([+-]?\d+),(\d+(?:[eE][+-]?\d+)?)(?=\s|$)")
"""Number with a decimal comma, alone or before its unit."""


@dataclass(frozen=True)
class Row:
    """One row: its line in the file, counted from 1, and its cells by column, without spaces around."""

    file: Path
    line: int
    cells: Mapping[str, str]

    def __getitem__(self, column: str) -> str:
        """Return the cell of a column; empty where the file has no such column."""
        return self.cells.get(column, "")

    def place(self, column: str) -> str:
        """File, line and column of a cell."""
        return f"{self.file}:{self.line}: {column}"

    def error(self, problem: str, column: str) -> InputError:
        """Build the error of a cell."""
        return InputError(self.place(column), problem, self[column] or "nothing")


def read_rows(
    path: Path,
    needed: Collection[str],
    known: Collection[str] | None,
    renamed: Callable[[list[str]], list[str]] | None = None,
) -> Iterator[Row]:
    """Read the rows of a CSV file in UTF-8, or of Excel; empty rows and those that begin ``#`` are skipped.

    The first row names the columns: all that are needed, and any of the known ones; None: any name. With
    `renamed`, which returns known names and empty ones for columns to ignore, it is the first row with all
    needed columns. A line of one cell above a row of several names is a title.
    Raise InputError when the file cannot be read, its columns are not these, or a row has more cells than
    columns; or without a row.
    """
    header: list[str] = []
    filled = False
    lines = list(_lines(path, numbered=renamed is not None))
    names = [cell for cell in lines[1][1] if cell and not is_number(cell)] if len(lines) > 1 else []
    if sum(map(bool, lines[0][1] if lines else [])) == 1 < len(names):
        del lines[0]
    heads = (renamed(cells) for _, cells in lines) if renamed else iter(())
    found = next((names for names in heads if set(needed) <= set(names)), None)
    for line, cells in lines:
        if found is not None and not header and renamed and renamed(cells) != found:
            continue
        if not header:
            header = found or cells
            _check_header(f"{path}:{line}", cells, header, needed, known)
        elif any(cells[len(header) :]):
            problem = f"must have a cell for each of the {len(header)} columns, and no more"
            hint = "Put quotes around a text with a comma."
            raise InputError(f"{path}:{line}", problem, f"{len(cells)} cells", hint)
        else:
            filled = True
            yield Row(path, line, dict(zip(header, cells, strict=False)))
    if not filled:
        raise InputError(str(path), "has no rows below the names of the columns")


def _lines(path: Path, numbered: bool) -> Iterator[tuple[int, list[str]]]:
    """Read lines of cells; numbers may have decimal commas where semicolons or tabs separate the cells.

    With `numbered` a first cell as ``#40``, the number of a sieve, begins no comment.
    """
    delimiter, found = _read(path)
    try:
        rows = list(found)
        if delimiter != ",":
            _check_marks(path, {cell.strip() for _, row in rows for cell in row})
        for line, row in rows:
            cells = [cell.strip() for cell in row]
            if delimiter != ",":
                cells = [_COMMA.sub(r"\1.\2", cell) for cell in cells]
            number = numbered and re.fullmatch(r"# ?\d+", cells[0] if cells else "") and any(cells[1:])
            if any(cells) and (number or not cells[0].startswith("#")):
                yield line, cells
    except csv.Error as error:
        raise InputError(str(path), f"is not a CSV file: {error}") from None


def _read(path: Path) -> tuple[str, Iterator[tuple[int, list[str]]]]:
    """Return what separates a file's cells, nothing in Excel, and its lines of cells."""
    if path.suffix.lower() == excel_files.ENDING:
        return "", excel_files.read_cells(path)
    text = read_text(path)
    delimiter = _delimiter(text)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter)
    return delimiter, ((reader.line_num, row) for row in reader)


def _check_marks(path: Path, cells: Collection[str]) -> None:
    """Refuse a mark before three digits, as of thousands, where the other one is a decimal mark."""
    for mark, decimal in (".,", ",."):
        found = next((each for each in cells if re.fullmatch(rf"[1-9]\d{{0,2}}\{mark}\d{{3}}", each)), "")
        if found and any(re.fullmatch(rf"[+-]?\d+\{decimal}\d+", each) for each in cells):
            raise InputError(str(path), "may have marks of thousands: write numbers without them", found)


def _delimiter(text: str) -> str:
    """Separator of the first row of cells: a semicolon, a tab, or a comma."""
    lines = (line.strip() for line in text.splitlines())
    header = next((line for line in lines if line and not line.lstrip('"').startswith("#")), "")
    return next((mark for mark in ";\t" if mark in header), ",")


def _check_header(
    place: str, cells: list[str], header: list[str], needed: Collection[str], known: Collection[str] | None
) -> None:
    if missing := [name for name in needed if name not in header]:
        problem = f"the first row must name the columns; missing: {', '.join(missing)}"
        raise InputError(place, problem, ", ".join(header))
    for name in header:
        if name and known is not None and name not in known:
            raise InputError(place, f"must be a known column, {nearest_name(name, list(known))}", name)
        if name and header.count(name) > 1:
            twice = ", ".join(cell for cell, own in zip(cells, header, strict=True) if own == name)
            raise InputError(place, f"must have one column {name}", twice, "Rename the others.")
