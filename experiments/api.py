"""Whole runs as functions: calibration, plan of tests, search and bridge."""

from __future__ import annotations

from pathlib import Path
from typing import Unpack

from experiments.io.own_packages import require_own_packages

require_own_packages()  # before the imports that a package of others under these names would end

from experiments.runs.bridging import Bridge, BridgeOrder, prepare_bridge, run_bridge
from experiments.runs.calibration import Calibration, StageHook, run_calibration
from experiments.runs.choices import check_campaign, prepare
from experiments.runs.fidelity import with_budget
from experiments.runs.planning import TestPlan, prepare_plan, run_plan
from experiments.runs.request import RunOptions, RunRequest
from experiments.runs.search import SearchData, SearchResult, run_search
from experiments.studyfile import Study

__all__ = ["Bridge", "Calibration", "SearchResult", "TestPlan", "bridge", "calibrate", "discover", "plan"]


def calibrate(
    study: Study | str | Path | None = None,
    out: str | Path | None = None,
    *,
    budget: str | None = None,
    on_stage: StageHook | None = None,
    **options: Unpack[RunOptions],
) -> Calibration:
    """Calibrate the contact parameters of a study, and write the report into a folder.

    Parameters
    ----------
    study
        A study, or its file; None: the paper's buckwheat.
    out
        Folder of the results, new or empty; None: ``out/NAME-SCALE``.
    budget
        Wall time with its unit, e.g. ``"30 min"``: the design is run at a cheaper scale of the study, and a
        few runs move its surface to the scale that is asked for.
    on_stage
        Called with the name and the result of every finished stage.
    **options
        Where the run works: ``scale``, ``device``, ``workers``, ``scheduler``, ``cluster``, ``engine``,
        ``resume`` and ``watch``; `experiments.runs.request.RunRequest` has their meaning and defaults.

    Raises
    ------
    InputError
        When study, device, engine or folder break a rule; nothing is written then.
    """
    prepared = prepare(study, RunRequest(out=out, **options), check_campaign)
    return run_calibration(prepared if budget is None else with_budget(prepared, budget), on_stage)


def plan(
    study: Study | str | Path,
    out: str | Path | None = None,
    *,
    after: str | Path | None = None,
    **options: Unpack[RunOptions],
) -> TestPlan:
    """Choose the next tests among the candidates of a study, and write the report into a folder.

    Parameters
    ----------
    study, out, options
        See `calibrate`; the folder is ``out/NAME-SCALE-plan``.
    after
        Folder of a finished campaign, or its card; None: the ranges of the factors are explored.

    Raises
    ------
    InputError
        When study, campaign, device, engine or folder break a rule; nothing is written then.
    """
    request = RunRequest(out=out, **options)
    return run_plan(prepare_plan(study, request, None if after is None else Path(after)))


def discover(
    study: Study | str | Path,
    data: str | Path | None = None,
    out: str | Path | None = None,
    *,
    bank: str | Path | None = None,
    photographs_only: bool = False,
    seed: int = 1,
    **options: Unpack[RunOptions],
) -> SearchResult:
    """Find the effect that a study's model lacks, and write the report into a folder.

    Parameters
    ----------
    study, out, options
        See `calibrate`.
    data
        File of measured heaps; None: only the bank is made.
    bank
        Bank made earlier for the study; None: that of the folder, that next to the study, or a new one.
    photographs_only
        Look only at what photographs show.
    seed
        Seed of the bootstraps and of the fresh runs.

    Raises
    ------
    InputError
        When study, data, bank, device or folder break a rule; nothing is written then.
    """
    data, bank = (Path(file) if file is not None else None for file in (data, bank))
    given = SearchData(data, bank, photographs_only, seed)
    return run_search(prepare(study, RunRequest(out=out, **options), what="discover"), given)


def bridge(
    card: str | Path,
    out: str | Path | None = None,
    *,
    command: str | None = None,
    runs: int = 12,
    fresh: int = 5,
    margin: float | None = None,
    seed: int = 1,
    time_limit: str | None = None,
    approximate: bool = False,
    **options: Unpack[RunOptions],
) -> Bridge:
    """Correct a card for another solver by a few runs there, and verify it by fresh ones.

    Parameters
    ----------
    card
        Material card that `calibrate` wrote.
    out
        Folder of the results, new or empty; None: ``out/NAME-bridge``.
    command
        Command of the other solver, a program that keeps the folder contract; or its name is the ``engine``.
    runs, fresh, margin, seed, time_limit, approximate
        Runs in the other solver; `experiments.runs.bridging.BridgeOrder` has their meaning and defaults.
    **options
        See `calibrate`; the workers must have the other solver.

    Raises
    ------
    InputError
        When card, engine, numbers or folder break a rule; nothing is written then.
    """
    order = BridgeOrder(
        command=command, runs=runs, fresh=fresh, margin=margin, seed=seed, time_limit=time_limit,
        approximate=approximate,
    )  # fmt: skip
    return run_bridge(prepare_bridge(card, RunRequest(out=out, **options), order))
