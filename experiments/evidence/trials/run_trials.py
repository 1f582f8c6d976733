"""Analyse the trials: all of them in step, the cases of a round in one batch.

    python -m experiments.evidence.trials.run_trials out/trials --part alone --device cuda --seconds 480

It sees the measured heaps and the seals, never the labels; a trial without heaps waits for them. After
``--seconds`` it stops between two batches; called again, it goes on: analyses that have ended are not begun
again, and the others take what was simulated from the table of outcomes. The exit code is 3 while some have
not ended.
"""

import math
import time
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Annotated

import typer

from dem_warp.cores import cores
from doe.discrepancy import fit_emulator
from experiments.cases import Resources, open_workers
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.commands.console import clear_errors
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.search import Search
from experiments.evidence.trials.analyses import (
    OutOfTime,
    TimedSimulator,
    TrialAnalyses,
    analysis_name,
    analysis_processes,
    in_step,
    keep,
    read_data,
)
from experiments.evidence.trials.declaration import read_declaration
from experiments.evidence.trials.findings import VIEWS, read_findings
from experiments.evidence.trials.generate_trials import STUDY, bank_beside
from experiments.evidence.trials.trials_folder import Folder, noted_run
from experiments.evidence.trials.truth import Sealed, read_sealed
from experiments.io.errors import InputError
from experiments.studyfile import load_study

UNFINISHED = 3
"""Exit code while analyses have not ended."""


def open_jobs(folder: Folder, trials: Sequence[Sealed], views: Collection[str]) -> dict[str, Sealed]:
    """Analyses of trials that have not ended, by name."""
    ended = read_findings([folder.findings] if folder.findings.exists() else [])
    done = {analysis_name(row.trial, row.view) for row in ended.itertuples()}
    jobs = {analysis_name(trial.trial, view): trial for view in views for trial in trials}
    return {name: trial for name, trial in jobs.items() if name not in done}


def run_trials(
    folder: Folder,
    trials: Sequence[Sealed],
    views: Collection[str],
    bank: Path | None = None,
    device: str | None = None,
    workers: int | None = None,
    seconds: float = math.inf,
) -> None:
    """Run the analyses of some sealed trials that have not ended, one in each view; report every round.

    There are as many processes for analyses as `workers` of the simulator. After `seconds` no further
    batch is begun.
    """
    deadline = time.monotonic() + seconds
    declaration = read_declaration(folder.declared)
    search = Search.of(load_study(STUDY, declaration.scale or None))
    emulator = fit_emulator(search.read_bank(bank or bank_beside(declaration.scale)))
    jobs = open_jobs(folder, trials, views)
    measured, refused = read_data(folder, list(dict.fromkeys(jobs.values())), search.study)
    keep(folder, {name: refused[trial.trial] for name, trial in jobs.items() if trial.trial in refused})
    names = [name for name, trial in jobs.items() if trial.trial in measured]
    withheld = {trial.trial: trial.withheld for trial in trials}
    begin = TrialAnalyses(emulator, declaration.settings, measured, withheld)
    table = OutcomeTable(folder.root / "outcomes.sqlite")
    with (
        open_workers(Resources(device, workers)) as simulators,
        EngineSimulator(search.study, search.library, table, simulators) as engine,
        analysis_processes(begin, workers or cores()) as advance,
        noted_run(folder, f"analyses, {' and '.join(views)}", device, table),
    ):
        for turn in in_step(names, advance, TimedSimulator(engine, deadline)):
            keep(folder, turn.ended)
            ended = f"round {turn.number}: {len(turn.ended)} analyses ended"
            print(f"{ended}, {turn.running} want {turn.cases} cases", flush=True)


def main(
    folder: Annotated[Path, typer.Argument(help="Folder of the trials.")],
    bank: Annotated[Path | None, typer.Option(help="Bank of the trial study; left out: its own.")] = None,
    part: Annotated[str | None, typer.Option(help="Trials of one part; left out: all.")] = None,
    view: Annotated[str | None, typer.Option(help="Left out: the plan's.")] = None,
    device: Annotated[str | None, typer.Option(help="cpu, cuda, or several GPUs, as cuda:0,cuda:1.")] = None,
    workers: Annotated[int | None, typer.Option(help="Processes.")] = None,
    seconds: Annotated[float, typer.Option(help="Begin no batch after this time.")] = math.inf,
) -> None:
    """Analyse the trials that have not been."""
    with clear_errors("Resume with the same command."):
        if view not in (None, *VIEWS):
            raise InputError("--view", f"must be one of {', '.join(VIEWS)}", view)
        place = Folder(folder)
        views = (view or read_declaration(place.declared).plan.view,)
        # heaps may be made in chunks: what has none yet waits
        sealed = [trial for trial in read_sealed(place.sealed) if part in (None, trial.part)]
        trials = [trial for trial in sealed if place.measured(trial.trial).exists()]
        try:
            run_trials(place, trials, views, bank, device, workers, seconds)
        except OutOfTime:
            print(f"time is up; {len(open_jobs(place, trials, views))} analyses have not ended: run it again")
            raise typer.Exit(UNFINISHED) from None


if __name__ == "__main__":
    typer.run(main)
