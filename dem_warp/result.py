"""Result of a simulation, and its progress."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Progress:
    """Progress of a simulation."""

    done: int
    total: int
    """Number of ended cases, and of all."""
    fraction: float
    """Fraction of all work done, 0 to 1."""
    phase_counts: dict[str, int]
    """Number of running cases by phase."""
    seconds: float
    """Wall time so far [s]."""


@dataclass(frozen=True, eq=False)
class CaseResult:
    """Result of one case."""

    status: str
    """"finished", "diverged", "overflow" or "failed"; with another program also "no-answer"."""
    reason: str
    """Cause of a failure with advice; empty when finished."""
    positions: np.ndarray
    orientations: np.ndarray
    """Positions [m] and orientations (quaternions x y z w) of the remaining grains, (n, 3) and (n, 4)."""
    sizes: np.ndarray
    """Scale of each grain's shape, shape (n,)."""
    shapes: np.ndarray
    """Index of each grain's shape into `clumps`, shape (n,)."""
    clumps: np.ndarray
    """Local centre and radius of each sphere of each shape [m], padded with radii of 0, (shapes, S, 4)."""
    observables: dict[str, float] = field(default_factory=dict)
    """Observables of the scene, in its units, and `rebuilds` of the neighbour lists."""
    phases: list[dict[str, Any]] = field(default_factory=list)
    """Name, duration [s] and steps of each phase."""
    provenance: dict[str, Any] = field(default_factory=dict)
    """Versions, device and precision."""

    @property
    def sphere_centers(self) -> np.ndarray:
        """Sphere centres [m], (spheres, 3), grain by grain."""
        return self._spheres[0]

    @property
    def sphere_radii(self) -> np.ndarray:
        """Sphere radii [m], (spheres,)."""
        return self._spheres[1]

    @property
    def sphere_grain(self) -> np.ndarray:
        """Grain of each sphere, (spheres,)."""
        return self._spheres[2]

    @cached_property
    def _spheres(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return place_spheres(self.positions, self.orientations, self.sizes, self.clumps[self.shapes])


def place_spheres(
    positions: np.ndarray, orientations: np.ndarray, sizes: np.ndarray, clumps: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return centres [m], (spheres, 3), radii [m] and grains, (spheres,), of the spheres, grain by grain.

    The parameters are as in `CaseResult`, but `clumps` (n, S, 4) has the spheres of each grain's shape.
    """
    vector, scalar = orientations[:, None, :3], orientations[:, None, 3:]
    local = clumps[:, :, :3] * sizes[:, None, None]
    turned = 2.0 * np.cross(vector, local)
    placed = positions[:, None] + local + scalar * turned + np.cross(vector, turned)
    exist = clumps[:, :, 3] > 0.0
    return placed[exist], (clumps[:, :, 3] * sizes[:, None])[exist], np.nonzero(exist)[0]


OnResult = Callable[[int, CaseResult], None]
OnProgress = Callable[[Progress], None]
