"""The desk where analyses begin and end: their data, their time, what is written down of them."""

from __future__ import annotations

import json
import time
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from doe.discrepancy import (
    Analysis,
    Discovery,
    Emulator,
    Measured,
    Outcomes,
    Point,
    Settings,
    Simulator,
    analyse,
)
from doe.errors import RuleError
from experiments.evidence.trials.findings import VIEWS, Finding, findings_table, read_findings, write_findings
from experiments.evidence.trials.folder import Folder
from experiments.evidence.trials.lockstep import Crash
from experiments.evidence.trials.truth import Sealed
from experiments.io.errors import InputError
from experiments.io.files import write_text
from experiments.io.plain_data import jsonable
from experiments.measurement.measured_file import read_measured
from experiments.studyfile import Study

BATCH = 16384
"""Points between two looks at the clock."""


class OutOfTime(Exception):  # noqa: N818  (an ending that is foreseen, not an error)
    """The time is up; what was simulated is kept."""


class TimedSimulator:
    """A simulator that stops between two batches when the deadline [s] on ``time.monotonic`` has passed."""

    def __init__(self, simulator: Simulator, deadline: float, batch: int = BATCH) -> None:
        self.observables = simulator.observables
        self._simulator, self._deadline, self._batch = simulator, deadline, batch

    def __call__(self, points: Sequence[Point]) -> Outcomes:
        """Observables of every point.

        Points with the same mechanisms come into the same batch, as these run one compiled kernel.

        Raises
        ------
        OutOfTime
            When the deadline passes before all have run.
        """
        order = sorted(range(len(points)), key=lambda i: tuple(name for name, _ in points[i].sizes))
        values = np.full((len(points), len(self.observables)), np.nan)
        reasons = [""] * len(points)
        for start in range(0, len(order), self._batch):
            if time.monotonic() > self._deadline:
                raise OutOfTime
            some = order[start : start + self._batch]
            outcomes = self._simulator([points[i] for i in some])
            values[some] = np.asarray(outcomes.values)
            for i, reason in zip(some, outcomes.reasons, strict=True):
                reasons[i] = reason
        return Outcomes(values, tuple(reasons))


@dataclass(frozen=True, eq=False)
class Desk:
    """Begins analyses by the name of their job, ``TRIAL.VIEW``; goes to other processes as a whole."""

    emulator: Emulator
    settings: Settings
    measured: Mapping[str, Measured]
    """By trial."""
    withheld: Mapping[str, tuple[str, ...]]
    """By trial: mechanisms that the analysis must do without."""

    def __call__(self, job: str) -> Analysis:
        """Begin an analysis."""
        trial, view = parted(job)
        measured = self.measured[trial].only(VIEWS[view])
        emulator = self.emulator.without(*self.withheld[trial])
        return analyse(measured, emulator, self.settings, zlib.crc32(job.encode()))


def job_name(trial: str, view: str) -> str:
    """Name of the analysis of a trial in a view."""
    return f"{trial}.{view}"


def parted(job: str) -> tuple[str, str]:
    """Trial and view of a `job_name`."""
    trial, _, view = job.partition(".")
    return trial, view


def read_data(
    folder: Folder, trials: Sequence[Sealed], study: Study
) -> tuple[dict[str, Measured], dict[str, Crash]]:
    """Read the measured heaps of trials; where the reader refuses a file, its analysis has crashed."""
    measured, refused = {}, {}
    for trial in trials:
        try:
            measured[trial.trial] = read_measured(folder.measured(trial.trial), study)
        except (InputError, RuleError) as error:
            refused[trial.trial] = Crash(str(error))
    return measured, refused


def keep(folder: Folder, ended: Mapping[str, Discovery | Crash]) -> None:
    """Write down how analyses ended: each in full, and a row of the table of findings."""
    if not ended:
        return
    for job, end in ended.items():
        if isinstance(end, Discovery):
            write_text(folder.discovery(job), json.dumps(jsonable(end), allow_nan=False) + "\n")
    fresh = findings_table(Finding.of(*parted(job), end) for job, end in ended.items())
    known = read_findings([folder.findings]) if folder.findings.exists() else fresh.iloc[:0]
    write_findings(folder.findings, pd.concat([known, fresh]) if len(known) else fresh)
