"""A run in its folder: lock, journal, workers, batches and their wall times, outputs, provenance."""

from __future__ import annotations

import datetime
import logging
import os
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd
from filelock import FileLock, Timeout

from dem_warp import Progress
from dem_warp.result import OnProgress
from dem_warp.version import source_commit
from doe.errors import RuleError
from experiments.cases import Store, Workers, open_folder, open_workers, run_cases
from experiments.cases.engines.key import engine_identity
from experiments.cases.forecast.speed import note_batch
from experiments.cases.forecast.work import rest_of
from experiments.cases.store.folder import is_used, require_usable
from experiments.cases.store.outputs import is_listed, publishing
from experiments.cases.workers.own import watched_by
from experiments.io.errors import InputError, StoreError
from experiments.io.files import JOURNAL, LOCK, remove_leftovers, require_folder, write_text
from experiments.journal.journal import Journal
from experiments.runs.choices import Prepared
from experiments.runs.request import Watch
from experiments.studyfile import Study
from experiments.studyfile.campaign import Response
from experiments.studyfile.manifest import MANIFEST, write_manifest

WALL_TIMES_FILE = "wall_times.csv"
"""File of the wall times of a folder's batches, over all its runs."""

SAVE_WALL_TIME = 5.0
"""Time between two notes of the wall time of a batch [s]: a run that is killed loses no more."""

OUTCOMES, BANK = "outcomes.sqlite", "bank.npz"
"""Files that the searches of a folder share: the numbers of the cases, the bank."""

IN_USE = "another run is using this folder"
"""Problem of a folder where another process holds the lock."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Run:
    """A run that works in its folder."""

    study: Study
    folder: Path
    store: Store
    workers: Workers
    journal: Journal
    watch: Watch
    simulated: list[float] = field(default_factory=list)
    """Time from the start of each batch to its last progress [s]."""
    measured: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Measurements of the study's cases so far, by their keys."""

    @property
    def is_by_hand(self) -> bool:
        """True if a person simulates the cases."""
        return self.study.engine is not None and self.study.engine.by is not None

    @contextmanager
    def batch(self, title: str, kept: Callable[[], int]) -> Iterator[OnProgress]:
        """Show a batch of cases and note it in the journal; the block's value takes its progress.

        `kept` counts the cases that are kept: if some are added, the wall time of the batch is saved; that of
        a batch that is killed is saved on the way.
        """
        before, started, last = kept(), time.perf_counter(), 0.0
        earlier, saved = self.wall_times, 0.0

        def save(seconds: float) -> None:
            row = {"stage": title, "simulated": kept() - before, "seconds": round(seconds, 1)}
            rows = pd.DataFrame([*earlier, row])
            write_text(self.folder / WALL_TIMES_FILE, rows.to_csv(index=False))

        with self.watch(title) as shown, self.journal.batch(title) as noted:

            def report(progress: Progress) -> None:
                nonlocal last, saved
                last = time.perf_counter() - started
                if last >= saved + SAVE_WALL_TIME:
                    saved = last
                    save(last)
                noted(progress)
                if shown is not None:
                    shown(progress)

            yield report
        self.simulated.append(last)
        if not (self.folder / MANIFEST).exists():
            # someone removed the folder meanwhile: a later run can continue from what comes now
            write_manifest(self.folder, self.study)
        if saved or kept() > before:
            save(time.perf_counter() - started)

    def run_cases(self, table: pd.DataFrame, title: str, asked_for: Sequence[Response] = ()) -> pd.DataFrame:
        """Simulate the cases of a table that are not stored yet, as one batch, and measure all of them.

        A person is asked for some responses, or for those of the study.
        """
        if self.is_by_hand:
            # few studies are; what reads their sheets takes a second to load
            from experiments.runs.by_hand import typed_cases

            return typed_cases(self.study, table, self.folder, title, self.store, asked_for)
        with self.batch(title, lambda: len(self.store)) as progress:
            more = (self.workers, progress, self.journal, self.measured)
            return run_cases(self.study, table, self.store, *more)

    def publishing(self, **made_from: object) -> AbstractContextManager[Path]:
        """Folder for drafts of outputs, which take their places when the block ends well."""
        made_by = self.store.engine and engine_identity(self.store.engine)
        lasting = lasting_files(self.folder, self.study)
        return publishing(self.folder, self.study, lasting, simulated_by=made_by, **made_from)

    @property
    def wall_times(self) -> list[dict[str, Any]]:
        """Wall times so far, a row a batch: stage, simulated (cases), seconds."""
        path = self.folder / WALL_TIMES_FILE
        return pd.read_csv(path).to_dict("records") if path.is_file() else []

    @property
    def provenance(self) -> dict[str, Any]:
        """Commit, day, workers, and the wall time of all batches, those of earlier parts of the run too."""
        day, seconds = datetime.datetime.now(datetime.UTC).date(), sum(b["seconds"] for b in self.wall_times)
        made = {"commit": source_commit(), "date": day.isoformat(), **self.workers.described}
        return made | {"seconds": round(seconds, 1)}


