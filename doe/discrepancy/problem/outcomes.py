"""The simulator as an analysis sees it: points in, observables out.

A solver, an emulator and a table of finished runs all answer alike, so that the statistics never know which
of them they talk to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np


@dataclass(frozen=True)
class Point:
    """One case: the parameters, the effects that are in the model, where it is tested, and the seed."""

    theta: tuple[float, ...]
    """Values of the factors in natural units, in their order."""
    sizes: tuple[tuple[str, float], ...]
    """Mechanisms by name with their sizes in natural units, sorted by name; every other is at its null."""
    condition: str
    """Name of the condition."""
    seed: int
    """Seed of everything random in the case."""


@dataclass(frozen=True, eq=False)
class Outcomes:
    """Outcomes of a list of points, in their order."""

    values: np.ndarray
    """Observables in their natural units; rows of cases that failed are NaN, and no one may read them, (n,
    observables)."""
    reasons: tuple[str, ...]
    """Reason of each case that failed; empty where it did not."""

    @property
    def finished(self) -> np.ndarray:
        """True where a case has observables, (n,)."""
        return np.array([not reason for reason in self.reasons], dtype=bool)


class Simulator(Protocol):
    """Anything that answers points with observables."""

    observables: tuple[str, ...]
    """Names of the columns of the outcomes."""

    def __call__(self, points: Sequence[Point]) -> Outcomes:
        """Observables of every point; all of them at once."""
