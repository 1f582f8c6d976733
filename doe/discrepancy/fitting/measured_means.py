"""Measured means as a model sees them: stacked over conditions, with the covariance of their error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from doe.discrepancy.emulation.emulator import Emulator
from doe.discrepancy.fitting.scatter import NOTHING, Excess, Scatter
from doe.discrepancy.problem.replicates import Calibration, Measured


@dataclass(frozen=True, eq=False)
class Block:
    """Means of one condition."""

    condition: str
    columns: np.ndarray
    """Numbers of the emulator's observables that were measured, (k,)."""
    mean: np.ndarray
    """(k,)."""
    share: np.ndarray
    """Covariance of the means over that of one replicate: 1 / n where all have n replicates, (k, k)."""
    scatter: Scatter
    """Scatter of the replicates of all conditions."""
    common: np.ndarray
    """Change of each mean by a standard deviation of the offset, and of the scale, of its observable, common
    to all conditions, (2, k)."""
    scales: np.ndarray
    """Number of the error of scale of each mean (`scale_numbers`), (k,)."""

    @classmethod
    def of_runs(cls, condition: str, columns: np.ndarray, count: int) -> Block:
        """Return the means of simulated runs, as zeros, with the scatter of the model."""
        return cls.of_means(condition, columns, np.zeros(len(columns)), count)

    @classmethod
    def of_means(cls, condition: str, columns: np.ndarray, mean: np.ndarray, count: int) -> Block:
        """Return the means of replicates that scatter as the model does, measured without error."""
        share = np.full((len(columns), len(columns)), 1.0 / count)
        return cls(condition, columns, mean, share, NOTHING, np.zeros((2, len(columns))), columns)

    def calibrated(self, observables: Sequence[str], calibration: Mapping[str, Calibration]) -> Block:
        """Return the same with calibration errors by observable of the emulator."""
        known = [calibration.get(observables[column], Calibration()) for column in self.columns]
        moved = np.array(
            [[one.offset, one.scale * value] for one, value in zip(known, self.mean, strict=True)]
        )
        scales = scale_numbers(observables, calibration)[self.columns]
        return replace(self, common=moved.reshape(-1, 2).T, scales=scales)

    @cached_property
    def square(self) -> tuple[np.ndarray, ...]:
        """Index of the means' part of a matrix of all observables."""
        return np.ix_(self.columns, self.columns)

    @property
    def replicates(self) -> np.ndarray:
        """Replicates of each mean, (k,)."""
        return np.rint(1.0 / np.diag(self.share)).astype(int)

    def noise(self, covariance: np.ndarray, excess: Excess) -> np.ndarray:
        """Return the covariance of the means' noise (k, k) from that of one run and the excess."""
        return np.asarray(excess.added_to(covariance)[self.square] * self.share)


@dataclass(frozen=True, eq=False)
class Evidence:
    """Measured means of the observables and conditions of the emulator."""

    training: tuple[Block, ...]
    held_out: tuple[Block, ...]
    notes: tuple[str, ...]
    calibration: Mapping[str, Calibration]
    """Calibration errors by observable."""
    views: Mapping[str, float]
    """Azimuth of the view by condition [deg]."""

    @property
    def count(self) -> int:
        """Number of means in a fit."""
        return sum(len(block.mean) for block in self.training)


def gather(measured: Measured, emulator: Emulator) -> Evidence:
    """Reduce measured data to the emulator's conditions and observables; notes name the parts left out."""
    notes = list(measured.notes)
    strange = [name for name in measured.observables if name not in emulator.observables]
    notes += [f"{name} is not among the simulated observables: left out" for name in strange]
    known = [condition for condition in measured.conditions if condition in emulator.surfaces]
    scatter = Scatter.of(measured, emulator.observables, known)
    blocks = []
    for condition in measured.conditions:
        if condition not in emulator.surfaces:
            notes.append(f"condition {condition} is not in the bank: left out")
            continue
        block = _block(measured, emulator, condition, scatter)
        if len(block.mean):
            blocks.append(block)
        else:
            notes.append(f"condition {condition} has no value to compare: left out")
    held_out = tuple(block for block in blocks if emulator.space.is_held_out(block.condition))
    training = tuple(block for block in blocks if not emulator.space.is_held_out(block.condition))
    present = {block.condition for block in blocks}
    notes += [f"condition {c} was not measured" for c in emulator.space.conditions if c not in present]
    return Evidence(training, held_out, tuple(dict.fromkeys(notes)), measured.calibration, measured.views)


def _block(measured: Measured, emulator: Emulator, condition: str, scatter: Scatter) -> Block:
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
    share = present.T @ present / np.outer(counts, counts)
    block = replace(Block.of_means(condition, columns, mean, 1), share=share, scatter=scatter)
    return block.calibrated(emulator.observables, measured.calibration)


def scale_numbers(observables: Sequence[str], calibration: Mapping[str, Calibration]) -> np.ndarray:
    """Return the number of each observable's error of scale: the first observable of its instrument."""
    first: dict[str, int] = {}
    of = [calibration.get(name, Calibration()).instrument for name in observables]
    return np.array([first.setdefault(name, at) if name else at for at, name in enumerate(of)], dtype=int)
