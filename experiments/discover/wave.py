"""Waves of cases: simulated by workers, measured beside, kept as they come."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from pathlib import Path

from dem_warp import Case, CaseResult, Progress
from experiments.cases import Engine, Workers
from experiments.cases.engines.engine import NO_ANSWER
from experiments.cases.measuring import measuring_processes
from experiments.cases.store.outcome_table import Outcome, OutcomeTable
from experiments.cases.workers.own import THIS_MACHINE
from experiments.measurement.case_observables import measure
from experiments.studyfile.observables import NAMES
from experiments.studyfile.study import MeasurementSection

SAVE_EVERY = 5.0
"""Time between two savings of what has been measured [s]."""


class WaveRunner:
    """Simulates and measures waves of cases; its processes stay for the next wave until it is closed.

    Parameters
    ----------
    settings
        How pictures are taken and read.
    table
        Where outcomes are kept. What is under way lies in a folder beside it until the wave is kept.
    workers
        Workers that simulate.
    progress
        Called with the progress of a wave.
    engine
        Simulates in the place of dem-warp.
    observables
        Names of what is measured.
    """

    def __init__(
        self,
        settings: MeasurementSection,
        table: OutcomeTable,
        workers: Workers = THIS_MACHINE,
        progress: Callable[[Progress], None] | None = None,
        engine: Engine | None = None,
        observables: Sequence[str] = NAMES,
    ) -> None:
        self._settings, self._table, self._progress = settings, table, progress
        self._workers, self._engine, self._observables = workers, engine, tuple(observables)
        self._measurers: ProcessPoolExecutor | None = None

    def close(self) -> None:
        """End its processes."""
        if self._measurers is not None:
            self._measurers.shutdown(cancel_futures=True)
            self._measurers = None

    def heaps(self, cases: Sequence[Case]) -> list[CaseResult]:
        """Simulate a few cases, measure nothing and keep nothing."""
        return self._workers.simulate(cases, self._engine)

    def run(self, cases: Mapping[str, Case]) -> dict[str, Outcome]:
        """Simulate and measure cases by their keys in the table, and keep the outcomes."""
        if not cases:
            return {}
        measured, keys = _Measured(self._table), list(cases)
        if self._measurers is None:
            self._measurers = measuring_processes(self._workers.helpers, measure, len(cases))
        measurers = self._measurers

        def take(index: int, result: CaseResult) -> None:
            outcome = measurers.submit(measure, self._settings, result, self._observables)
            measured.add(keys[index], outcome, keep=result.status != NO_ANSWER)

        try:
            self._workers.simulate(list(cases.values()), self._engine, take, self._progress, self._unfinished)
            found = measured.finish()
            shutil.rmtree(self._unfinished, ignore_errors=True)
            return found
        except BaseException:
            self.close()
            raise
        finally:
            measured.keep()

    @property
    def _unfinished(self) -> Path:
        """Folder of what is under way."""
        return self._table.path.with_name("unfinished")


class _Measured:
    """Outcomes as they come from the measuring processes; what has come is kept now and then."""

    def __init__(self, table: OutcomeTable) -> None:
        self._table = table
        self._waiting: dict[str, Future[Outcome]] = {}
        self._outcomes: dict[str, Outcome] = {}
        self._passing: set[str] = set()
        self._saved = time.monotonic()

    def add(self, key: str, outcome: Future[Outcome], keep: bool = True) -> None:
        """Await an outcome; one that is not to be kept is tried again by the next run."""
        self._waiting[key] = outcome
        if not keep:
            self._passing.add(key)
        self._keep_in_time()

    def finish(self) -> dict[str, Outcome]:
        """Wait for all, and return them."""
        for outcome in list(self._waiting.values()):
            outcome.result()
            self._keep_in_time()
        self.keep()
        return self._outcomes

    def keep(self) -> None:
        """Save what has been measured since."""
        ready = [key for key, outcome in self._waiting.items() if _is_measured(outcome)]
        fresh = {key: self._waiting.pop(key).result() for key in ready}
        if lasting := {key: outcome for key, outcome in fresh.items() if key not in self._passing}:
            self._table.save(lasting)
        self._outcomes |= fresh
        self._saved = time.monotonic()

    def _keep_in_time(self) -> None:
        if time.monotonic() - self._saved > SAVE_EVERY:
            self.keep()


def _is_measured(outcome: Future[Outcome]) -> bool:
    return outcome.done() and not outcome.cancelled() and outcome.exception() is None
