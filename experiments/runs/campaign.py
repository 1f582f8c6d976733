"""A calibration in a folder, and published runs: cases stored as they finish, reports at the end."""

from __future__ import annotations

import datetime
import logging
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from dem_warp import Progress
from dem_warp.version import source_commit
from experiments.calibrate import Campaign, calibrate
from experiments.calibrate.checks import check_calibration
from experiments.calibrate.results import StageResult
from experiments.calibrate.stages import StageHook
from experiments.cases import Store, Workers, open_folder, run_cases
from experiments.cases.engines.key import engine_identity
from experiments.cases.store.outputs import publishing
from experiments.cases.workers.own import THIS_MACHINE, watched_by
from experiments.io.errors import StudyError
from experiments.io.files import write_text
from experiments.io.plain_data import jsonable
from experiments.journal.journal import Journal
from experiments.measurement.measured_target import with_measurements
from experiments.report import heap_pictures, verified_heap, write_report
from experiments.report.study_companion import Replay, companion_of
from experiments.report.writer import library_versions
from experiments.runs.lasting import lasting_files
from experiments.studyfile import Study
from experiments.studyfile.campaign import scenes_of
from experiments.studyfile.manifest import MANIFEST, write_manifest

Watch = Callable[[str], AbstractContextManager[Callable[[Progress], None] | None]]
"""Opens the display of one batch, named by its stages, and hands out what its progress is reported to."""


@contextmanager
def watching(
    title: str, watch: Watch, journal: Journal | None
) -> Iterator[Callable[[Progress], None] | None]:
    """Open the display of a batch, and its place in the journal; hand out what progress is reported to."""
    with watch(title) as shown, journal.batch(title) if journal else nullcontext() as noted:
        listeners = [each for each in (shown, noted) if each is not None]

        def report(progress: Progress) -> None:
            for listener in listeners:
                listener(progress)

        yield report if listeners else None


WALL_TIMES = "wall_times"
WALL_TIMES_FILE = f"{WALL_TIMES}.csv"
"""File of the wall times of a folder's batches, over all runs that went on in it."""

