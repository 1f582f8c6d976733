"""Sheets of Excel (.xlsx), by the optional package openpyxl."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from types import ModuleType

from experiments.io.errors import InputError
from experiments.io.files import read_file, replacing
from experiments.io.texts import LARGEST, unreadable

ENDING = ".xlsx"
MOST = 10 * LARGEST
"""Bytes of the largest file that is read, unpacked."""


def read_cells(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows of a file's first sheet, numbered from 1, as texts; a formula gives its stored value.

    Raise InputError when the file cannot be read, is too large, or is no sheet of Excel.
    """
    try:
        data = read_file(path, LARGEST)
    except OSError as error:
        raise InputError(str(path), unreadable(error)) from None
    openpyxl = _openpyxl(path)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as packed:
            size = sum(part.file_size for part in packed.infolist())
        if size > MOST:
            raise InputError(str(path), f"must have at most {MOST:,} bytes, unpacked", size)
        book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
        rows = [*book.worksheets[0].iter_rows(values_only=True)]
    except InputError:
        raise
    except Exception as error:  # a damaged part fails in the parser of that part, each with errors of its own
        raise InputError(str(path), f"is not a sheet of Excel: {error}") from None
    for number, row in enumerate(rows, start=1):
        yield number, ["" if cell is None else str(cell) for cell in row]


def write_cells(path: Path, comments: Iterable[str], table: Sequence[Sequence[object]]) -> None:
    """Write comments, each a row of one cell, and below them a table whose first row has the heads."""
    openpyxl = _openpyxl(path)
    book = openpyxl.Workbook()
    for row in (*([comment] for comment in comments), *table):
        book.active.append(row)
    with replacing(path) as temporary:
        book.save(temporary)


def _openpyxl(path: Path) -> ModuleType:
    try:
        import openpyxl
    except ImportError:
        hint = "Install it by pip install 'dem-warp[excel]', or save the sheet as CSV."
        raise InputError(str(path), "a sheet of Excel needs openpyxl", hint=hint) from None
    module: ModuleType = openpyxl
    return module
