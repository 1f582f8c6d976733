"""The folder of the trials: what is published, what is hidden, what was measured and found."""

import csv
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from experiments.cases.store.outcome_table import OutcomeTable
from experiments.cases.workers.resources import resolve_devices
from experiments.evidence.machine import machine

DECLARED, SEALED, LABELS = "declared.json", "sealed.csv", "labels.json"
FINDINGS, RUNS, NOTES, PAGE = "findings.csv", "runs.csv", "notes.md", "README.md"
REALITY, HEAPS = "reality.json", "heaps.tar.xz"
"""Files of a record; labels are there of what has been analysed, notes where there is more to say,
the reality where another code made the heaps, and these where they are kept."""


class Folder:
    """A folder of trials."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.record, self.hidden, self.data = root / "record", root / "hidden", root / "data"
        """All that may be seen, what only the generator sees, and files of measured heaps."""
        self.declared, self.sealed = self.record / DECLARED, self.record / SEALED
        """The declaration, and the seals of the truths."""
        self.hidden_labels, self.findings = self.hidden / LABELS, self.record / FINDINGS
        """The truths, and the table of what the analyses found."""

    def measured(self, trial: str) -> Path:
        """Measured heaps of a trial."""
        return self.data / f"{trial}.csv"

    def discovery(self, job: str) -> Path:
        """Return the whole of what an analysis found."""
        return self.root / "discoveries" / f"{job}.json"


@contextmanager
def noted_run(folder: Folder, what: str, device: str | None, table: OutcomeTable) -> Iterator[None]:
    """Add a row to the record's table of runs, however the block ends: what ran, where, when, how long.

    Its cases are the rows that `table` gets meanwhile.
    """
    started, before = time.perf_counter(), len(table)
    try:
        yield
    finally:
        seconds, cases = time.perf_counter() - started, len(table) - before
        devices = resolve_devices(device)
        name, warp, date = machine(devices[0]).rsplit(", ", 2)
        name = f"{len(devices)} x {name}" if len(devices) > 1 else name
        path = folder.record / RUNS
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            if not file.tell():
                writer.writerow(("what", "machine", "warp", "date", "cases", "seconds"))
            writer.writerow((what, name, warp, date, cases, f"{seconds:.1f}"))
