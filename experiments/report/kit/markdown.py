"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Sequence

from experiments.report.kit.table import Row, Table


def markdown_table(table: Table) -> str:
    """Write a table as Markdown: caption, rows and note; rows that matter begin bold."""
    heads = [
        f"{column.head} [{column.unit}]" if column.unit else str(column.head) for column in table.columns
    ]
    aligned = ["---" if column.kind == "text" else "---:" for column in table.columns]
    lines = [_line(heads), _line(aligned), *(_line(_texts(row)) for row in table.rows)]
    caption = f"*{table.caption}*" if table.caption else ""
    return "\n\n".join(part for part in (caption, "\n".join(lines), table.note) if part) + "\n"


def _texts(row: Row) -> list[str]:
    # Apostrophes and quotes are escaped in HTML and stand as they are in Markdown.
    texts = (str(cell.text).replace("&#39;", "'").replace("&#34;", '"') for cell in row.cells)
    first, *rest = [text.replace("|", "\\|") for text in texts]
    return [f"**{first}**" if row.mark in ("strong", "chosen") else first, *rest]


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
