"""Many cases at once: on a GPU all worlds in one batch, on a CPU a world a process, spread over the cores."""

import os
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import warp as wp

from dem_warp.case import Case
from dem_warp.device import resolve_device
from dem_warp.processes import run_in_processes
from dem_warp.scenes.lifted_cylinder import Controller, Decision
from dem_warp.solver import CHUNK, Solver
from dem_warp.types import WorldFlag

REPORT_EVERY = 0.5
"""Time between two reports of progress [s]."""

ADVICE = {
    WorldFlag.DIVERGED: (
        "diverged",
        "a grain passed the speed limit at {time:.4f} s: lower time_step_fraction "
        "(LIGGGHTS and EDEM users halve it)",
    ),
    WorldFlag.NEIGHBOUR_OVERFLOW: (
        "overflow",
        "a neighbour list overflowed at {time:.4f} s: lower the skin or check the grains for large overlaps",
    ),
}


@dataclass(frozen=True)
class Progress:
    """How far a batch is.

    Attributes
    ----------
    done, total : int
        Cases.
    fraction : float
        Of all work, 0 to 1.
    phase_counts : dict
        Running worlds by phase.
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
    clump : (S, 4) array
        Local centre and radius of each sphere of the shape [m].
    sphere_centers, sphere_radii : (n * S, 3) and (n * S,) arrays
        The spheres in place [m], worked out from the poses.
    sphere_grain : (n * S,) int array
        Grain of each sphere.
    observables : dict of float
        In SI units; see the scene.
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
    clump: np.ndarray
    observables: dict[str, float] = field(default_factory=dict)
    phases: list[dict[str, Any]] = field(default_factory=list)
    provenance: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def sphere_centers(self) -> np.ndarray:
        """Sphere centres in place [m], (n * S, 3)."""
        vector, scalar = self.orientations[:, None, :3], self.orientations[:, None, 3:]
        local = self.clump[None, :, :3] * self.sizes[:, None, None]
        turned = 2.0 * np.cross(vector, local)
        return (self.positions[:, None] + local + scalar * turned + np.cross(vector, turned)).reshape(-1, 3)

    @property
    def sphere_radii(self) -> np.ndarray:
        """Sphere radii [m], (n * S,)."""
        return (self.clump[None, :, 3] * self.sizes[:, None]).ravel()

    @property
    def sphere_grain(self) -> np.ndarray:
        """Grain of each sphere, (n * S,)."""
        return np.repeat(np.arange(len(self.sizes)), len(self.clump))


OnResult = Callable[[int, CaseResult], None]
OnProgress = Callable[[Progress], None]


def simulate(
    cases: Sequence[Case],
    device: str | None = None,
    workers: int | None = None,
    on_result: OnResult | None = None,
    on_progress: OnProgress | None = None,
) -> list[CaseResult]:
    """Simulate cases at once.

    Parameters
    ----------
    cases : sequence of Case
    device : str, optional
        "cpu", "cuda" or "cuda:N"; by default the GPU if there is one.
    workers : int, optional
        Processes on a CPU; by default one a core. Warp's CPU kernels run on one thread.
    on_result : callable, optional
        Called with the index and the result of each case as it ends.
    on_progress : callable, optional
        Called with a `Progress` now and then.

    Returns
    -------
    list of CaseResult
        In the order of the cases. A case that goes wrong has its status; it neither raises nor changes
        another case.

    Raises
    ------
    ValueError
        If the device is not there.
    """
    name = resolve_device(device)
    on_result = on_result or (lambda index, result: None)
    on_progress = on_progress or (lambda progress: None)
    if not cases:
        return []
    if name == "cpu":
        workers = min(workers or os.cpu_count() or 1, len(cases))
        if workers > 1:
            return run_in_processes(cases, workers, on_result, on_progress)
    results: list[CaseResult | None] = [None] * len(cases)

    def keep(index: int, result: CaseResult) -> None:
        results[index] = result
        on_result(index, result)

    for members in _batches(cases, one_each=name == "cpu"):
        Batch([cases[i] for i in members], name, members, len(cases)).run(keep, on_progress)
    return [result for result in results if result is not None]


def _batches(cases: Sequence[Case], one_each: bool) -> list[list[int]]:
    """Cases that run in one launch: all of one precision; on a CPU one by one, to keep a world in cache."""
    if one_each:
        return [[i] for i in range(len(cases))]
    groups: dict[str, list[int]] = {}
    for i, case in enumerate(cases):
        groups.setdefault(case.numerics.precision, []).append(i)
    return list(groups.values())


class Batch:
    """Worlds that run in one launch, each under the controller of its scene.

    `indices` are the cases' places among all `total` cases.
    """

    def __init__(self, cases: Sequence[Case], device: str, indices: Sequence[int], total: int) -> None:
        self.cases, self.indices, self.total = list(cases), list(indices), total
        setups = cases[0].scene.prepare(cases, device)
        self.setups = setups
        self.solver = Solver(setups, device, cases[0].numerics.precision)
        self.controllers = [Controller(case, setup, CHUNK) for case, setup in zip(cases, setups, strict=True)]
        self.running = list(range(len(cases)))
        self.chunk = 0
        self._started = time.perf_counter()
        self._reported = self._started

    def run(self, on_result: OnResult, on_progress: OnProgress) -> None:
        """Run every world to its end."""
        while self.running:
            for w, result in self.advance():
                on_result(self.indices[w], result)
            self._report(on_progress)

    def advance(self) -> list[tuple[int, CaseResult]]:
        """Step until the next controller is due, let it decide, and return the worlds that ended."""
        apart = min(self.controllers[w].period for w in self.running) // CHUNK
        ahead = apart - self.chunk % apart
        self.solver.advance(ahead)
        self.chunk += ahead
        return self._look([w for w in self.running if self.chunk * CHUNK % self.controllers[w].period == 0])

    def _look(self, due: Sequence[int]) -> list[tuple[int, CaseResult]]:
        """Let the controllers of the worlds that are due decide; results of those that ended."""
        flags = self.solver.flags.numpy()
        ended = []
        for w, view in zip(due, self.solver.view(due), strict=True):
            verdict = _verdict(WorldFlag(int(flags[w])), view.time)
            if verdict is None:
                decision = self.controllers[w].look(view)
                self._carry_out(w, decision)
                if not decision.done:
                    continue
                verdict = ("failed" if decision.failure else "finished", decision.failure)
            self.solver.stop(w)
            self.running.remove(w)
            ended.append((w, self._result(w, *verdict)))
        return ended

    def _carry_out(self, w: int, decision: Decision) -> None:
        if decision.remove is not None:
            self.solver.remove(w, decision.remove)
        if decision.move is not None:
            self.solver.move_wall(w, *decision.move)

    def _result(self, w: int, status: str, reason: str) -> CaseResult:
        poses, setup, controller = self.solver.poses(w), self.setups[w], self.controllers[w]
        shape = self.cases[w].grains.shape
        return CaseResult(
            status=status,
            reason=reason,
            positions=poses["positions"],
            orientations=poses["orientations"],
            sizes=setup.grains.sizes[poses["slots"]],
            clump=np.column_stack([shape.centers, shape.radii]),
            observables=dict(controller.observables, rebuilds=float(self.solver.rebuilds.numpy()[w])),
            phases=controller.phases,
            provenance=provenance(self.solver),
        )

    def _report(self, on_progress: OnProgress) -> None:
        now = time.perf_counter()
        if self.running and now - self._reported < REPORT_EVERY:
            return
        self._reported = now
        parts = [
            self.controllers[w].fraction(self.chunk * CHUNK * self.setups[w].time_step) for w in self.running
        ]
        done = len(self.cases) - len(self.running)
        on_progress(
            Progress(
                done=done,
                total=len(self.cases),
                fraction=(done + sum(parts)) / len(self.cases),
                phase_counts=dict(Counter(self.controllers[w].phase for w in self.running)),
                seconds=now - self._started,
            )
        )


def _verdict(flags: WorldFlag, at: float) -> tuple[str, str] | None:
    for flag, (status, advice) in ADVICE.items():
        if flag in flags:
            return status, advice.format(time=at)
    return None


def provenance(solver: Solver) -> dict[str, Any]:
    """Versions, device and precision of a run."""
    return {
        "warp": wp.__version__,
        "numpy": np.__version__,
        "device": solver.device.name if solver.device.is_cuda else "CPU",
        "precision": solver.precision.name,
    }
