"""Running cases: they are simulated, kept and measured; with a table, the same table with results out."""

from __future__ import annotations

import logging
import math
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future
from functools import partial
from pathlib import Path
from typing import Any, Protocol, Self

import pandas as pd

from dem_warp import Case, CaseResult
from dem_warp.checkpoint import case_name
from dem_warp.result import OnProgress
from experiments.cases.engines.engine import NO_ANSWER, Engine
from experiments.cases.measuring import MeasuringThreads, measuring_processes
from experiments.cases.store.outcome_table import Outcome, OutcomeTable
from experiments.cases.store.store import Store
from experiments.cases.workers.own import THIS_MACHINE
from experiments.cases.workers.workers import Workers
from experiments.io.errors import StudyError
from experiments.measurement.case_observables import Observed, observe, with_bulk_density
from experiments.studyfile import Study
from experiments.studyfile.campaign import TARGET_SCENE
from experiments.studyfile.observables import ANGLE
from experiments.studyfile.study import MeasurementSection

RESULT_COLUMNS = ("status", "reason", ANGLE, "angle_se", "case_key")
"""Columns that `run_cases` adds, next to one for every observable of the scene."""

MANY = 64
"""Cases that are worth the start of processes that measure them."""

SAVE_EVERY = 5.0
"""Time between two savings of numbers [s]."""

_log = logging.getLogger(__name__)


class CaseNotes(Protocol):
    """Takes notes of cases while they run; `experiments.journal.journal` has one."""

    def planned(self, table: pd.DataFrame, names: Sequence[str]) -> None:
        """Note the cases of a table, each with its ``case_key`` and its name while it runs."""

    def ended(self, key: str, outcome: Mapping[str, Any]) -> None:
        """Note what a case gave; called from any thread."""


