"""Offsets between another code's heaps and ours, where nothing is hidden, in every observable.

    python -m experiments.evidence.trials.other_codes.offsets experiments/evidence/trials/record/eleventh --bank BANK

The heaps of a record's revealed nulls are held against the emulator of the trial study at the true factors.
What differs is neither calibrated away nor a hidden effect: it is what the two codes do not have in common.
By how much an observable is off, in the mean over conditions and nulls, stands in deviations of one run and
in its unit. The last column has the noise of the means and the emulator's error in it as well.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from doe.discrepancy import Measured, fit_emulator
from doe.discrepancy.fitting.fitted_model import Model
from experiments.commands.console import clear_errors
from experiments.discover.search import Search
from experiments.evidence.record_page import markdown_table
from experiments.evidence.trials.declaration import read_declaration
from experiments.evidence.trials.generate_trials import STUDY, bank_beside
from experiments.evidence.trials.trial_heaps import unpack_heaps
from experiments.evidence.trials.trials_folder import DECLARED, HEAPS, LABELS, SEALED, Folder
from experiments.evidence.trials.truth import Kind, Label, read_labels
from experiments.io.errors import InputError
from experiments.io.files import copy_file
from experiments.measurement.measured_file import read_measured
from experiments.studyfile import load_study


def residuals(label: Label, measured: Measured, base: Model) -> tuple[np.ndarray, np.ndarray]:
    """Differences of a trial's means from the base at its true factors, and the deviations of one run.

    Returns
    -------
    tuple of array
        Each (conditions, observables), in the units of the observables; NaN where nothing was measured.
    """
    emulator = base.emulator
    x = emulator.space.coded_theta(np.array(label.theta))
    places = [measured.observables.index(name) for name in emulator.observables]
    rows = [
        measured.mean(condition)[places] - base.predict(x[None], condition)[0]
        for condition in emulator.space.conditions
    ]
    runs = [np.sqrt(np.diag(base.run_covariance(x, condition))) for condition in emulator.space.conditions]
    return np.array(rows), np.array(runs)


def offsets_table(observables: Mapping[str, str], off: np.ndarray, runs: np.ndarray) -> pd.DataFrame:
    """Offset of each observable with its standard error over the nulls.

    Parameters
    ----------
    observables
        Units by name.
    off, runs : array
        Differences and deviations of one run, (nulls, conditions, observables).
    """
    ratio = off / runs
    each = np.nanmean(ratio, axis=1)
    count = np.isfinite(each).sum(axis=0)
    common, square = np.nanmean(each, axis=0), np.nanmean(ratio**2, axis=(0, 1))
    return pd.DataFrame(
        {
            "observable": list(observables),
            "off, sd of one run": common,
            "standard error": np.nanstd(each, axis=0, ddof=1) / np.sqrt(count),
            "off": np.nanmean(off, axis=(0, 1)),
            "unit": list(observables.values()),
            "rms of a condition's mean, sd of one run": np.sqrt(square),
        }
    )


def measured_offsets(record: Path, bank: Path | None = None) -> tuple[pd.DataFrame, int]:
    """Offsets of the revealed nulls of a record, and their number."""
    scale = read_declaration(record / DECLARED).scale
    search = Search.of(load_study(STUDY, scale or None))
    base = Model(fit_emulator(search.read_bank(bank or bank_beside(scale))), (), 0.0)
    nulls = [label for label in read_labels(record / LABELS) if label.kind is Kind.NULL]
    if len(nulls) < 2:
        raise InputError(str(record / LABELS), "needs two revealed trials that hide nothing", len(nulls))
    with tempfile.TemporaryDirectory() as name:
        folder = Folder(Path(name))
        copy_file(record / SEALED, folder.sealed)
        unpack_heaps(record / HEAPS, folder)
        found = [residuals(n, read_measured(folder.measured(n.trial), search.study), base) for n in nulls]
    off, runs = (np.array(each) for each in zip(*found, strict=True))
    units = {one.name: one.unit for one in search.study.measurable}
    return offsets_table({name: units[name] for name in base.emulator.observables}, off, runs), len(nulls)


def main(
    record: Annotated[Path, typer.Argument(help="Record of trials of another code, with its heaps.")],
    bank: Annotated[Path | None, typer.Option(help="Bank of the trial study. Default: the kept one.")] = None,
) -> None:
    """Print the offsets between the record's code and ours."""
    with clear_errors():
        table, nulls = measured_offsets(record, bank)
        print(f"{nulls} trials that hide nothing.\n\n{markdown_table(table)}")


if __name__ == "__main__":
    typer.run(main)
