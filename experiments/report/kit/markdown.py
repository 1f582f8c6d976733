"""Tables of the page as Markdown, for pages that a repository shows."""

from __future__ import annotations

from experiments.report.kit.table import Row, Table


def markdown_table(table: Table) -> str:
    """Write a table as Markdown: caption, rows and note; rows that matter begin bold."""
    heads = [
        f"{column.head} [{column.unit}]" if column.unit else str(column.head) for column in table.columns
    ]
    aligned = ["---" if column.kind == "text" else "---:" for column in table.columns]
    lines = [_line(heads), _line(aligned), *(_line(_texts(row)) for row in table.rows)]
    parts = [f"*{table.caption}*", "\n".join(lines), table.note]
    return "\n\n".join(part for part in parts if part) + "\n"


def _texts(row: Row) -> list[str]:
    first, *rest = [str(cell.text).replace("|", "\\|") for cell in row.cells]
    return [f"**{first}**" if row.mark in ("strong", "chosen") else first, *rest]


def _line(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"
