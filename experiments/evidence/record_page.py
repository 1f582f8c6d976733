"""Pages of records in Markdown: parts, tables, facts and wall times."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
from pandas.api.types import is_numeric_dtype

from experiments.io.files import write_text
from experiments.report.kit import markdown
from experiments.report.kit.numbers import fixed, plain
from experiments.report.kit.table import Column, Table, make_table


def markdown_page(*parts: str) -> str:
    """Join the parts of a page (paragraphs, headings, tables), a blank line between two."""
    return "\n\n".join(text for part in parts if (text := part.strip())) + "\n"


def write_page(path: Path, *parts: str) -> Path:
    """Write a page of its parts, and return its path."""
    write_text(path, markdown_page(*parts))
    return path


def markdown_table(content: Table | pd.DataFrame) -> str:
    """Write a table as Markdown; a DataFrame is laid out by `plain_table`."""
    return markdown.markdown_table(plain_table(content) if isinstance(content, pd.DataFrame) else content)


def plain_table(frame: pd.DataFrame) -> Table:
    """Lay out a DataFrame as it is: heads as they stand, texts as they stand, numbers to four digits."""
    columns = [
        Column(str(name), str(name), "measured" if is_numeric_dtype(values) else "text", write=str)
        for name, values in frame.items()
    ]
    return make_table("", frame, columns, "")


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
