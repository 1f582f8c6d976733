"""Pages in Markdown, for a repository to show: tables and parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from experiments.io.files import write_text
from experiments.report.kit.numbers import fixed, plain
from experiments.report.kit.table import Column, Row, Table, make_table, plain_table


def markdown_page(*parts: str) -> str:
    """Join the parts of a page (paragraphs, headings, tables), a blank line between two."""
    return "\n\n".join(text for part in parts if (text := part.strip())) + "\n"


def write_page(path: Path, *parts: str) -> Path:
    """Write a page of its parts, and return its path."""
    write_text(path, markdown_page(*parts))
    return path


def markdown_table(content: Table | pd.DataFrame) -> str:
    """Write a table as Markdown: caption, rows and note; rows that matter begin bold.

    A DataFrame is laid out by `plain_table`.
    """
    table = plain_table(content) if isinstance(content, pd.DataFrame) else content
    heads = [
        f"{column.head} [{column.unit}]" if column.unit else str(column.head) for column in table.columns
    ]
    aligned = ["---" if column.kind == "text" else "---:" for column in table.columns]
    lines = [_line(heads), _line(aligned), *(_line(_texts(row)) for row in table.rows)]
    caption = f"*{table.caption}*" if table.caption else ""
    return "\n\n".join(part for part in (caption, "\n".join(lines), table.note) if part) + "\n"


def facts_list(facts: Mapping[str, Any]) -> str:
    """List what made some numbers, a line each; wall times are left to `wall_times_table`."""
    return "\n".join(f"- {name}: {plain(value)}" for name, value in facts.items() if name != WALL_TIMES)


WALL_TIMES = "wall_times"
"""Fact that holds the wall times of batches: stage, simulated (cases), seconds."""


def wall_times_table(facts: Mapping[str, Any], what: str) -> str:
    """Lay out the wall times among some facts (empty without any); `what` names, in the plural, the cases."""
    rows = pd.DataFrame(facts.get(WALL_TIMES, []))
    if rows.empty:
        return ""
    shown = [
        Column("stage", "batch"),
        Column("simulated", f"{what} simulated", "label"),
        Column("seconds", "wall time", "count", "s"),
    ]
    total = f"In all {fixed(rows['simulated'].sum(), 0)} {what} in {fixed(rows['seconds'].sum(), 0)} s."
    return markdown_table(make_table("wall-times", rows, shown, "Wall times.", total))


def _texts(row: Row) -> list[str]:
    # Apostrophes and quotes are escaped in HTML and stand as they are in Markdown.
    texts = (str(cell.text).replace("&#39;", "'").replace("&#34;", '"') for cell in row.cells)
    first, *rest = [text.replace("|", "\\|") for text in texts]
    return [f"**{first}**" if row.mark in ("strong", "chosen") else first, *rest]


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