class CaseRunner:
    """Simulates cases, all of a call at once, and measures those that have ended meanwhile.

    Use it as a context, or call `close`: its processes stay for the next call.

    Parameters
    ----------
    keep
        Place of what is kept: a `Store` keeps heaps, each before the next case ends; an `OutcomeTable` keeps
        numbers, those that are measured every `SAVE_EVERY` seconds. Checkpoints are kept next to it, until a
        call has ended. What another program gave no valid answer to is not kept, and tried again by the next
        run.
    measure
        Function of a result and of what `run` gives for its case; it goes to other processes.
    workers, engine
        Workers that simulate, and the engine; None: dem-warp's own.
    cases
        Cases that are expected; few of them are measured in threads. Default: many.
    """

    def __init__(
        self,
        keep: Store | OutcomeTable,
        measure: Callable[..., Any],
        workers: Workers = THIS_MACHINE,
        engine: Engine | None = None,
        cases: int | None = None,
    ) -> None:
        self._keep, self._measure, self._workers, self._engine = keep, measure, workers, engine
        self._cases = cases
        self._pool: Executor | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End its processes."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
            self._pool = None

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Call a function where results are measured."""
        self._pool = self._pool or self._measurers(1)
        return self._pool.submit(function, *arguments)

    def run(
        self,
        cases: Mapping[str, Case],
        given: Callable[[str], tuple[Any, ...]],
        progress: OnProgress | None = None,
        ended: Callable[[str, Future[Any]], None] = lambda key, outcome: None,
    ) -> dict[str, Any]:
        """Simulate and measure cases by their keys; return what `measure` found.

        Parameters
        ----------
        given
            Further arguments of `measure`, by the key of the case.
        ended
            Called with the key of each case and what was measured, from any thread.
        """
        if not cases:
            return {}
        keys = list(cases)
        outcomes: dict[str, Future[Any]] = {}
        self._pool = self._pool or self._measurers(len(cases))
        numbers = _Numbers(self._keep) if isinstance(self._keep, OutcomeTable) else None

        def take(index: int, result: CaseResult) -> None:
            key, lasts = keys[index], result.status != NO_ANSWER
            if lasts and isinstance(self._keep, Store):
                self._keep.save(key, result)
            outcomes[key] = self.submit(self._measure, result, *given(key))
            outcomes[key].add_done_callback(partial(ended, key))
            if lasts and numbers:
                numbers.add(key, outcomes[key])

        try:
            unfinished = self._keep.unfinished
            self._workers.simulate(list(cases.values()), self._engine, take, progress, unfinished)
            found = {}
            for key, outcome in outcomes.items():
                found[key] = outcome.result()
                if numbers:
                    numbers.save_in_time()
        except BaseException:
            self.close()
            raise
        finally:
            if numbers:
                numbers.save()
        shutil.rmtree(unfinished, ignore_errors=True)
        return found

    def _measurers(self, count: int) -> Executor:
        """Measure in processes; a few heaps, or while the cores of this machine simulate, in threads."""
        workers = self._workers
        if self._cases is None or (self._cases >= MANY and workers.leaves_cores):
            return measuring_processes(workers.helpers, self._measure, count)
        return MeasuringThreads(workers.helpers)


class _Numbers:
    """Numbers of cases as they are measured, saved now and then."""

    def __init__(self, table: OutcomeTable) -> None:
        self._table, self._saved = table, time.monotonic()
        self._waiting: dict[str, Future[Outcome]] = {}

    def add(self, key: str, outcome: Future[Outcome]) -> None:
        """Await the numbers of a case."""
        self._waiting[key] = outcome
        self.save_in_time()

    def save_in_time(self) -> None:
        """Save what was measured, if the last saving is old enough."""
        if time.monotonic() - self._saved > SAVE_EVERY:
            self.save()

    def save(self) -> None:
        """Save what was measured."""
        ready = [key for key, outcome in self._waiting.items() if _is_measured(outcome)]
        if fresh := {key: self._waiting.pop(key).result() for key in ready}:
            self._table.save(fresh)
        self._saved = time.monotonic()


def _is_measured(outcome: Future[Any]) -> bool:
    return outcome.done() and not outcome.cancelled() and outcome.exception() is None


def run_cases(
    study: Study,
    table: pd.DataFrame,
    store: Store,
    workers: Workers = THIS_MACHINE,
    progress: OnProgress | None = None,
    notes: CaseNotes | None = None,
    measured: dict[str, dict[str, Any]] | None = None,
) -> pd.DataFrame:
    """Simulate every case of a table that is not stored yet, all at once, and measure every heap.

    Parameters
    ----------
    study
        Study of the cases; it says how their angle is read.
    table
        One row a case: factors by name in natural units (default: the middle), ``seed``, the name of its
        ``scene`` (default: the study's own), and any further columns, which are carried over.
    store
        Store of the results; each is saved as it ends, failed ones too: the same case fails again. A run
        that is interrupted leaves checkpoints there, and continues from them.
    workers
        Workers that simulate; default: this machine's own.
    progress
        Called with the progress now and then.
    notes
        Takes notes of the cases while they run.
    measured
        What earlier calls for this study measured, by the keys of the cases; this call adds to it.

    Returns
    -------
    pandas.DataFrame
        The same rows and index with ``status``, ``reason``, ``angle`` and ``angle_se`` [deg], ``case_key``,
        and one column an observable. A case that fails is a row with its status and reason, and without an
        angle; so is a heap that cannot be measured. The cases of a test that leaves no heap have no angles.

    Raises
    ------
    ValueError
        When the table has no seeds, or a column that this function adds.
    """
    _check_columns(table)
    cases, refused = build_cases(study, table)
    keys = [store.key(case) if case else "" for case in cases]
    by_key = {key: case for key, case in zip(keys, cases, strict=True) if case}
    scenes = dict(zip(keys, _scene_names(table), strict=True))
    outcomes = {} if measured is None else measured
    new = {key: case for key, case in by_key.items() if key not in outcomes}

    def given(key: str) -> tuple[MeasurementSection, bool]:
        return study.measurement, study.scenes[scenes[key]].leaves_a_heap

    def note(key: str, outcome: Future[dict[str, Any]]) -> None:
        if notes and _is_measured(outcome):
            notes.ended(key, outcome.result())

    if notes:
        names = [case_name(case) if case else "" for case in cases]
        notes.planned(table.assign(case_key=keys), names)
    with CaseRunner(store, _measured, workers, store.engine, len(new)) as runner:
        outcomes |= runner.run(_missing(new, store), given, progress, note)
        stored = {
            key: runner.submit(_stored_outcome, store.folder, key, *given(key))
            for key in new.keys() - outcomes.keys()
        }
        for key, outcome in stored.items():
            outcome.add_done_callback(partial(note, key))
        outcomes |= {key: outcome.result() for key, outcome in stored.items()}
    rows = [
        with_bulk_density(outcomes[key], case) if case else _outcome("refused", Observed(reason=reason))
        for key, case, reason in zip(keys, cases, refused, strict=True)
    ]
    results = pd.DataFrame(rows, index=table.index)
    results["case_key"] = keys
    return pd.concat([table, results], axis=1)


def _missing(cases: Mapping[str, Case], store: Store) -> dict[str, Case]:
    """Return the cases that a store lacks, or of which it has a damaged file."""
    missing = {key: case for key, case in cases.items() if not store.has(key)}
    for key in missing:
        if damage := store.damage(key):
            _log.warning("%s; it is simulated again", damage)
    return missing


def _check_columns(table: pd.DataFrame) -> None:
    if "seed" not in table.columns:
        has = ", ".join(map(str, table.columns))
        raise ValueError(f"a table of cases needs the column 'seed', has {has}")
    if taken := [name for name in RESULT_COLUMNS if name in table.columns]:
        raise ValueError(f"a table of cases must not have the columns of its results: {', '.join(taken)}")


def build_cases(study: Study, table: pd.DataFrame) -> tuple[list[Case | None], list[str]]:
    """Build every row's case; a row that breaks a physical rule has no case, and the reason instead."""
    names = [factor.name for factor in study.factors if factor.name in table.columns]
    rows = zip(table[names].to_dict("records"), table["seed"], _scene_names(table), strict=True)
    cases: list[Case | None] = []
    refused = []
    for settings, seed, scene in rows:
        values = {str(name): float(value) for name, value in settings.items()}
        try:
            cases.append(study.case(values, int(seed), scene))
            refused.append("")
        except StudyError as error:
            cases.append(None)
            refused.append(str(error))
    return cases, refused


def _scene_names(table: pd.DataFrame) -> list[str]:
    """Names of the scene of every row."""
    return table["scene"].tolist() if "scene" in table.columns else [TARGET_SCENE] * len(table)


def _stored_outcome(
    folder: Path, key: str, measurement: MeasurementSection, leaves_a_heap: bool
) -> dict[str, Any]:
    return _measured(Store(folder).load(key), measurement, leaves_a_heap)


def _measured(result: CaseResult, measurement: MeasurementSection, leaves_a_heap: bool) -> dict[str, Any]:
    return _outcome(result.status, observe(measurement, result, leaves_a_heap))


def _outcome(status: str, found: Observed) -> dict[str, Any]:
    """Columns of a case; NaN where there is no angle."""
    error = math.nan if found.angle is None else found.angle.se
    return {"status": status, "reason": found.reason, ANGLE: math.nan, "angle_se": error, **found.observables}
