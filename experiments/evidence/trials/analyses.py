"""Analyses of the trials: their data, their time, their results, and many of them in step.

Each analysis is a generator that yields points and is sent their outcomes. They live in worker processes, so
that the statistics of a round take every core; the simulator stays in this process.
"""

import json
import multiprocessing
import os
import sys
import time
import traceback
import zlib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
import pandas as pd

from dem_warp.processes import end_with_parent
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
from experiments.evidence.trials.findings import (
    VIEWS,
    Crash,
    Finding,
    findings_table,
    read_findings,
    write_findings,
)
from experiments.evidence.trials.trials_folder import Folder
from experiments.evidence.trials.truth import Sealed
from experiments.io.errors import InputError
from experiments.io.files import write_text
from experiments.io.plain_data import jsonable
from experiments.measurement.measured_file import read_measured
from experiments.studyfile import Study

BATCH = 16384
"""Points between two checks of the deadline."""

NICENESS = 10
"""Niceness of the processes of the analyses: a GPU must not wait for a core."""

Step = list[Point] | Discovery | Crash
"""Answer of an analysis: points that it asks for, or its result."""

Answers = Mapping[str, Outcomes | None]
"""Outcomes by the name of the analysis that asked for them; None begins one."""

Advance = Callable[[Answers], dict[str, Step]]
"""Takes each named analysis to its next step."""


class OutOfTime(Exception):  # noqa: N818  (an ending that is foreseen, not an error)
    """The deadline has passed; what was simulated is kept."""


class TimedSimulator:
    """A simulator that stops between two batches when the deadline [s] on ``time.monotonic`` has passed."""

    def __init__(self, simulator: Simulator, deadline: float, batch: int = BATCH) -> None:
        self.observables = simulator.observables
        self._simulator, self._deadline, self._batch = simulator, deadline, batch

    def __call__(self, points: Sequence[Point]) -> Outcomes:
        """Return the observables of every point.

        Points with the same mechanisms come into the same batch, as these run one compiled kernel.
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
class TrialAnalyses:
    """Begins the analysis of a name, ``TRIAL.VIEW``; it is sent to other processes as a whole."""

    emulator: Emulator
    settings: Settings
    measured: Mapping[str, Measured]
    """Measured heaps by trial."""
    withheld: Mapping[str, tuple[str, ...]]
    """Mechanisms that the analysis must do without, by trial."""

    def __call__(self, name: str) -> Analysis:
        """Begin an analysis."""
        trial, view = parted(name)
        measured = self.measured[trial].only(VIEWS[view])
        emulator = self.emulator.without(*self.withheld[trial])
        return analyse(measured, emulator, self.settings, zlib.crc32(name.encode()))


def analysis_name(trial: str, view: str) -> str:
    """Name the analysis of a trial in a view."""
    return f"{trial}.{view}"


def parted(name: str) -> tuple[str, str]:
    """Return trial and view of an `analysis_name`."""
    trial, _, view = name.partition(".")
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
    """Write each result in full, and as a row of the table of findings."""
    if not ended:
        return
    for name, end in ended.items():
        if isinstance(end, Discovery):
            write_text(folder.discovery(name), json.dumps(jsonable(end), allow_nan=False) + "\n")
    fresh = findings_table(Finding.of(*parted(name), end) for name, end in ended.items())
    known = read_findings([folder.findings]) if folder.findings.exists() else fresh.iloc[:0]
    write_findings(folder.findings, pd.concat([known, fresh]) if len(known) else fresh)


class Analyses:
    """Analyses that run in this process; `begin` starts the one of a name."""

    def __init__(self, begin: Callable[[str], Analysis]) -> None:
        self._begin = begin
        self._running: dict[str, Analysis] = {}

    def __call__(self, answers: Answers) -> dict[str, Step]:
        """Take one analysis after the other to its next step."""
        return {name: self._step(name, answer) for name, answer in answers.items()}

    def _step(self, name: str, answer: Outcomes | None) -> Step:
        try:
            if answer is None:
                self._running[name] = self._begin(name)
                return next(self._running[name])
            return self._running[name].send(answer)
        except StopIteration as end:
            del self._running[name]
            discovery: Discovery = end.value
            return discovery
        except Exception:
            self._running.pop(name, None)
            return Crash(traceback.format_exc())


@contextmanager
def analysis_processes(begin: Callable[[str], Analysis], workers: int) -> Iterator[Advance]:
    """Spread analyses over processes that end with the block; `begin` must be picklable.

    An analysis stays in the process where it began.
    """
    # Not forked: the parent may hold a CUDA context and threads, which do not survive a fork.
    context = multiprocessing.get_context("spawn")
    with ExitStack() as stack:
        pools = [
            stack.enter_context(ProcessPoolExecutor(1, context, _start, (begin,))) for _ in range(workers)
        ]
        places: dict[str, int] = {}

        def advance(answers: Answers) -> dict[str, Step]:
            shares: dict[int, dict[str, Outcomes | None]] = {}
            for name, answer in answers.items():
                place = places.setdefault(name, len(places) % workers)
                shares.setdefault(place, {})[name] = answer
            ended = [pools[place].submit(_advance, share) for place, share in shares.items()]
            steps = {name: step for future in ended for name, step in future.result().items()}
            return {name: steps[name] for name in answers}

        yield advance


_here: list[Analyses] = []
"""Analyses of this process, where it is one of `analysis_processes`."""


def _start(begin: Callable[[str], Analysis]) -> None:
    if sys.platform != "win32":
        os.nice(NICENESS)
    end_with_parent()
    _here.append(Analyses(begin))


def _advance(answers: Answers) -> dict[str, Step]:
    return _here[0](answers)


@dataclass(frozen=True)
class Round:
    """One step of every running analysis."""

    number: int
    ended: dict[str, Discovery | Crash]
    """Analyses that ended before this round's cases."""
    running: int
    """Number of analyses that ask for cases."""
    cases: int
    """Number of their cases, all in one call."""


def in_step(names: Sequence[str], advance: Advance, simulator: Simulator) -> Iterator[Round]:
    """Run analyses round by round until all have ended.

    A round is yielded before its cases run, so that the caller may stop there; the simulator keeps what it
    has run, and the same analyses then come to the same point again.
    """
    answers: Answers = dict.fromkeys(names)
    number = 0
    while answers:
        steps, number = advance(answers), number + 1
        wanted = {name: step for name, step in steps.items() if isinstance(step, list)}
        ended = {name: step for name, step in steps.items() if not isinstance(step, list)}
        yield Round(number, ended, len(wanted), sum(map(len, wanted.values())))
        answers = dict(zip(wanted, run_together(wanted.values(), simulator), strict=True))


def run_together(batches: Collection[list[Point]], simulator: Simulator) -> list[Outcomes]:
    """Run batches of points in one call, and return the outcomes of each."""
    if not batches:
        return []
    outcomes = simulator([point for batch in batches for point in batch])
    values, ends = np.asarray(outcomes.values), list(accumulate(map(len, batches), initial=0))
    return [Outcomes(values[a:b], outcomes.reasons[a:b]) for a, b in pairwise(ends)]
