"""Running cases: a table of settings in, the same table with repose angles out."""

from __future__ import annotations

import logging
import math
import shutil
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import pandas as pd

from dem_warp import Case, CaseResult, Progress
from dem_warp.checkpoint import case_name
from experiments.cases.engines.engine import NO_ANSWER
from experiments.cases.measuring import measuring_processes
from experiments.cases.store.store import Store
from experiments.cases.workers.own import THIS_MACHINE
from experiments.cases.workers.workers import Workers
from experiments.io.errors import StudyError
from experiments.measurement.case_observables import Observed, observe
from experiments.studyfile import Study
from experiments.studyfile.campaign import TARGET_SCENE
from experiments.studyfile.observables import ANGLE
from experiments.studyfile.study import MeasurementSection

RESULT_COLUMNS = ("status", "reason", ANGLE, "angle_se", "case_key")
"""Columns that `run_cases` adds, beside one for every observable of the scene."""

MANY = 64
"""Cases that are worth the start of processes that measure them."""

_log = logging.getLogger(__name__)


class CaseNotes(Protocol):
    """Takes notes of cases while they run; `experiments.journal.journal` has one."""

    def planned(self, table: pd.DataFrame, names: Sequence[str]) -> None:
        """Note the cases of a table, each with its ``case_key`` and its name while it runs."""

    def ended(self, key: str, outcome: Mapping[str, Any]) -> None:
        """Note what a case gave; called from any thread."""


def run_cases(
    study: Study,
    table: pd.DataFrame,
    store: Store,
    workers: Workers = THIS_MACHINE,
    progress: Callable[[Progress], None] | None = None,
    notes: CaseNotes | None = None,
) -> pd.DataFrame:
    """Simulate every case of a table that is not stored yet, all at once, and measure every heap.

    Parameters
    ----------
    study
        Study that the cases are made from, and that says how their angle is read.
    table
        One row a case: factors by name in natural units (one that is missing is at its middle), ``seed``,
        the name of its ``scene`` (without that column, all are of the study's own), and any further columns,
        which are carried over.
    store
        Store of the results; each is saved as it ends, failed ones too: the same case fails again. Only
        what another program gave no valid answer to is not saved, and so tried again by the next run. A run
        that the machine ends raises, and leaves no result of what was running. Checkpoints of the running
        cases are kept there too: what an interrupted run had begun goes on where it was.
    workers
        Workers that simulate; left out: this machine's own.
    progress
        Called with the progress now and then.
    notes
        Takes notes of the cases while they run.

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
    cases, refused = _build_cases(study, table)
    keys = [store.key(case) if case else "" for case in cases]
    by_key = {key: case for key, case in zip(keys, cases, strict=True) if case}
    scenes = dict(zip(keys, _scene_names(table), strict=True))

    def order(key: str) -> tuple[MeasurementSection, bool]:
        return study.measurement, study.scenes[scenes[key]].leaves_a_heap

    def note(key: str, outcome: Future[dict[str, Any]]) -> None:
        if notes and not outcome.cancelled() and outcome.exception() is None:
            notes.ended(key, outcome.result())

    if notes:
        names = [case_name(case) if case else "" for case in cases]
        notes.planned(table.assign(case_key=keys), names)
    with _measurers(workers, len(by_key)) as pool:
        outcomes = _simulate_missing(by_key, store, pool, order, workers, progress, note)
        for key in by_key.keys() - outcomes.keys():
            outcomes[key] = pool.submit(_stored_outcome, store.folder, key, *order(key))
            outcomes[key].add_done_callback(partial(note, key))
        rows = [
            outcomes[key].result() if key else _outcome("refused", Observed(reason=reason))
            for key, reason in zip(keys, refused, strict=True)
        ]
    results = pd.DataFrame(rows, index=table.index)
    results["case_key"] = keys
    return pd.concat([table, results], axis=1)


def _check_columns(table: pd.DataFrame) -> None:
    if "seed" not in table.columns:
        has = ", ".join(map(str, table.columns))
        raise ValueError(f"a table of cases needs the column 'seed', has {has}")
    if taken := [name for name in RESULT_COLUMNS if name in table.columns]:
        raise ValueError(f"a table of cases must not have the columns of its results: {', '.join(taken)}")


def _build_cases(study: Study, table: pd.DataFrame) -> tuple[list[Case | None], list[str]]:
    """Build every row's case; a row that breaks a physical rule has none, and the reason instead."""
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


def _simulate_missing(
    cases: dict[str, Case],
    store: Store,
    pool: Executor,
    order: Callable[[str], tuple[MeasurementSection, bool]],
    workers: Workers,
    progress: Callable[[Progress], None] | None,
    note: Callable[[str, Future[dict[str, Any]]], None],
) -> dict[str, Future[dict[str, Any]]]:
    """Simulate what the store lacks, in one call; save each result as it finishes, and measure it.

    The checkpoints of cases that were interrupted are taken up, and removed when all have ended.
    """
    missing = [key for key in cases if not store.has(key)]
    for key in missing:
        if damage := store.damage(key):
            _log.warning("%s; it is simulated again", damage)
    outcomes: dict[str, Future[dict[str, Any]]] = {}

    def keep(index: int, result: CaseResult) -> None:
        key = missing[index]
        if result.status != NO_ANSWER:
            store.save(key, result)
        outcomes[key] = pool.submit(_measured, result, *order(key))
        outcomes[key].add_done_callback(partial(note, key))

    if missing:
        chosen = [cases[key] for key in missing]
        workers.simulate(chosen, store.engine, keep, progress, store.unfinished)
        shutil.rmtree(store.unfinished, ignore_errors=True)
    return outcomes


def _measurers(workers: Workers, count: int) -> Executor:
    """Measure in processes where there is much to measure and the cores of this machine are free for it."""
    if count >= MANY and workers.leaves_cores:
        return measuring_processes(workers.helpers, _measured, count)
    return ThreadPoolExecutor(max_workers=workers.helpers)


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
