"""Result of a simulation, and its progress."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Progress:
    """Progress of a simulation.

    Attributes
    ----------
    done, total : int
        Cases.
    fraction : float
        Of all work, 0 to 1.
    phase_counts : dict
        Cases that have not ended, by phase.
    seconds : float
        Wall time so far [s].
    """

    done: int
    total: int
    fraction: float
    phase_counts: dict[str, int]
    seconds: float


@dataclass(frozen=True, eq=False)
class CaseResult:
    """End of one case.

    Attributes
    ----------
    status : str
        "finished", "diverged", "overflow", or "failed".
    reason : str
        What happened, and what helps; empty when finished.
    positions, orientations : (n, 3) and (n, 4) arrays
        Poses of the grains left [m], quaternions x y z w.
    sizes : (n,) array
    shapes : (n,) int array
        Index of each grain's shape into `clumps`.
    clumps : (shapes, S, 4) array
        Local centre and radius of each sphere of each shape [m]; a shape of fewer than S spheres is filled up
        with radii of 0, which are no spheres.
    observables : dict of float
        Those of the scene, in the units that it says. Beside them `rebuilds` of the neighbour lists, and
        `late_rebuilds`: 1 when a grain may have outrun its list.
    phases : list of dict
        Name, time [s] and steps of each phase.
    provenance : dict
        Versions, device and precision.
    """

    status: str
    reason: str
    positions: np.ndarray
    orientations: np.ndarray
    sizes: np.ndarray
    shapes: np.ndarray
    clumps: np.ndarray
    observables: dict[str, float] = field(default_factory=dict)
    phases: list[dict[str, Any]] = field(default_factory=list)
    provenance: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def sphere_centers(self) -> np.ndarray:
        """Sphere centres in place [m], (spheres, 3), grain by grain."""
        vector, scalar = self.orientations[:, None, :3], self.orientations[:, None, 3:]
        local = self.clumps[self.shapes, :, :3] * self.sizes[:, None, None]
        turned = 2.0 * np.cross(vector, local)
        placed = self.positions[:, None] + local + scalar * turned + np.cross(vector, turned)
        return placed[self._exist]

    @property
    def sphere_radii(self) -> np.ndarray:
        """Sphere radii [m], (spheres,)."""
        return (self.clumps[self.shapes, :, 3] * self.sizes[:, None])[self._exist]

    @property
    def sphere_grain(self) -> np.ndarray:
        """Grain of each sphere, (spheres,)."""
        return np.nonzero(self._exist)[0]

    @property
    def _exist(self) -> np.ndarray:
        """True where a grain has the sphere of a number, (n, S)."""
        return self.clumps[self.shapes, :, 3] > 0.0


OnResult = Callable[[int, CaseResult], None]
OnProgress = Callable[[Progress], None]
