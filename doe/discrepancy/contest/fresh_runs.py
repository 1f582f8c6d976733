"""Fresh runs in batches: their points, seeds and outcomes."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np

from doe.discrepancy.emulation.emulator import Emulator
from doe.discrepancy.fitting.misses import Runs
from doe.discrepancy.problem.outcomes import Outcomes, Point
from doe.errors import RuleError

DIGITS = 4
"""Decimals of the coded points of fresh runs: fits whose last bits differ by the host ask for the same
points."""

Batches = Generator[list[Point], Outcomes, list[Runs]]


@dataclass(frozen=True, eq=False)
class Request:
    """Requested runs of one model."""

    mechanisms: tuple[str, ...]
    x: np.ndarray
    """Coded points, (n, parameters)."""
    repeats: int
    """Runs of each point, in every condition."""


class FreshRuns:
    """Source of fresh runs, with a count; every case of a data set has its own seed.

    Parameters
    ----------
    conditions : sequence of str
        Conditions under which every point is run.
    """

    def __init__(self, emulator: Emulator, conditions: Sequence[str], seed: int) -> None:
        self.emulator = emulator
        self.conditions = tuple(conditions)
        self.seed = seed
        self.cases = 0
        self.failures = 0
        self._batches = 0

    @property
    def runs_end(self) -> bool:
        """True if any run has ended; published tables give no fresh runs."""
        return self.failures < self.cases

    def batch(self, requests: Sequence[Request]) -> Batches:
        """Yield the points of one batch, receive their outcomes, return the finished runs by request.

        Raises RuleError: another number of outcomes than of points.
        """
        cases = [
            (number, row, condition)
            for number, request in enumerate(requests)
            for row in np.round(request.x, DIGITS)
            for _ in range(request.repeats)
            for condition in self.conditions
        ]
        self._batches += 1
        seeds = np.random.SeedSequence([self.seed, self._batches]).generate_state(len(cases)) >> 1
        space = self.emulator.space
        outcomes = yield [
            space.point(row, requests[number].mechanisms, condition, int(seed))
            for (number, row, condition), seed in zip(cases, seeds, strict=True)
        ]
        if len(outcomes.reasons) != len(cases):
            rule = f"must have one for each of {len(cases)} points"
            raise RuleError("outcomes", rule, len(outcomes.reasons))
        self.cases += len(cases)
        self.failures += int((~outcomes.finished).sum())
        owners = np.array([number for number, _, _ in cases])
        return [
            self._runs(cases, outcomes, np.flatnonzero((owners == number) & outcomes.finished))
            for number in range(len(requests))
        ]

    def _runs(
        self, cases: Sequence[tuple[int, np.ndarray, str]], outcomes: Outcomes, rows: np.ndarray
    ) -> Runs:
        x = np.array([cases[row][1] for row in rows])
        conditions = np.array([cases[row][2] for row in rows], dtype=np.str_)
        return Runs(x, conditions, outcomes.values[rows][:, self.emulator.columns])
