"""The folder of an answer: tables, plots and one page."""

from __future__ import annotations

import base64
import io
import json
from pathlib import Path
from typing import Any

import pandas as pd

from experiments.commands.tables.answers import Answer
from experiments.io.errors import InputError
from experiments.io.files import require_folder, write_text
from experiments.io.plain_data import indexed, jsonable
from experiments.io.texts import safe_cell
from experiments.report.kit.html import Chapter, render_page
from experiments.report.kit.table import Column, Table, make_table

PAGE = "report.html"

DOTS = 150
"""Dots an inch of a plot."""


def plain_answer(answer: Answer) -> dict[str, Any]:
    """Return title, texts, notes and tables for JSON."""
    tables = {name: jsonable(table) for name, (_, table) in answer.tables.items()}
    return {"title": answer.title, "texts": answer.texts, "notes": answer.notes, "tables": tables}


def require_new_folder(out: Path) -> None:
    """Refuse a folder that holds something."""
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InputError("--out", "must be a new or an empty folder", str(out))
    require_folder(out)


def publish(answer: Answer, out: Path, source: str) -> None:
    """Write tables (CSV), plots (PNG), ``results.json`` and a page into a folder."""
    for part in ("tables", "plots"):
        (out / part).mkdir(parents=True, exist_ok=True)
    for name, (_, table) in answer.tables.items():
        safe = indexed(table).map(safe_cell)
        safe.columns = [safe_cell(head) for head in safe.columns]
        write_text(out / "tables" / f"{name}.csv", safe.to_csv(index=False, lineterminator="\n"))
    pictures = []
    for name, (caption, draw) in answer.plots.items():
        if (figure := answer.made(caption, draw)) is None:
            continue
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", dpi=DOTS)
        (out / "plots" / f"{name}.png").write_bytes(buffer.getvalue())
        pictures.append((base64.b64encode(buffer.getvalue()).decode(), caption))
    write_text(out / "results.json", json.dumps(plain_answer(answer), indent=1, allow_nan=False) + "\n")
    write_text(out / PAGE, _page(answer, pictures, source))


def _page(answer: Answer, pictures: list[tuple[str, str]], source: str) -> str:
    tables = {name: _laid_out(name, *table) for name, table in answer.tables.items()}
    chapters = [Chapter("tables", "Tables", tables)]
    if pictures:
        chapters.insert(0, Chapter("plots", "Plots", template="statistics/plots.html.j2"))
    context = {"source": f"Made from {source}.", "notes": answer.notes, "plots": pictures}
    return render_page("statistics", answer.title, "statistics/summary.html.j2", chapters, context)


def _laid_out(name: str, caption: str, table: pd.DataFrame) -> Table:
    frame = indexed(table)
    columns = [Column(head, str(head), _kind(frame[head])) for head in frame.columns]
    return make_table(name, frame, columns, caption)


def _kind(column: pd.Series) -> str:
    if not pd.api.types.is_float_dtype(column):
        return "text"
    return "count" if (column.dropna() % 1.0 == 0.0).all() else "free"
