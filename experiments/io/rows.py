"""Rows of a CSV file with their places, so that every error can say where it is."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from experiments.io.errors import InputError
from experiments.io.texts import nearest_name, read_text


@dataclass(frozen=True)
class Row:
    """One row: its line in the file, counted from 1, and its cells by column, without spaces around."""

    file: Path
    line: int
    cells: Mapping[str, str]

    def __getitem__(self, column: str) -> str:
        """The cell of a column; empty where the file has no such column."""
        return self.cells.get(column, "")

    def place(self, column: str) -> str:
        """File, line and column of a cell."""
        return f"{self.file}:{self.line}: {column}"

    def error(self, rule: str, column: str) -> InputError:
        """Build the error of a cell that breaks a rule."""
        return InputError(self.place(column), rule, self[column] or "nothing")


def read_rows(path: Path, needed: Collection[str], known: Collection[str]) -> Iterator[Row]:
    """Read the rows of a CSV file in UTF-8; empty rows, and rows that begin with ``#``, are skipped.

    The first row names the columns: all that are needed, and of the known ones as many as it likes.

    Raises
    ------
    InputError
        When the file cannot be read, its columns are not these, or a row has more cells than columns.
    """
    header: list[str] = []
    for line, cells in _lines(path):
        if not header:
            header = cells
            _check_header(path, line, header, needed, known)
        elif any(cells[len(header) :]):
            rule = f"expected a row has a cell for each of the {len(header)} columns"
            rule += " (a comma inside a text needs quotes)"
            raise InputError(f"{path}:{line}", rule, f"{len(cells)} cells")
        else:
            yield Row(path, line, dict(zip(header, cells, strict=False)))


def _lines(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Lines of cells; where semicolons or tabs separate them, as in German, numbers may have commas."""
    text = read_text(path)
    delimiter = _delimiter(text)
    try:
        reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter)
        for row in reader:
            cells = [cell.strip() for cell in row]
            if delimiter != ",":
                cells = [_with_point(cell) for cell in cells]
            if any(cells) and not cells[0].startswith("#"):
                yield reader.line_num, cells
    except csv.Error as error:
        raise InputError(str(path), "must be a readable CSV file", str(error)) from None


def _delimiter(text: str) -> str:
    """Separator of the first row of cells: a semicolon, a tab, or a comma."""
    lines = (line.strip() for line in text.splitlines())
    header = next((line for line in lines if line and not line.lstrip('"').startswith("#")), "")
    return next((mark for mark in ";\t" if mark in header), ",")


def _with_point(cell: str) -> str:
    """A number with a decimal comma, alone or before its unit, with a point."""
    return re.sub(r"^([+-]?\d+),(\d+(?:[eE][+-]?\d+)?)(?=\s|$)", r"\1.\2", cell)


def _check_header(
    path: Path, line: int, header: list[str], needed: Collection[str], known: Collection[str]
) -> None:
    place = f"{path}:{line}"
    if missing := [name for name in needed if name not in header]:
        rule = f"expected the first row names the columns, separated by commas; missing: {', '.join(missing)}"
        raise InputError(place, rule, ", ".join(header))
    for name in header:
        if name not in known:
            raise InputError(place, f"must be a known column, {nearest_name(name, list(known))}", name)
        if header.count(name) > 1:
            raise InputError(place, "expected every column stands once", name)
