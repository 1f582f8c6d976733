"""Tables of pages: a DataFrame's columns with heads, units and digits, and the rows that matter marked."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup, escape

from experiments.report.kit.numbers import KINDS, term


@dataclass(frozen=True)
class Column:
    """One column of a table."""

    key: str
    """Column of the DataFrame."""
    head: str | Markup
    """Text above it."""
    kind: str = "text"
    """"text", or one of ``numbers.KINDS``."""
    unit: str = ""
    write: Callable[[str], str | Markup] = escape
    """Typesets a text."""
    around: str = ""
    """Column of the DataFrame with the format around each number's text, if any, e.g. "≤ {}"."""


Layout = list[Column | str]
"""Columns of a table in order, those of `KNOWN` and those that need no more than their name by their key."""


def columns(kind: str = "text", unit: str = "", /, **heads: str) -> list[Column]:
    """Columns of one kind and unit: by key, the text above each."""
    return [Column(key, head, kind, unit) for key, head in heads.items()]


KNOWN = {
    column.key: column
    for column in (
        *columns(
            "label", run="run", step="step", rank="rank", n="n", df="df", replicate="replicate", seed="seed"
        ),
        *columns("ratio", F="F", t="t"),
        *columns("sum", sum_sq="sum of squares", mean_sq="mean square"),
        *columns("p", p="p"),
        *(Column(key, key, write=term) for key in ("source", "term")),
    )
}
"""Columns that mean the same in every table, by key."""


@dataclass(frozen=True)
class Cell:
    """One entry."""

    text: str | Markup
    value: str | None = None
    """The number in full, as Python writes it; None for a text or where there is no number."""
    numeric: bool = False


@dataclass(frozen=True)
class Row:
    """One row of a table."""

    cells: tuple[Cell, ...]
    mark: str = ""
    """Style of the row: "strong" (significant), "weak", "chosen", "failed" or none."""


@dataclass(frozen=True)
class Table:
    """A table of the page."""

    name: str
    """Its anchor in the page."""
    caption: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    note: str = ""


def make_table(
    name: str,
    frame: pd.DataFrame,
    columns: Sequence[Column | str],
    caption: str,
    note: str = "",
    marks: Sequence[str] | pd.Series | None = None,
) -> Table:
    """Lay out a DataFrame, whose named index is a column like any other.

    Columns that it lacks are left out; a key alone means the column of `KNOWN`, else a text below its own
    name. `name` is the anchor in the page, `marks` are the styles of the rows.
    """
    if frame.index.name is not None:
        frame = frame.reset_index()
    full = (KNOWN.get(each, Column(each, each)) if isinstance(each, str) else each for each in columns)
    shown = tuple(column for column in full if column.key in frame.columns)
    cells = [_cells(column, frame[column.key], frame.get(column.around)) for column in shown]
    styles = [""] * len(frame) if marks is None else list(marks)
    rows = tuple(Row(tuple(entries), style) for *entries, style in zip(*cells, styles, strict=True))
    return Table(name, caption, shown, rows, note)


def _cells(column: Column, values: pd.Series, around: pd.Series | None) -> list[Cell]:
    if column.kind == "text":
        return [Cell("" if _absent(value) else column.write(str(value))) for value in values]
    numbers = [None if _absent(value) else float(value) for value in values]
    texts = KINDS[column.kind](numbers)
    if around is not None:
        texts = [form.format(text) for form, text in zip(around, texts, strict=True)]
    return [
        Cell(text, None if number is None else repr(number), numeric=True)
        for number, text in zip(numbers, texts, strict=True)
    ]


def _absent(value: Any) -> bool:
    return value in (None, "") or (isinstance(value, float | np.floating) and not math.isfinite(value))
