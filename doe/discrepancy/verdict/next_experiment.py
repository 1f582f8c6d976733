"""The experiment that would tell two models apart best (Hunter and Reiner 1965; Box and Hill 1967)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from doe.discrepancy.contest.signatures import projector
from doe.discrepancy.fitting.fitted_model import Stack
from doe.discrepancy.fitting.measured_means import Block
from doe.discrepancy.fitting.model_fit import Fitted, whiten


@dataclass(frozen=True)
class NextExperiment:
    """The condition that would settle the verdict best."""

    condition: str
    changes: tuple[tuple[str, str], ...]
    """Its settings that differ from the first: place and value."""
    separates: tuple[str, str]
    """Two models, each a mechanism's name or "base"."""
    expected_q: float
    """Q between the two, each refitted, with ``replicates`` measurements."""
    replicates: int
    observable: str
    """The observable that differs most."""
    wanted_q: float
    """Q between the two that tells them apart."""

    @property
    def settles(self) -> bool:
        """True if it can be expected to tell the two apart."""
        return self.expected_q >= self.wanted_q


TIMES = (1, 2, 4, 8)
"""Multiples of the measured replicates that are tried: beyond them the emulator's error is what is left."""


def propose(first: Fitted, second: Fitted, replicates: int, wanted_q: float) -> NextExperiment:
    """Choose the condition whose repetition separates two fitted models by most, the second refitted.

    It is repeated as often as it was measured, or twice, four or eight times as often where only that tells
    them apart.

    The expected Q between them is that of the means that the first predicts, fitted by the second
    (linearised) in the old conditions and the new one together.

    Parameters
    ----------
    first, second : Fitted
    replicates : int
        Measurements of a condition so far.
    wanted_q : float
        Q between the two that tells them apart.

    Returns
    -------
    NextExperiment
        Without its ``changes``, which whoever defined the conditions knows.
    """
    tried = (_best(first, second, times * replicates, wanted_q) for times in TIMES)
    last = next(tried)
    for each in tried:
        if last.settles:
            break
        last = each
    return last


def _best(first: Fitted, second: Fitted, replicates: int, wanted_q: float) -> NextExperiment:
    """Choose the condition for so many measurements."""
    emulator = first.model.emulator
    best: tuple[float, str, str] | None = None
    for condition in emulator.space.conditions:
        block = Block.of_runs(condition, np.arange(len(emulator.observables)), replicates)
        expected, contrast = _separation(first, second, block)
        if best is None or expected > best[0]:
            best = (expected, condition, emulator.observables[int(np.argmax(np.abs(contrast)))])
    if best is None:
        raise ValueError(f"a next experiment needs a condition, got {emulator.space.conditions}")
    titles = (_title(first), _title(second))
    return NextExperiment(best[1], (), titles, best[0], replicates, best[2], wanted_q)


def _separation(first: Fitted, second: Fitted, block: Block) -> tuple[float, np.ndarray]:
    """Expected Q, and the new condition's differences in standard deviations."""
    blocks = (*second.stack.blocks, block)
    stack = Stack(second.model, blocks)
    whitening = whiten(stack.covariance(second.x))
    difference = Stack(first.model, blocks).predict(first.x[None])[0] - stack.predict(second.x[None])[0]
    slopes = whitening @ stack.jacobian(second.x[None])[0]
    left = projector(slopes) @ whitening @ difference
    new = slice(len(difference) - len(block.mean), None)
    return float(left @ left), difference[new] / np.sqrt(np.diag(stack.covariance(second.x)))[new]


def _title(fitted: Fitted) -> str:
    return " + ".join(fitted.mechanisms) if fitted.mechanisms else "base"
