"""Measured means as a model sees them: stacked over conditions, with the covariance of their error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from doe.discrepancy.emulation.emulator import Emulator
from doe.discrepancy.problem.measured import Measured

SCATTER_LEVEL = 0.01
"""Replicates that scatter more than the model's with this probability or less count by their own scatter."""


@dataclass(frozen=True, eq=False)
class Block:
    """The means of one condition."""

    condition: str
    columns: np.ndarray
    """Observables of the emulator that were measured, (k,)."""
    mean: np.ndarray
    """(k,)."""
    share: np.ndarray
    """Covariance of the means over that of one replicate: 1 / n where all have n replicates, (k, k)."""
    inflation: np.ndarray
    """Standard deviations of the measured replicates over the model's, (k,)."""

    @property
    def replicates(self) -> np.ndarray:
        """Replicates of each mean, (k,)."""
        return np.rint(1.0 / np.diag(self.share)).astype(int)

    def scatter(self, covariance: np.ndarray) -> np.ndarray:
        """Covariance of the means' noise, of that of one run (k, k)."""
        return np.asarray(covariance * self.share * self.inflation[:, None] * self.inflation)


@dataclass(frozen=True, eq=False)
class Evidence:
    """Measured means, cut to what the emulator knows."""

    training: tuple[Block, ...]
    held_out: tuple[Block, ...]
    notes: tuple[str, ...]

    @property
    def count(self) -> int:
        """Means that take part in a fit."""
        return sum(len(block.mean) for block in self.training)


def gather(measured: Measured, emulator: Emulator) -> Evidence:
    """Cut measured data to the emulator's conditions and observables.

    What is left out is said in the notes. Scatter beyond the model's own, by a one-sided F test of each
    observable over all conditions, widens the error of that observable's means.
    """
    notes = list(measured.notes)
    strange = [name for name in measured.observables if name not in emulator.observables]
    notes += [f"{name} is not among the simulated observables: left out" for name in strange]
    inflation = _inflation(measured, emulator, notes)
    blocks = []
    for condition in measured.conditions:
        if condition not in emulator.surfaces:
            notes.append(f"condition {condition} is not in the bank: left out")
            continue
        block = _block(measured, emulator, condition, inflation)
        if len(block.mean):
            blocks.append(block)
        else:
            notes.append(f"condition {condition} has no value to compare: left out")
    held_out = tuple(block for block in blocks if emulator.space.is_held_out(block.condition))
    training = tuple(block for block in blocks if not emulator.space.is_held_out(block.condition))
    present = {block.condition for block in blocks}
    notes += [f"condition {c} was not measured" for c in emulator.space.conditions if c not in present]
    return Evidence(training, held_out, tuple(dict.fromkeys(notes)))


def _block(measured: Measured, emulator: Emulator, condition: str, inflation: np.ndarray) -> Block:
    names = list(measured.observables)
    rows = measured.values[condition]
    columns = np.array(
        [
            column
            for column, name in enumerate(emulator.observables)
            if name in names and np.isfinite(rows[:, names.index(name)]).any()
        ],
        dtype=int,
    )
    present = np.isfinite(rows[:, [names.index(emulator.observables[c]) for c in columns]]).astype(float)
    counts = present.sum(axis=0)
    mean = measured.mean(condition)[[names.index(emulator.observables[c]) for c in columns]]
    return Block(condition, columns, mean, present.T @ present / np.outer(counts, counts), inflation[columns])


def _inflation(measured: Measured, emulator: Emulator, notes: list[str]) -> np.ndarray:
    """Square root of the measured over the model's variance where that is too large to be chance."""
    count = len(emulator.observables)
    squares, freedom, known = np.zeros(count), np.zeros(count), np.zeros(count)
    centre = np.zeros(len(emulator.space.factors))
    pairs = [
        (column, measured.observables.index(name))
        for column, name in enumerate(emulator.observables)
        if name in measured.observables
    ]
    for condition in (name for name in measured.conditions if name in emulator.surfaces):
        noise = emulator.surfaces[condition].noise
        variance, counts = noise.variance(centre), measured.counts(condition)
        rows = measured.values[condition] - measured.mean(condition)
        for column, own in pairs:
            if counts[own] >= 2:
                squares[column] += np.nansum(rows[:, own] ** 2) / variance[column]
                freedom[column] += counts[own] - 1
                known[column] += noise.degrees_of_freedom
    ratio = squares / np.maximum(freedom, 1.0)
    limit = stats.f.isf(SCATTER_LEVEL, np.maximum(freedom, 1.0), np.maximum(known, 1.0))
    wide = (freedom > 0) & (ratio > limit)
    notes += [
        f"replicates of {emulator.observables[i]} scatter {np.sqrt(ratio[i]):.1f} times as much as the"
        " model's, and count so"
        for i in np.flatnonzero(wide)
    ]
    return np.where(wide, np.sqrt(ratio), 1.0)
