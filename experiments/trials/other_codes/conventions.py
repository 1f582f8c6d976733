"""Part of another code's offsets that its conventions of the contact law make: our engine with both.

    python -m experiments.trials.other_codes.conventions experiments/trials/record/eleventh --out out/laws

The revealed nulls of a record are simulated by our engine, at their own factors, with the laws of the study
and with the other code's, from the same seeds. What differs is the work of the laws; the rest of what the
code is off (`offsets`) is due to its filling, walls, time step and looks, or to the program.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import typer

from dem_warp import Case
from doe.discrepancy import Point
from experiments.cases import Resources, Workers, open_workers
from experiments.commands.console import clear_errors
from experiments.discover.engine import EngineSimulator
from experiments.discover.library import library_for
from experiments.discover.outcome_table import OutcomeTable
from experiments.errors import InputError
from experiments.report.kit.markdown import markdown_table
from experiments.studyfile import Study, load_study
from experiments.trials.folder import LABELS
from experiments.trials.generate import STUDY
from experiments.trials.heaps import cases_of
from experiments.trials.kept import read_record
from experiments.trials.other_codes.offsets import measured_offsets, offsets_table
from experiments.trials.other_codes.setting import LAWS
from experiments.trials.truth import Kind, Label, read_labels

OFF, ERROR = "off, sd of one run", "standard error"


class OtherLaws(EngineSimulator):
    """Our engine with the laws of a code, but for its resistance to rolling, which a null has not."""

    def __init__(self, study: Study, code: str, table: OutcomeTable, workers: Workers) -> None:
        super().__init__(study, library_for(study), table, workers)
        self._laws = LAWS[code]

    def case(self, point: Point) -> Case[Any]:
        """Build the case of a point."""
        case = super().case(point)
        return replace(case, laws=replace(self._laws, rolling=case.laws.rolling))


def heaps_of(nulls: list[Label], simulator: EngineSimulator, seeds: int) -> np.ndarray:
    """Simulate nulls, (nulls, conditions, seeds, observables); NaN where a heap failed."""
    conditions = [condition.name for condition in simulator.study.conditions]
    points = [point for label in nulls for point in cases_of(label, conditions, seeds)]
    values = np.asarray(simulator(points).values)
    return values.reshape(len(nulls), len(conditions), seeds, -1)


def law_offsets(ours: np.ndarray, theirs: np.ndarray, observables: dict[str, str]) -> pd.DataFrame:
    """Offsets that the laws make, as `offsets_table` has them.

    Parameters
    ----------
    ours, theirs : (nulls, conditions, seeds, observables) array
        Heaps with the laws of the study and with the others.
    observables
        Units by name.
    """
    runs = np.sqrt(np.nanvar(ours, axis=2, ddof=1).mean(axis=0))
    off = np.nanmean(theirs, axis=2) - np.nanmean(ours, axis=2)
    return offsets_table(observables, off, np.broadcast_to(runs, off.shape))


def parted(code: pd.DataFrame, laws: pd.DataFrame) -> pd.DataFrame:
    """Set what a code is off beside what its laws make, and what is left, in deviations of one run."""
    whole, part = (table.set_index("observable")[[OFF, ERROR]] for table in (code, laws))
    left = whole[OFF] - part[OFF]
    beside = {"left": left, "error of what is left": np.hypot(whole[ERROR], part[ERROR])}
    return whole.join(part.add_suffix(", by the laws")).assign(**beside).reset_index()


def main(
    record: Annotated[Path, typer.Argument(help="Record of a second reality, with its heaps.")],
    out: Annotated[Path, typer.Option(help="Folder of what was simulated; a run goes on in it.")],
    seeds: Annotated[int, typer.Option(help="Heaps of each null and condition.", min=2)] = 6,
    device: Annotated[str | None, typer.Option(help="cpu, cuda, or several GPUs, as cuda:0,cuda:1.")] = None,
    workers: Annotated[int | None, typer.Option(help="Processes.")] = None,
) -> None:
    """Print how much of the offsets of a record's code its laws make."""
    with clear_errors("Resume with the same command."):
        kept = read_record(record)
        if kept.reality is None:
            raise InputError("must be a record of heaps that another code made", kept.title, str(record))
        code, study = kept.reality["code"], load_study(STUDY, kept.declaration.scale or None)
        nulls = [label for label in read_labels(record / LABELS) if label.kind is Kind.NULL]
        measured, _ = measured_offsets(record)
        out.mkdir(parents=True, exist_ok=True)
        with open_workers(Resources(device, workers)) as own:
            with EngineSimulator(study, library_for(study), OutcomeTable(out / "ours.sqlite"), own) as engine:
                names, ours = engine.observables, heaps_of(nulls, engine, seeds)
            with OtherLaws(study, code, OutcomeTable(out / "theirs.sqlite"), own) as engine:
                theirs = heaps_of(nulls, engine, seeds)
        units = {one.name: one.unit for one in study.measurable}
        table = parted(measured, law_offsets(ours, theirs, {name: units[name] for name in names}))
        print(f"{len(nulls)} trials that hide nothing, {seeds} heaps each.\n\n{markdown_table(table)}")


if __name__ == "__main__":
    typer.run(main)
