"""Record of the pages that were run, their cells and their time: ``docs/executed.csv``.

``-D executed_pages=quick`` runs only the pages that took no longer than `QUICK` seconds in the record,
``-D executed_pages=howto/heap,tutorials/wheat`` only these. ``-D executed_record=1`` writes the rows of the
pages that were run, if none had a fault.
"""

from __future__ import annotations

import csv
import hashlib
import json
import re
import subprocess
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
RECORD = DOCS / "executed.csv"
COLUMNS = ("page", "seconds", "cells", "commit", "date")
QUICK = 10.0
"""Longest time [s] of a page that the gate runs itself."""


def cells_of(page: Path) -> list[str]:
    """Return the code of a page, cell by cell; of a page without a cell, nothing."""
    text = page.read_text(encoding="utf-8")
    if page.suffix == ".ipynb":
        found = json.loads(text)["cells"]
        return ["".join(cell["source"]) for cell in found if cell["cell_type"] == "code"]
    return re.findall(r"^```\{code-cell\}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def digest(cells: list[str]) -> str:
    """Return what tells these cells from others."""
    return hashlib.sha256("\0".join(cells).encode()).hexdigest()[:16]


def pages() -> dict[str, Path]:
    """Return every page with a cell, by its name."""
    files = sorted([*DOCS.rglob("*.md"), *DOCS.rglob("*.ipynb")])
    return {
        file.relative_to(DOCS).with_suffix("").as_posix(): file
        for file in files
        if "generated" not in file.parts and cells_of(file)
    }


def recorded() -> dict[str, dict[str, str]]:
    """Return the rows of the record by their page."""
    with RECORD.open(encoding="utf-8", newline="") as file:
        return {row["page"]: row for row in csv.DictReader(file)}


def slow(row: dict[str, str]) -> bool:
    """Return True for a page that the gate leaves out."""
    return float(row["seconds"]) > QUICK


def commit_now() -> str:
    """Return the commit of the tree, marked where more than the record is not as committed."""

    def git(*words: str) -> str:
        command = ["git", "-C", str(DOCS), *words]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    changed = git("status", "--porcelain", "--untracked-files=no", "--", ":/", f":!{RECORD.name}")
    return git("rev-parse", "--short=12", "HEAD") + ("-dirty" if changed else "")


def choose(app: Any, config: Any) -> None:
    """Have pages built without their execution; note what a run begins with, as that may change."""
    which, known = config.executed_pages, pages()
    if config.executed_record:
        app.executed_from = commit_now(), {name: digest(cells_of(file)) for name, file in known.items()}
    if which == "all":
        return
    chosen = set(which.split(","))
    if which == "quick":
        chosen = {name for name, row in recorded().items() if not slow(row)}
    if not chosen <= set(known):
        raise ValueError(f"executed_pages is all, quick or pages with cells, {', '.join(known)}; got {which}")
    left = [file.relative_to(DOCS).as_posix() for name, file in known.items() if name not in chosen]
    config.nb_execution_excludepatterns = left


def write_record(app: Any, exception: Exception | None) -> None:
    """Write when each page was run, if none that was run had a fault."""
    if not app.config.executed_record or exception is not None:
        return
    (commit, digests), rows = app.executed_from, recorded()
    runs = {name: app.env.nb_metadata[name].get("exec_data") for name in digests}
    runs = {name: run for name, run in runs.items() if run}
    if not all(run["succeeded"] for run in runs.values()):
        return
    for name, run in runs.items():
        date = datetime.fromtimestamp(run["mtime"], UTC).date().isoformat()
        row = (name, f"{run['runtime']:.1f}", digests[name], commit, date)
        rows[name] = dict(zip(COLUMNS, row, strict=True))
    with RECORD.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows[name] for name in digests if name in rows)


def setup(app: Any) -> dict[str, bool]:
    """Add the settings."""
    app.add_config_value("executed_pages", "all", "")
    app.add_config_value("executed_record", False, "")
    app.connect("config-inited", choose)
    app.connect("build-finished", write_record)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
