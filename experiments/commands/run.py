"""A whole calibration in a folder: every case stored as it finishes, the report at the end."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import pandas as pd

from dem_warp import Progress
from experiments.calibrate import Campaign, calibrate
from experiments.calibrate.campaign import StageHook
from experiments.calibrate.checks import check_study
from experiments.cases import open_folder, run_cases
from experiments.errors import StudyError
from experiments.report import heap_pictures, write_report
from experiments.study import Study

Watch = Callable[[str], AbstractContextManager[Callable[[Progress], None] | None]]
"""Opens the display of one batch, named by its stages, and hands out what its progress is reported to."""

_log = logging.getLogger(__name__)


def run_campaign(
    study: Study,
    folder: Path,
    device: str | None = None,
    workers: int | None = None,
    resume: bool = False,
    watch: Watch = lambda title: nullcontext(),
    on_stage: StageHook | None = None,
) -> Campaign:
    """Calibrate a study and write its report.

    Parameters
    ----------
    study
        What to calibrate.
    folder
        Where everything goes: the cases, ``report.html``, ``results.json``, ``tables/*.csv``.
    device
        ``"cpu"``, ``"cuda"``, ``"cuda:1"``; None: the engine's choice.
    workers
        Processes on the CPU; None: the engine's choice.
    resume
        Go on in the folder of an earlier run: what it has simulated is not simulated again, and what it had
        begun goes on from its checkpoint.
    watch
        Display of each batch of cases.
    on_stage
        Called with the name and the result of every finished stage.

    Returns
    -------
    Campaign
        What every stage found, and how the campaign ended.

    Raises
    ------
    StudyError
        When the study cannot be calibrated; nothing is written then.
    StoreError
        When the folder is in use, or is not one to resume; nothing is written then.
    """
    _require_calibratable(study)
    store, changes = open_folder(folder, study, resume)
    for change in changes:
        _log.warning("The study has changed since the earlier run: %s", change)
    started = time.perf_counter()

    def runner(table: pd.DataFrame) -> pd.DataFrame:
        title = ", ".join(str(stage).replace("_", " ") for stage in table["stage"].unique())
        with watch(title) as progress:
            return run_cases(study, table, store, device, workers, progress)

    campaign = calibrate(study, runner, on_stage)
    provenance = {"device": device, "workers": workers, "seconds": round(time.perf_counter() - started, 1)}
    pictures = heap_pictures(campaign, study, store.load)
    write_report(campaign, study, folder, pictures=pictures, provenance=provenance)
    return campaign


def _require_calibratable(study: Study) -> None:
    if not study.scene.leaves_a_heap:
        rule = "a calibration measures heaps, so its test must be [scene.lifted-cylinder]"
        raise StudyError(rule, "another", f"{study.file}: scene")
    if not study.factors:
        raise StudyError("a calibration needs at least one [[factor]]", "none", str(study.file))
    try:
        check_study(study)
    except StudyError:
        raise
    except ValueError as error:
        raise StudyError("the decisions must fit the factors", str(error), str(study.file)) from error
