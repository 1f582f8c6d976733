"""The folder of the trials: what is published, what is hidden, what was measured and found."""

from __future__ import annotations

import csv
import time
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from experiments.discover.devices import resolve_devices
from experiments.discover.outcome_table import OutcomeTable
from experiments.report.kit.machine import machine

DECLARED, SEALED, LABELS, FINDINGS, RUNS, NOTES, PAGE = (
    "declared.json",
    "sealed.csv",
    "labels.json",
    "findings.csv",
    "runs.csv",
    "notes.md",
    "README.md",
)
"""Files of a record; labels are there when all is found, notes where something is to be said beside."""


@dataclass(frozen=True)
class Folder:
    """A folder of trials."""

    root: Path

    @property
    def record(self) -> Path:
        """Folder of all that may be seen."""
        return self.root / "record"

    @property
    def hidden(self) -> Path:
        """Folder that only the generator sees."""
        return self.root / "hidden"

    @property
    def data(self) -> Path:
        """Files of measured heaps."""
        return self.root / "data"

    @property
    def declared(self) -> Path:
        """File of the declaration."""
        return self.record / DECLARED

    @property
    def sealed(self) -> Path:
        """Seals of the truths."""
        return self.record / SEALED

    @property
    def hidden_labels(self) -> Path:
        """The truths."""
        return self.hidden / LABELS

    @property
    def findings(self) -> Path:
        """Table of what the analyses found."""
        return self.record / FINDINGS

    def measured(self, trial: str) -> Path:
        """Measured heaps of a trial."""
        return self.data / f"{trial}.csv"

    def discovery(self, job: str) -> Path:
        """The whole of what an analysis found."""
        return self.root / "discoveries" / f"{job}.json"


class Run:
    """A row of the record's table of runs: what ran, where, when, how many cases and how long.

    Used as a context; the row is written however the block ends.

    Parameters
    ----------
    folder
        Of the trials.
    what
        Ran.
    device
        Of the simulator.
    table
        Whose new rows are the cases that were run.
    """

    def __init__(self, folder: Folder, what: str, device: str | None, table: OutcomeTable) -> None:
        self._path, self._what, self._device, self._table = folder.record / RUNS, what, device, table

    def __enter__(self) -> Run:
        self._started, self._before = time.perf_counter(), len(self._table)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        seconds, cases = time.perf_counter() - self._started, len(self._table) - self._before
        devices = resolve_devices(self._device)
        name, warp, date = machine(devices[0]).rsplit(", ", 2)
        name = f"{len(devices)} x {name}" if len(devices) > 1 else name
        new = not self._path.exists()
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("a", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            if new:
                writer.writerow(("what", "machine", "warp", "date", "cases", "seconds"))
            writer.writerow((self._what, name, warp, date, cases, f"{seconds:.1f}"))
