"""The experiment that distinguishes two models best (Hunter and Reiner 1965; Box and Hill 1967)."""

from dataclasses import dataclass

import numpy as np

from doe.discrepancy.contest.signatures import projector
from doe.discrepancy.fitting.fitted_model import Stack
from doe.discrepancy.fitting.measured_means import Block
from doe.discrepancy.fitting.model_fit import Fitted, whiten


@dataclass(frozen=True)
class NextExperiment:
    """Condition that would settle the verdict best."""

    condition: str
    changes: tuple[tuple[str, str], ...]
    """Settings that differ from the first: place and value."""
    separates: tuple[str, str]
    """Two models, each a mechanism's name or "base"."""
    expected_q: float
    """Q between the two, each refitted, with ``replicates`` measurements."""
    replicates: int
    observable: str
    """The observable that differs most."""
    wanted_q: float
    """Q between the two that distinguishes them."""

    @property
    def settles(self) -> bool:
        """True if the experiment can be expected to distinguish the two."""
        return self.expected_q >= self.wanted_q


TIMES = (1, 2, 4, 8)
"""Multiples of the measured replicates that are tried: beyond them the emulator's error remains."""


def propose(first: Fitted, second: Fitted, replicates: int, wanted_q: float) -> NextExperiment:
    """Choose the condition whose repetition separates two fitted models by most, the second refitted.

    It is repeated as often as it was measured, or two, four or eight times as often where only that
    distinguishes them, i.e. where Q reaches ``wanted_q``. The expected Q is that of the means that the first
    predicts, fitted by the second (linearised) in the old conditions and the new one together. ``changes``
    stays empty: the caller defined the conditions.
    """
    tried = (_best(first, second, times * replicates, wanted_q) for times in TIMES)
    last = next(tried)
    for each in tried:
        if last.settles:
            break
        last = each
    return last


def _best(first: Fitted, second: Fitted, replicates: int, wanted_q: float) -> NextExperiment:
    """Choose the condition for a number of measurements."""
    emulator, tried = first.model.emulator, []
    for condition in emulator.space.conditions:
        block = Block.of_runs(condition, np.arange(len(emulator.observables)), replicates)
        expected, contrast = _separation(first, second, block)
        tried.append((expected, condition, emulator.observables[int(np.argmax(np.abs(contrast)))]))
    expected, condition, observable = max(tried, key=lambda one: one[0])
    titles = (_title(first), _title(second))
    return NextExperiment(condition, (), titles, expected, replicates, observable, wanted_q)


def _separation(first: Fitted, second: Fitted, block: Block) -> tuple[float, np.ndarray]:
    """Return the expected Q, and the new condition's differences in standard deviations."""
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
