"""The record of a second reality beside that of the engine: confusion tables with exact intervals, and aims.

    python -m experiments.trials.other_codes.compare experiments/trials/record/sixth out/liggghts/record \\
        --labels out/liggghts/hidden/labels.json --out out/beside.md

A record is a folder with what was declared, sealed and found, and the labels; those of trials that have not
been taken over into a record lie elsewhere, and the option says where. Trials that have not been analysed are
left out and counted.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from doe.discrepancy import Verdict
from experiments.commands.console import clear_errors
from experiments.report.kit.markdown import markdown_table, write_page
from experiments.trials.declaration import Declaration, read_declaration
from experiments.trials.findings import EVERYTHING, read_findings
from experiments.trials.folder import DECLARED, FINDINGS, LABELS, REALITY, SEALED
from experiments.trials.score import Share, by_outsider, confusion, covered, scored, share, strong_singles
from experiments.trials.truth import Kind, read_labels, read_sealed, revealed


@dataclass(frozen=True, eq=False)
class Record:
    """A record of trials: its code, what was declared, and the judged findings of one view."""

    code: str
    declaration: Declaration
    table: pd.DataFrame
    """Rows of `scored`."""
    sealed: int
    """Trials that were sealed."""

    @property
    def title(self) -> str:
        """Code, scale and number of trials."""
        scale = self.declaration.scale or "as written"
        return f"{self.code}, {scale}, {len(self.table)} of {self.sealed} trials"


def read_record(folder: Path, labels: Path | None = None, view: str = EVERYTHING) -> Record:
    """Read a record; its labels may lie elsewhere.

    Raises
    ------
    InputError
        When a label does not fit its seal.
    """
    sealed = read_sealed(folder / SEALED)
    truths = revealed(read_labels(labels or folder / LABELS), sealed)
    findings = read_findings([folder / FINDINGS])
    reality = folder / REALITY
    told = json.loads(reality.read_text(encoding="utf-8")) if reality.is_file() else {}
    table = scored(findings[findings["view"] == view].reset_index(drop=True), truths, sealed)
    return Record(told.get("name", "dem-warp"), read_declaration(folder / DECLARED), table, len(sealed))


def shares(table: pd.DataFrame) -> dict[str, tuple[str, Share]]:
    """Shares that are aimed at, by question, each with the aim of a second reality."""
    kind, verdict = table["kind"], table["verdict"]
    nulls, strong, pairs = table[kind == Kind.NULL], strong_singles(table), table[kind == Kind.PAIR]
    outside = verdict[kind.isin([Kind.WITHHELD, Kind.STRANGER])]
    named, tied = strong["right"], strong["tied"]
    return {
        "nothing hidden: alarms": ("at most 5 %", share(nulls["alarm"])),
        "nothing hidden: wrong names": ("none", share(nulls["wrong"])),
        "one strong effect: named": ("at least 80 %", share(named)),
        "one strong effect: named, or in a tie": ("at least 90 %", share(named | tied)),
        "one strong effect: a wrong name": ("at most 2 %", share(strong["wrong"])),
        "outside the library: unknown": ("at least 90 %", share(outside == Verdict.UNKNOWN)),
        "two effects: both named": ("none set", share(pairs["right"])),
        "two effects: a wrong name": ("at most 2 %", share(pairs["wrong"])),
        "size of a named effect in its 90 % interval": ("82 to 96 %", share(covered(table))),
        "any trial: a wrong name": ("none set", share(table["wrong"])),
    }


def beside(records: Sequence[Record]) -> pd.DataFrame:
    """Shares of several records side by side, each with its 95 % interval (Clopper and Pearson)."""
    columns = [shares(record.table) for record in records]
    rows = []
    for question, (wanted, _) in columns[0].items():
        found = {record.title: str(own[question][1]) for record, own in zip(records, columns, strict=True)}
        rows.append({"question": question, "aim": wanted} | found)
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


def write_comparison(path: Path, records: Sequence[Record]) -> Path:
    """Write records side by side as a page."""
    parts = ["# Two realities, one analysis", markdown_table(beside(records))]
    for record in records:
        parts += [f"## {record.title}", "Counts; in brackets the 95 % interval of the share, in per cent."]
        parts += [markdown_table(with_intervals(confusion(record.table)))]
        parts += ["What may not be named:", markdown_table(with_intervals(by_outsider(record.table)))]
    return write_page(path, *parts)


def main(
    records: Annotated[list[Path], typer.Argument(help="Folders of records, the engine's first.")],
    out: Annotated[Path, typer.Option(help="The page.")],
    labels: Annotated[Path | None, typer.Option(help="Labels of the last record, if not in it.")] = None,
    view: Annotated[str, typer.Option(help="everything or photographs.")] = EVERYTHING,
) -> None:
    """Set records of trials side by side."""
    with clear_errors():
        last = len(records) - 1
        read = [read_record(each, labels if n == last else None, view) for n, each in enumerate(records)]
        print(write_comparison(out, read))


if __name__ == "__main__":
    typer.run(main)
