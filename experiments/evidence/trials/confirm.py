"""A look whether today's engine still makes a bank: some of its runs again, each value the same or not.

    python -m experiments.evidence.trials.confirm experiments/studies/trial/bank.npz --cases 300 --device cuda

Where all are the same, the bank's file names today's engine as its maker, so that no search warns of another.
A bank that was made on a GPU must be looked at on a GPU, where floats are rounded otherwise than on a CPU.
"""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from dem_warp.version import source_commit
from doe.discrepancy import Bank, Point, Simulator, bank_points
from experiments.cases import Resources, open_workers
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.commands.console import clear_errors
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.maker import maker_of_today
from experiments.discover.search import Search
from experiments.evidence.trials.generate_trials import STUDY
from experiments.io.errors import InputError
from experiments.io.files import replacing
from experiments.studyfile import load_study


def points_of(bank: Bank, search: Search) -> list[Point]:
    """Points of a bank's runs, row by row, as they were drawn."""
    each, base = len(bank.space.conditions), bank.mechanism < 0
    points = len(np.unique(bank.theta[base], axis=0))
    settings = replace(
        search.settings,
        bank_points=points,
        bank_repeats=int(base.sum()) // points // each,
        bank_mechanism_points=int((bank.mechanism == 0).sum()) // each,
    )
    drawn = bank_points(bank.space, settings)
    theta = bank.space.coded_theta(np.array([point.theta for point in drawn]))
    if theta.shape != bank.theta.shape or not np.allclose(theta, bank.theta, atol=1e-12):
        raise InputError("the bank", "must have the points that are drawn today", f"{len(bank.theta)} others")
    return drawn


def differing(bank: Bank, points: list[Point], rows: np.ndarray, simulator: Simulator) -> np.ndarray:
    """Numbers of those rows whose observables, as a file keeps them, today's engine gives otherwise."""
    outcomes = simulator([points[row] for row in rows])
    columns = [simulator.observables.index(name) for name in bank.observables]
    fresh, kept = outcomes.values[:, columns].astype(np.float32), bank.values[rows].astype(np.float32)
    same = ((fresh == kept) | (np.isnan(fresh) & np.isnan(kept))).all(axis=1)
    return np.asarray(rows[~same])


def main(
    file: Annotated[Path, typer.Argument(help="File of a bank of the trial study.")],
    scale: Annotated[str, typer.Option(help="Scale of the trial study; left out: as written.")] = "",
    cases: Annotated[int, typer.Option(min=1, help="Runs that are made again, spread over the bank.")] = 300,
    device: Annotated[str | None, typer.Option(help="cpu, cuda, or several GPUs, as cuda:0,cuda:1.")] = None,
    out: Annotated[Path, typer.Option(help="Table of what has been run.")] = Path("out/confirm.sqlite"),
) -> None:
    """Run some of a bank's cases again, and name today's engine as its maker if none differs."""
    with clear_errors("Resume with the same command."):
        search = Search.of(load_study(STUDY, scale or None))
        bank = search.read_bank(file)
        points = points_of(bank, search)
        rows = np.unique(np.linspace(0, len(points) - 1, cases).astype(int))
        out.parent.mkdir(parents=True, exist_ok=True)
        with (
            open_workers(Resources(device, None)) as workers,
            EngineSimulator(search.study, search.library, OutcomeTable(out), workers) as simulator,
        ):
            others = differing(bank, points, rows, simulator)
        print(f"{len(rows) - len(others)} of {len(rows)} runs are the same in every observable: {file}")
        if len(others):
            raise InputError(
                str(file), "must be made by an engine that gives the same values", f"row {others[0]}"
            )
        made = maker_of_today(source_commit())
        with replacing(file) as temporary:
            replace(bank, maker={**bank.maker, "engine": made["engine"]}).save(temporary)


if __name__ == "__main__":
    typer.run(main)
