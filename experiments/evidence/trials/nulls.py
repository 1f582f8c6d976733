"""Alarms of trials that hide nothing, before any fresh run, by what the rules allow for.

    python -m experiments.evidence.trials.nulls RECORD... --systematic 0.1 --systematic 0.15
    python -m experiments.evidence.trials.nulls RECORD... --systematic 0.1 --scale-unknown

A record must keep its heaps. An analysis on the bank alone ends, or asks for fresh runs, which is an alarm.
So the allowance of a study is chosen on trials that are open, in minutes. The camera of each trial has an
error of scale, which the analysis is told of; in the second command it is not.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from doe.discrepancy import Emulator, Measured, fit_emulator
from experiments.commands.console import clear_errors
from experiments.discover.search import Search
from experiments.evidence.trials.baselines.measured import opened_trials
from experiments.evidence.trials.camera import stated_scales
from experiments.evidence.trials.declaration import Declaration, read_declaration
from experiments.evidence.trials.desk import Desk, job_name, read_data
from experiments.evidence.trials.findings import VIEWS
from experiments.evidence.trials.folder import Folder
from experiments.evidence.trials.generate import STUDY, bank_beside
from experiments.evidence.trials.score import share
from experiments.evidence.trials.truth import Kind, read_labels, read_sealed
from experiments.io.errors import InputError
from experiments.report.kit.markdown import markdown_table
from experiments.studyfile import load_study

CHUNK = 16
"""Trials that go to a process together, with one emulator."""


def read_nulls(folder: Folder, declaration: Declaration, scale_known: bool) -> dict[str, Measured]:
    """Read the heaps of the trials that hide nothing, with what is known of the camera's scale.

    Raises
    ------
    InputError
        When none has heaps.
    """
    nulls = {label.trial for label in read_labels(folder.hidden_labels) if label.kind is Kind.NULL}
    sealed = [one for one in read_sealed(folder.sealed) if one.trial in nulls]
    present = [one for one in sealed if folder.measured(one.trial).is_file()]
    if not present:
        raise InputError(str(folder.root), "needs heaps of trials that hide nothing", "none")
    measured, _ = read_data(folder, present, load_study(STUDY, declaration.scale or None))
    known = stated_scales(VIEWS[declaration.plan.view]) if scale_known else {}
    return {trial: replace(one, calibration=known) for trial, one in measured.items()}


def desks(
    emulator: Emulator, declaration: Declaration, measured: dict[str, Measured], allowances: Sequence[float]
) -> Iterator[Desk]:
    """Desk of every allowance."""
    withheld: dict[str, tuple[str, ...]] = dict.fromkeys(measured, ())
    for allowance in allowances:
        yield Desk(emulator, replace(declaration.settings, systematic=allowance), measured, withheld)


def raises_alarm(desk: Desk, job: str) -> bool:
    """Say if an analysis asks for fresh runs: without a gap it ends at once."""
    return next(desk(job), None) is not None


def count_alarms(
    place: Path, allowances: Sequence[float], bank: Path | None, scale_known: bool
) -> pd.DataFrame:
    """Analyse the trials of a record that hide nothing, a row each, with its alarm at each allowance."""
    with opened_trials(place) as folder, ProcessPoolExecutor() as pool:
        declaration = read_declaration(folder.declared)
        measured = read_nulls(folder, declaration, scale_known)
        search = Search.of(load_study(STUDY, declaration.scale or None))
        emulator = fit_emulator(search.read_bank(bank or bank_beside(declaration.scale)))
        jobs = [job_name(trial, declaration.plan.view) for trial in measured]
        table = {
            desk.settings.systematic: list(pool.map(raises_alarm, [desk] * len(jobs), jobs, chunksize=CHUNK))
            for desk in desks(emulator, declaration, measured, allowances)
        }
    return pd.DataFrame(table, index=pd.Index([f"{place.name} {trial}" for trial in measured], name="trial"))


def alarms_page(alarms: pd.DataFrame) -> str:
    """Table of the alarms at each allowance, as Markdown.

    Parameters
    ----------
    alarms : DataFrame
        Rows of `count_alarms`.
    """
    rows = []
    for allowance, column in alarms.items():
        found = share(column)
        low, high = found.interval
        rows.append(
            {
                "allowance": allowance,
                "alarms": f"{int(column.sum())} of {len(column)}",
                "share, 95 %": f"{100.0 * found.value:.1f} % ({100.0 * low:.1f} to {100.0 * high:.1f})",
                "in": ", ".join(column.index[column]),
            }
        )
    return markdown_table(pd.DataFrame(rows))


def main(
    records: Annotated[list[Path], typer.Argument(help="Records that keep heaps, or folders.")],
    systematic: Annotated[list[float], typer.Option(help="Allowance to try; may be given several times.")],
    bank: Annotated[Path | None, typer.Option(help="Bank of the trial study; left out: its own.")] = None,
    scale_unknown: Annotated[bool, typer.Option("--scale-unknown", help="Nobody knows of it.")] = False,
) -> None:
    """Count the alarms of trials that hide nothing."""
    with clear_errors():
        parts = [count_alarms(place, systematic, bank, not scale_unknown) for place in records]
        print(alarms_page(pd.concat(parts)))


if __name__ == "__main__":
    typer.run(main)
