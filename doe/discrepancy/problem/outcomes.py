"""The simulator as an analysis sees it: points in, observables out.

A solver, an emulator and a table of finished runs have the same interface; the statistics never know which of
them they use.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np


@dataclass(frozen=True)
class Point:
    """One case: parameters, active mechanisms, condition and seed."""

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
    """Observables in their natural units, (n, observables); rows of failed cases are NaN."""
    reasons: tuple[str, ...]
    """Reason of each failed case; empty for the others."""

    @property
    def finished(self) -> np.ndarray:
        """True where a case has observables, (n,)."""
        return np.array([not reason for reason in self.reasons], dtype=bool)


class Simulator(Protocol):
    """Callable that answers points with observables."""

    observables: tuple[str, ...]
    """Names of the columns of the outcomes."""

    def __call__(self, points: Sequence[Point]) -> Outcomes:
        """Return the observables of every point, all of them at once."""