@contextmanager
def open_run(command: str, prepared: Prepared, work: str = "") -> Iterator[Run]:
    """Lock the folder of a run, make its workers ready and begin its journal; all end with the block.

    What a run takes apart from its batches is noted under its `work`; default: the command.

    Raise InputError when the folder is in use, or is not one to resume, or workers are missing; nothing is
    written then.
    """
    study, folder, resume = prepared.study, prepared.folder, prepared.request.resume
    with (
        locked(folder, resume),
        open_workers(prepared.resources) as workers,
        Journal(folder, command, study, resume, device=str(workers.described.get("device", ""))) as journal,
    ):
        store, changes = open_folder(folder, study, resume)
        for change in changes:
            _log.warning("The study has changed since the earlier run: %s", change)
        watched = watched_by(workers, journal.previews)
        run = Run(study, folder, store, watched, journal, prepared.request.watch)
        yield run
        if any(run.simulated) and not resume:
            rest = time.perf_counter() - prepared.request.made - sum(run.simulated)
            note_batch([rest_of(work or command)], workers, 1.0, rest)


@contextmanager
def locked(folder: Path, resume: bool = False) -> Iterator[None]:
    """Keep every other run out of a folder; a new run makes it when it is missing.

    Raise StoreError when another run is using it, it holds something and is not to be resumed, or there is
    nothing to resume. Nothing is written then.
    """
    _require_free(folder)
    require_usable(folder, resume)
    require_folder(folder)
    lock, made = FileLock(folder / LOCK, timeout=0), not os.path.lexists(folder)
    folder.mkdir(parents=True, exist_ok=True)
    try:
        lock.acquire()
    except Timeout:
        raise StoreError(str(folder), IN_USE) from None
    try:
        # another run may have come and gone since
        require_usable(folder, resume)
        remove_leftovers(folder)
        yield
    finally:
        if made and not is_used(folder):
            _remove_unused(folder)
        lock.release()


def _require_free(folder: Path) -> None:
    """Refuse a folder that another run has locked; no file is made."""
    path = folder / LOCK
    # pathlib raises where a name is too long for the system
    if os.path.islink(path) or not os.path.isfile(path):
        return
    with suppress(OSError):
        try:
            FileLock(path, timeout=0).acquire().lock.release()
        except Timeout:
            raise StoreError(str(folder), IN_USE) from None


def _remove_unused(folder: Path) -> None:
    """Remove a folder that holds a lock alone, so that a run that was refused leaves nothing."""
    # another system may keep a file that is open, and another run may write into the folder just now
    with suppress(OSError):
        shutil.rmtree(folder / JOURNAL, ignore_errors=True)
        (folder / LOCK).unlink()
        folder.rmdir()


def lasting_files(folder: Path, study: Study) -> dict[str, bool]:
    """Name the bank that searches made in a folder, and whether it serves a study; empty without one.

    A bank of another study may be removed: its cases are in the table of outcomes, which stays, and a search
    makes the bank of them again. A bank with no such table, and not listed, is a person's own and stays.
    """
    path = folder / BANK
    if not path.is_file() or not ((folder / OUTCOMES).is_file() or is_listed(folder, BANK)):
        return {}
    # few folders hold one, and what reads it takes a second to load
    from experiments.discover.search import Search

    try:
        Search.of(study).read_bank(path)
    except (InputError, RuleError):
        return {BANK: False}
    return {BANK: True}
