"""Results as files: a CSV for each table, and one Markdown page to be put into a record."""

from pathlib import Path

import pandas as pd

from experiments.evidence.record_page import markdown_table, write_page
from experiments.io.files import write_text

Part = tuple[str, str, pd.DataFrame]
"""Part of a page: its name, what is said above its table, the table."""


def parse_counts(text: str) -> list[int]:
    """Return the numbers of a list such as "1,12,31"."""
    words = [word.strip() for word in text.split(",")]
    if not all(word.isdecimal() and int(word) > 0 for word in words):
        raise ValueError(f"must be positive integers separated by commas, got {text!r}")
    return [int(word) for word in words]


def write_results(folder: Path, name: str, parts: list[Part]) -> Path:
    """Write each table to a CSV of its name, and below its text to the page `name`.md; return its path."""
    for part, _, table in parts:
        write_text(folder / f"{part}.csv", table.to_csv(index=False, float_format="%.6g"))
    texts = (text for _, head, table in parts for text in (head, markdown_table(table)))
    return write_page(folder / f"{name}.md", *texts)