RECORD = "record"
"""Folder of the page on published runs."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Desk:
    """Place and means of running cases: a study, its folder, the workers."""

    study: Study
    folder: Path
    store: Store
    workers: Workers
    watch: Watch
    journal: Journal | None = None

    @classmethod
    def open(
        cls,
        study: Study,
        folder: Path,
        workers: Workers = THIS_MACHINE,
        resume: bool = False,
        watch: Watch = lambda title: nullcontext(),
        journal: Journal | None = None,
    ) -> Desk:
        """Make the folder of a study, or go on in it.

        Raises
        ------
        StoreError
            When the folder is in use, or is not one to resume; nothing is written then.
        """
        store, changes = open_folder(folder, study, resume)
        for change in changes:
            _log.warning("The study has changed since the earlier run: %s", change)
        workers = watched_by(workers, journal.glimpses) if journal else workers
        return cls(study, folder, store, workers, watch, journal)

    def run(self, table: pd.DataFrame, title: str) -> pd.DataFrame:
        """Simulate a table of cases as one batch, and note the wall time of what was not stored yet."""
        before, started = len(self.store), time.perf_counter()
        with watching(title, self.watch, self.journal) as progress:
            cases = run_cases(self.study, table, self.store, self.workers, progress, self.journal)
        if not (self.folder / MANIFEST).exists():
            # someone removed the folder meanwhile: what comes now can be gone on from
            write_manifest(self.folder, self.study)
        if simulated := len(self.store) - before:
            self._note_wall_time(title, simulated, time.perf_counter() - started)
        return cases

    def publishing(self) -> AbstractContextManager[Path]:
        """Folder for drafts of outputs, which take their places when the block ends well."""
        engine = self.store.engine
        made_by = engine and engine_identity(engine)
        lasting = lasting_files(self.folder, self.study)
        return publishing(self.folder, self.study, lasting, simulated_by=made_by)

    @property
    def wall_times(self) -> pd.DataFrame:
        """Wall times so far: stage, simulated (cases), seconds."""
        path = self.folder / WALL_TIMES_FILE
        none = pd.DataFrame(columns=["stage", "simulated", "seconds"])
        return pd.read_csv(path) if path.is_file() else none

    def _note_wall_time(self, title: str, simulated: int, seconds: float) -> None:
        row = {"stage": title, "simulated": simulated, "seconds": round(seconds, 1)}
        noted = [*self.wall_times.to_dict("records"), row]
        write_text(self.folder / WALL_TIMES_FILE, pd.DataFrame(noted).to_csv(index=False))


def run_campaign(desk: Desk, on_stage: StageHook | None = None, replay: Replay | None = None) -> Campaign:
    """Calibrate a study and write its report, its tables and its material card, a replay set beside."""

    def runner(table: pd.DataFrame) -> pd.DataFrame:
        return desk.run(table, ", ".join(str(stage).replace("_", " ") for stage in table["stage"].unique()))

    def tell(name: str, result: StageResult) -> None:
        for told in (desk.journal.stage if desk.journal else None, on_stage):
            if told:
                told(name, result)

    started = time.perf_counter()
    campaign = calibrate(desk.study, runner, tell)
    provenance = {
        **_source_and_day(),
        **desk.workers.described,
        "seconds": round(time.perf_counter() - started, 1),
        "engine": _engine(desk, campaign.cases),
    }
    pictures = heap_pictures(campaign, desk.study, desk.store.load)
    solid = verified_heap(campaign, desk.store.load)
    with desk.publishing() as drafts:
        write_report(campaign, desk.study, drafts, pictures, provenance, solid)
    return campaign


def replay_published(desk: Desk, replicates: int) -> Replay:
    """Simulate the published runs of a study again, each of their stages as one batch.

    Raises
    ------
    StudyError
        When the study has no published runs.
    """
    companion = companion_of(desk.study)
    tables = [desk.run(table, title) for title, table in companion.planned_runs(replicates).items()]
    replay = companion.replay(pd.concat(tables, ignore_index=True)) if tables else None
    if replay is None:
        raise _no_published_runs(desk.study)
    return replay


def record_published(desk: Desk, replay: Replay, campaign: Campaign | None = None) -> Path:
    """Write the page on published runs, its tables and its picture into the folder ``record``."""
    made_by = _provenance(desk, replay)
    with desk.publishing() as drafts:
        page = replay.write_record(drafts / RECORD, desk.study, desk.store.load, made_by, campaign)
    return desk.folder / page.relative_to(drafts)


def found_by(campaign: Campaign | None, replay: Replay | None) -> dict[str, Any]:
    """Everything that was found as JSON-able data: the campaign's results, published runs as ``paper``."""
    found = campaign.to_dict() if campaign else {}
    return found | ({"paper": jsonable(replay.tables())} if replay else {})


def check_runs(study: Study, campaign: bool = True, paper: bool = False) -> Study:
    """Check that a campaign or the paper's runs can be run, before a folder is made; return the study to run.

    In it, pictures or a file of the target are numbers.

    Raises
    ------
    InputError
        When the study has no factors, its decisions do not fit them, it has no published runs, or the
        pictures or the file of its target cannot be used.
    """
    if not companion_of(study).planned_runs(1) and paper:
        raise _no_published_runs(study)
    if not campaign:
        return study
    study, notes = with_measurements(study)
    for note in notes:
        _log.warning("The measurements: %s", note)
    check_calibration(study)
    for scene in scenes_of(study.target.fitted):
        study.case({}, 0, scene)  # the noise floor's, that cannot begin without it
    return study


def _no_published_runs(study: Study) -> StudyError:
    rule = "only a study whose companion has published runs can follow them"
    return StudyError(str(study.file), rule, study.companion or "no companion")


def _provenance(desk: Desk, replay: Replay) -> dict[str, Any]:
    """Provenance of the published runs: commit, day, machine, scale, wall times."""
    return {
        "scale": desk.study.scale,
        "fit": desk.study.measurement.fit,
        **_source_and_day(),
        **_engine(desk, replay.cases),
        "versions": library_versions(),
        WALL_TIMES: desk.wall_times.to_dict("records"),
    }


def _source_and_day() -> dict[str, Any]:
    return {"commit": source_commit(), "date": datetime.datetime.now(datetime.UTC).date().isoformat()}


def _engine(desk: Desk, cases: pd.DataFrame) -> dict[str, Any]:
    """Provenance of the first of some cases: device, precision, versions."""
    key = cases["case_key"].iloc[0]
    return desk.store.load(key).provenance if desk.store.has(key) else {}
