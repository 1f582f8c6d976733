"""Compare the records of the engine and of another code: confusion tables with exact intervals, and aims.

python -m experiments.evidence.trials.other_codes.compare_codes OURS THEIRS --out PAGE
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from experiments.commands.console import clear_errors
from experiments.evidence.record_page import markdown_table, write_page
from experiments.evidence.trials.findings import EVERYTHING
from experiments.evidence.trials.score import Share, by_outsider, confusion, foreign_aims
from experiments.evidence.trials.trials_page import Record, read_record


def beside(records: Sequence[Record], view: str = EVERYTHING) -> pd.DataFrame:
    """Shares of several records side by side, each with its 95 % interval (Clopper and Pearson)."""
    columns = [foreign_aims(record.in_view(view)) for record in records]
    rows = []
    for same in zip(*columns, strict=True):
        found = {record.title: aim.found for record, aim in zip(records, same, strict=True)}
        rows.append({"question": same[0].question, "aim": same[0].wanted} | found)
    return pd.DataFrame(rows)


def with_intervals(counts: pd.DataFrame) -> pd.DataFrame:
    """Write a confusion table out: counts, and the 95 % interval of each share of its row in per cent."""
    trials = counts.sum(axis=1)
    written = counts.astype(str).copy()
    for truth in counts.index:
        for answer in counts.columns:
            count = int(counts.loc[truth, answer])
            low, high = Share(count, int(trials[truth])).interval
            written.loc[truth, answer] = f"{count} ({100 * low:.0f} to {100 * high:.0f})" if count else "0"
    written.insert(0, "trials", trials)
    return written.rename_axis(None, axis=1).reset_index()


def write_comparison(path: Path, records: Sequence[Record], view: str = EVERYTHING) -> Path:
    """Write records side by side as a page."""
    parts = ["# Two realities, one analysis", markdown_table(beside(records, view))]
    for record in records:
        parts += [f"## {record.title}", "Counts; in brackets the 95 % interval of the share, in per cent."]
        table = record.in_view(view)
        parts += [markdown_table(with_intervals(confusion(table)))]
        if len(outside := by_outsider(table)):
            parts += ["What may not be named:", markdown_table(with_intervals(outside))]
    return write_page(path, *parts)


def main(
    records: Annotated[list[Path], typer.Argument(help="Folders of records, the engine's first.")],
    out: Annotated[Path, typer.Option(help="The page.")],
    view: Annotated[str, typer.Option(help="everything or photographs.")] = EVERYTHING,
) -> None:
    """Set records of trials side by side."""
    with clear_errors():
        print(write_comparison(out, [read_record(folder) for folder in records], view))


if __name__ == "__main__":
    typer.run(main)
