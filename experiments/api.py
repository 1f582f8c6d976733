"""Calibration and search as functions: the command line calls them, and so may a script or a notebook."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.bridge.crossing import check_order, cross
from experiments.bridge.result import Crossing
from experiments.bridge.source import read_source
from experiments.calibrate import Campaign
from experiments.calibrate.stages import StageHook
from experiments.cases import open_workers, with_engine
from experiments.cases.store.folder import locked
from experiments.io.errors import InputError
from experiments.journal.journal import Journal
from experiments.report.corrected_card import write_crossing
from experiments.report.material_card import CARD
from experiments.report.study_companion import Replay
from experiments.runs.campaign import (
    Desk,
    Watch,
    check_runs,
    found_by,
    record_published,
    replay_published,
    run_campaign,
)
from experiments.runs.choices import chosen_resources, chosen_study, default_folder, resources_for
from experiments.runs.search import Job, SearchResult, run_search
from experiments.studyfile import Study

__all__ = ["Bridge", "Calibration", "SearchResult", "bridge", "calibrate", "discover"]


@dataclass(frozen=True)
class Calibration:
    """A calibration that has ended."""

    folder: Path
    """Folder of everything that it wrote."""
    campaign: Campaign | None
    """Results of every stage; None where only published runs were wanted."""
    replay: Replay | None
    """Runs published for the study, simulated again; None where they were not wanted."""
    record: Path | None
    """Page on the published runs."""

    @property
    def report(self) -> Path:
        """Page of the campaign."""
        return self.folder / "report.html"

    def to_dict(self) -> dict[str, Any]:
        """Everything that was found as JSON-able data."""
        return found_by(self.campaign, self.replay)


@dataclass(frozen=True)
class Bridge:
    """A bridge that has ended."""

    folder: Path
    """Folder of everything that it wrote."""
    crossing: Crossing
    """Shift, scale, the corrected point, and what fresh runs gave."""

    @property
    def card(self) -> Path | None:
        """The corrected card; None where no point was found."""
        return self.folder / CARD if self.crossing.point is not None else None

    def to_dict(self) -> dict[str, Any]:
        """Everything that was found as JSON-able data."""
        return self.crossing.to_dict()


def calibrate(
    study: Study | str | Path | None = None,
    out: str | Path | None = None,
    *,
    scale: str | None = None,
    device: str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    cluster: str | Path | None = None,
    engine: str | None = None,
    resume: bool = False,
    published_replicates: int = 0,
    campaign: bool = True,
    watch: Watch = lambda title: nullcontext(),
    on_stage: StageHook | None = None,
) -> Calibration:
    """Calibrate the contact parameters of a study, and write the report into a folder.

    Parameters
    ----------
    study
        A study, or its file; None: the paper's buckwheat.
    out
        Folder of the results, new or empty; None: ``out/NAME-SCALE``.
    scale
        A scale of the study's file; None: the one for the device, ``paper`` on a GPU and ``bench`` without.
    device
        ``"cpu"``, ``"cuda"``, ``"cuda:1"``, or several GPUs between commas; None: the GPU if there is one.
    workers
        Processes on the CPU, GPUs of this machine, or workers of a cluster; None: one a core, one GPU, those
        of the cluster.
    scheduler
        Address of a Dask scheduler whose workers simulate.
    cluster
        File with a ``[cluster]``, whose workers are started; None: that of the study, or none.
    engine
        Name of an engine (`experiments.cases.ENGINES`); None: that of the study.
    resume
        Go on in the folder of an earlier run: no finished case is simulated again.
    published_replicates
        Heaps of each of the runs published for the study, to be set beside; 0: none of them.
    campaign
        Run the campaign; without it, the published runs alone.
    watch
        Opens the display of a batch of cases, by its title, and hands out what its progress is reported to.
    on_stage
        Called with the name and the result of every finished stage.

    Raises
    ------
    InputError
        When study, device, engine or folder break a rule; nothing is written then.
    """
    resources = chosen_resources(device, workers, scheduler, cluster)
    chosen = chosen_study(study, scale, resources)
    folder = Path(out) if out is not None else default_folder(chosen)
    chosen = check_runs(with_engine(chosen, engine), campaign=campaign, paper=published_replicates > 0)
    with (
        open_workers(resources_for(chosen, resources)) as crew,
        locked(folder, resume),
        Journal(folder, "calibrate", chosen, resume, device=str(crew.described.get("device", ""))) as journal,
    ):
        desk = Desk.open(chosen, folder, crew, resume, watch, journal)
        replay = replay_published(desk, published_replicates) if published_replicates else None
        found = run_campaign(desk, on_stage, replay) if campaign else None
        record = record_published(desk, replay, found) if replay is not None else None
    return Calibration(folder, found, replay, record)


def discover(
    study: Study | str | Path,
    data: str | Path | None = None,
    out: str | Path | None = None,
    *,
    bank: str | Path | None = None,
    photographs_only: bool = False,
    seed: int = 1,
    scale: str | None = None,
    device: str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    cluster: str | Path | None = None,
    engine: str | None = None,
    resume: bool = False,
    watch: Watch = lambda title: nullcontext(),
) -> SearchResult:
    """Find the effect that a study's model lacks, and write the report into a folder.

    Parameters
    ----------
    study, out, scale, device, workers, scheduler, cluster, engine, resume, watch
        As of `calibrate`.
    data
        File of measured heaps; None: only the bank of library waves is made.
    bank
        A bank made earlier for the study; None: that of the folder, that beside the study, or a new one.
    photographs_only
        Look only at what photographs show.
    seed
        Seed of the bootstraps and of the fresh runs.

    Raises
    ------
    InputError
        When study, data, bank, device or folder break a rule; nothing is written then.
    """
    resources = chosen_resources(device, workers, scheduler, cluster)
    chosen = with_engine(chosen_study(study, scale, resources), engine)
    folder = Path(out) if out is not None else default_folder(chosen, "discover")
    data, bank = (Path(file) if file is not None else None for file in (data, bank))
    with open_workers(resources_for(chosen, resources)) as crew:
        job = Job(chosen, data, folder, bank, photographs_only, crew, seed)
        return run_search(job, resume, watch)


def bridge(
    card: str | Path,
    out: str | Path | None = None,
    *,
    engine: str | None = None,
    command: str | None = None,
    runs: int = 12,
    fresh: int = 5,
    margin: float | None = None,
    seed: int = 1,
    workers: int | None = None,
    scheduler: str | None = None,
    cluster: str | Path | None = None,
    time_limit: str | None = None,
    approximate: bool = False,
    resume: bool = False,
    watch: Watch = lambda title: nullcontext(),
) -> Bridge:
    """Correct a card for another solver by a few runs there, and verify it by fresh ones.

    Parameters
    ----------
    card
        Material card that `calibrate` wrote.
    out
        Folder of the results, new or empty; None: ``out/NAME-bridge``.
    engine, command
        The other solver: name of an engine, or command of a program that keeps the folder contract.
    runs, fresh
        Runs that the correction is made from, and runs that verify it.
    margin
        Difference from the target that does not matter, in the response's unit; None: 0.5 degrees.
    seed
        Root of the seeds of all runs.
    workers
        Runs at once; None: one a core.
    scheduler, cluster
        As of `calibrate`; the other solver must be there.
    time_limit
        Wall time of a run with its unit, as ``"10 min"``; None: none.
    approximate
        Take the nearest for what the other code lacks.
    resume
        Go on in the folder of an earlier run: no finished run is simulated again.
    watch
        As of `calibrate`.

    Raises
    ------
    InputError
        When card, engine, numbers or folder break a rule; nothing is written then.
    """
    source = read_source(Path(card))
    within = check_order(source, runs, fresh, margin)
    if engine is None and command is None:
        raise InputError(
            "engine", "expected a bridge leads to another solver: --engine NAME or --command", "none"
        )
    limits = {"time_limit": time_limit, "approximate": approximate or None}
    study = with_engine(source.study, engine, command, **limits)
    folder = Path(out) if out is not None else default_folder(study, "bridge")
    resources = resources_for(study, chosen_resources(None, workers, scheduler, cluster))
    with open_workers(resources) as crew:
        desk = Desk.open(study, folder, crew, resume, watch)
        name = engine or str(getattr(getattr(desk.store.engine, "program", None), "name", command))
        crossing = cross(source, desk.run, name, runs, fresh, within, seed)
    write_crossing(crossing, folder)
    return Bridge(folder, crossing)
