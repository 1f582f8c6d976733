"""Search for effects that saturate: how well half of a bank tells the other half, if each levels off.

    python -m experiments.evidence.trials.saturations
    python -m experiments.evidence.trials.saturations --scale small --share 0.5 --share 0.2

An emulator has an effect grow evenly with its coded size. Where the effect levels off instead, noise makes
the slopes there, and the interval of a size is wrong. The file of such a mechanism says so (``saturation``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from doe.discrepancy import Bank, Emulator, fit_emulator
from experiments.commands.console import clear_errors
from experiments.discover.search import Search
from experiments.evidence.trials.generate import STUDY, bank_beside
from experiments.report.kit.markdown import markdown_table
from experiments.studyfile import load_study

SHARES = (1.0, 0.5, 0.3, 0.2, 0.1)
"""Saturations, in ranges."""


def halves(bank: Bank) -> tuple[Bank, Bank]:
    """Part a bank: every other run with each mechanism goes to each half, and runs without one to both."""
    order = np.zeros(len(bank.mechanism), dtype=int)
    for condition in range(len(bank.space.conditions)):
        for mechanism in range(len(bank.space.names)):
            rows = np.flatnonzero((bank.condition == condition) & (bank.mechanism == mechanism))
            order[rows] = 1 + np.arange(len(rows)) % 2
    one, other = (_rows(bank, (order == 0) | (order == half)) for half in (1, 2))
    return one, other


def _rows(bank: Bank, kept: np.ndarray) -> Bank:
    columns = ("theta", "mechanism", "coded_size", "condition", "values", "reasons")
    return replace(bank, **{name: getattr(bank, name)[kept] for name in columns})


def score_of(emulator: Emulator, told: Bank) -> pd.Series:
    """Sum minus twice the log-likelihood of runs, as an emulator has them, by mechanism."""
    scores = {}
    for number, name in enumerate(emulator.space.names):
        total = 0.0
        for condition, surfaces in emulator.surfaces.items():
            rows = told.rows(told.space.conditions.index(condition), number)
            x = np.column_stack([told.theta[rows], told.coded_size[rows]])
            left = np.asarray(told.values)[rows][:, list(emulator.columns)] - surfaces.predict(x, (name,))
            for each, residual in zip(x, left, strict=True):
                covariance = surfaces.noise_covariance(each, (name,))
                total += residual @ np.linalg.solve(covariance, residual) + np.linalg.slogdet(covariance)[1]
        scores[name] = total
    return pd.Series(scores)


def cross_validated(bank: Bank) -> pd.Series:
    """Sum minus twice the log-likelihood of each half of a bank, as the other has it, by mechanism."""
    one, other = halves(bank)
    return score_of(fit_emulator(one), other) + score_of(fit_emulator(other), one)


def compare(bank: Bank, shares: Sequence[float]) -> pd.DataFrame:
    """Change of the score where all mechanisms saturate over a share of their range.

    Returns
    -------
    DataFrame
        A row for each mechanism, a column for each share; below 0 where the saturation tells more.
    """
    even = cross_validated(bank.saturating(dict.fromkeys(bank.space.names)))
    columns = {}
    for part in shares:
        over = {one.name: part * abs(one.width) for one in bank.space.mechanisms}
        columns[str(part)] = cross_validated(bank.saturating(over)) - even
    return pd.DataFrame(columns)


def main(
    scale: Annotated[str, typer.Option(help="Scale of the trial study; left out: as written.")] = "",
    bank: Annotated[Path | None, typer.Option(help="Bank of the trial study; left out: its own.")] = None,
    share: Annotated[list[float] | None, typer.Option(help="Saturation in ranges; several times.")] = None,
) -> None:
    """Compare saturations of all effects of a bank."""
    with clear_errors():
        runs = Search.of(load_study(STUDY, scale or None)).read_bank(bank or bank_beside(scale))
        table = compare(runs, share or SHARES).round(0).astype(int)
        print(markdown_table(table.rename_axis("mechanism").reset_index()))


if __name__ == "__main__":
    typer.run(main)
