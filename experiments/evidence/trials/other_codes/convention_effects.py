"""Measure how much of another code's offsets its laws make, and its way to run the test.

python -m experiments.evidence.trials.other_codes.convention_effects RECORD --out out/laws --take laws
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import typer

from dem_warp import Case
from doe.discrepancy import Point
from experiments.cases import Resources, Workers, open_workers
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.commands.console import clear_errors
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.mechanism_files import library_for
from experiments.evidence.record_page import markdown_table
from experiments.evidence.trials.generate_trials import STUDY
from experiments.evidence.trials.other_codes.code_surfaces import Bench
from experiments.evidence.trials.other_codes.offsets import measured_offsets, offsets_table
from experiments.evidence.trials.other_codes.setting import LAWS, Setting
from experiments.evidence.trials.trial_heaps import cases_of
from experiments.evidence.trials.trials_folder import LABELS
from experiments.evidence.trials.trials_page import read_record
from experiments.evidence.trials.truth import Kind, Label, read_labels
from experiments.io.errors import InputError
from experiments.studyfile import Study, load_study

OFF, ERROR = "off, sd of one run", "standard error"


class Taken(StrEnum):
    """Conventions that are taken from another workshop."""

    LAWS = "laws"
    """Of contact, but for the resistance to rolling, which a null has not."""
    RAIN = "rain"
    """Grains a second, of each trial."""
    STEP = "step"
    """Time step, of each trial."""


class OtherWorkshop(EngineSimulator):
    """Our engine with some conventions of a code's workshop.

    Parameters
    ----------
    study, table, workers
        As of `EngineSimulator`.
    code
        Name of the code.
    taken
        Conventions that are the other workshop's.
    nulls
        Trials whose points it answers: each has its own rain and time step.
    """

    def __init__(
        self,
        study: Study,
        code: str,
        taken: Collection[Taken],
        nulls: Sequence[Label],
        table: OutcomeTable,
        workers: Workers,
    ) -> None:
        super().__init__(study, library_for(study), table, workers)
        self._code, self._taken = code, taken
        self._settings = {label.theta: Setting.drawn(code, label.seed) for label in nulls}

    def case(self, point: Point) -> Case[Any]:
        """Build the case of a point."""
        case, setting = super().case(point), self._settings[tuple(point.theta)]
        theirs = setting.of(case, self._code)
        if Taken.RAIN in self._taken:
            case = replace(case, scene=replace(case.scene, rain_rate=Bench(theirs).rain_rate))
        if Taken.STEP in self._taken:
            case = replace(case, numerics=theirs.numerics)
        if Taken.LAWS in self._taken:
            case = replace(case, laws=replace(LAWS[self._code], rolling=case.laws.rolling))
        return case


def heaps_of(nulls: list[Label], simulator: EngineSimulator, seeds: int) -> np.ndarray:
    """Simulate nulls, (nulls, conditions, seeds, observables); NaN where a heap failed."""
    conditions = [condition.name for condition in simulator.study.conditions]
    points = [point for label in nulls for point in cases_of(label, conditions, seeds)]
    values = np.asarray(simulator(points).values)
    return values.reshape(len(nulls), len(conditions), seeds, -1)


def made_offsets(ours: np.ndarray, theirs: np.ndarray, observables: dict[str, str]) -> pd.DataFrame:
    """Offsets that what was taken makes, as `offsets_table` has them.

    Parameters
    ----------
    ours, theirs : (nulls, conditions, seeds, observables) array
        Heaps as the study has them and with what was taken.
    observables
        Units by name.
    """
    runs = np.sqrt(np.nanvar(ours, axis=2, ddof=1).mean(axis=0))
    off = np.nanmean(theirs, axis=2) - np.nanmean(ours, axis=2)
    return offsets_table(observables, off, np.broadcast_to(runs, off.shape))


def parted(code: pd.DataFrame, laws: pd.DataFrame) -> pd.DataFrame:
    """Set what a code is off beside what of it is made, and what is left, in deviations of one run."""
    whole, part = (table.set_index("observable")[[OFF, ERROR]] for table in (code, laws))
    left = whole[OFF] - part[OFF]
    beside = {"left": left, "error of what is left": np.hypot(whole[ERROR], part[ERROR])}
    return whole.join(part.add_suffix(", made")).assign(**beside).reset_index()


def main(
    record: Annotated[Path, typer.Argument(help="Record of a second reality, with its heaps.")],
    out: Annotated[Path, typer.Option(help="Folder of what was simulated; a run goes on in it.")],
    take: Annotated[
        list[Taken] | None, typer.Option(help="What is the other workshop's; left out: its laws.")
    ] = None,
    seeds: Annotated[int, typer.Option(help="Heaps of each null and condition.", min=2)] = 6,
    device: Annotated[str | None, typer.Option(help="cpu, cuda, or several GPUs, as cuda:0,cuda:1.")] = None,
    workers: Annotated[int | None, typer.Option(help="Processes.")] = None,
) -> None:
    """Print how much of the offsets of a record's code its laws make, or its way to run the test."""
    with clear_errors("Resume with the same command."):
        kept = read_record(record)
        if kept.reality is None:
            raise InputError(str(record), "must be a record of heaps that another code made", kept.title)
        code, study = kept.reality["code"], load_study(STUDY, kept.declaration.scale or None)
        nulls = [label for label in read_labels(record / LABELS) if label.kind is Kind.NULL]
        measured, _ = measured_offsets(record)
        out.mkdir(parents=True, exist_ok=True)
        with open_workers(Resources(device, workers)) as own:
            with EngineSimulator(study, library_for(study), OutcomeTable(out / "ours.sqlite"), own) as engine:
                names, ours = engine.observables, heaps_of(nulls, engine, seeds)
            taken, table = tuple(take or (Taken.LAWS,)), OutcomeTable(out / "theirs.sqlite")
            with OtherWorkshop(study, code, taken, nulls, table, own) as engine:
                theirs = heaps_of(nulls, engine, seeds)
        units = {one.name: one.unit for one in study.measurable}
        beside = parted(measured, made_offsets(ours, theirs, {name: units[name] for name in names}))
        title = f"{len(nulls)} trials that hide nothing, {seeds} heaps each; made by {', '.join(taken)}."
        print(f"{title}\n\n{markdown_table(beside)}")


if __name__ == "__main__":
    typer.run(main)
