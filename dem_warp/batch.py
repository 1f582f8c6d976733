"""Worlds that run in one launch, each under the controller of its scene."""

import logging
import time
from collections.abc import Sequence
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import warp as wp

from dem_warp.case import Case
from dem_warp.checkpoint import Checkpoints, case_name
from dem_warp.clumps import stack_spheres
from dem_warp.provenance import engine_fingerprint, provenance
from dem_warp.result import CaseResult
from dem_warp.rollback import Rollback
from dem_warp.room import neighbour_room
from dem_warp.scenes.scene import course_of
from dem_warp.snapshot import STEP, put_snapshot, take_snapshot
from dem_warp.solver import CHUNK, Solver
from dem_warp.types import Care, WorldFlag

_log = logging.getLogger(__name__)

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
    WorldFlag.LATE_REBUILD: (
        "failed",
        "a grain or a wall outran the neighbour lists within a step at {time:.4f} s: "
        "raise numerics.skin, or lower time_step_fraction",
    ),
}


class Onlooker(Protocol):
    """Sees a batch between two stretches of steps, and changes nothing of it.

    On a CPU each process has a copy of its own, so that it can be pickled.
    """

    def __call__(self, batch: "Batch") -> None:
        """Look at the batch, or do not: it is called often."""
        ...


class Batch:
    """Cases of one kind of scene, precision and largest number of spheres, as worlds of one launch.

    Parameters
    ----------
    cases : sequence of Case
    device : str
    checkpoints : Checkpoints, optional
        Where the cases are saved now and then, and go on from where an earlier run left them.
    onlooker : Onlooker, optional
        Called after every stretch of steps.
    """

    def __init__(
        self,
        cases: Sequence[Case],
        device: str,
        checkpoints: Checkpoints | None = None,
        onlooker: Onlooker | None = None,
    ) -> None:
        self.cases = list(cases)
        self.setups = cases[0].scene.prepare(cases, device)
        self.solver = Solver(self.setups, device, cases[0].numerics.precision)
        self.controllers = [
            case.scene.controller(case, setup, CHUNK) for case, setup in zip(cases, self.setups, strict=True)
        ]
        self._rollback = Rollback(self.solver)
        self.running = list(range(len(cases)))
        self.steps = [0] * len(cases)
        self.provenance = provenance(self.solver.device, self.solver.precision.name)
        self._checkpoints, self._saved = checkpoints, time.monotonic()
        self._onlooker = onlooker
        self._resume()

    def advance(self) -> list[tuple[int, CaseResult]]:
        """Step until the next controller is due, let it decide, and return the worlds that ended."""
        ahead = min(
            self.controllers[w].period - self.steps[w] % self.controllers[w].period for w in self.running
        )
        self._rollback.keep()
        self.solver.advance(ahead // CHUNK)
        due = self._take_back_late(ahead)
        ended = self._look(due)
        if self._checkpoints and time.monotonic() - self._saved >= self._checkpoints.every:
            self.save()
        if self._onlooker:
            self._onlooker(self)
        return ended

    def _take_back_late(self, ahead: int) -> list[int]:
        """Count the steps that were taken, save those of worlds whose lists were outrun; return who is due.

        Such a world goes back and takes them again, with more care. One that outruns its lists even with the
        greatest care is due at once: its end.
        """
        flags = self.solver.flags.numpy()
        late = {w for w in self.running if WorldFlag.LATE_REBUILD in WorldFlag(int(flags[w]))}
        again = set() if self.solver.care == Care.EVERY_STEP else late
        for w in again:
            self._rollback.restore(w)
        self.solver.care = Care(self.solver.care + 1) if again else Care.USUAL
        for w in set(self.running) - again:
            self.steps[w] += ahead
        return [
            w for w in self.running
            if w not in again and (w in late or self.steps[w] % self.controllers[w].period == 0)
        ]  # fmt: skip

    def fraction(self, world: int) -> float:
        """Roughly how much of a world is done, 0 to 1."""
        if world not in self.running:
            return 1.0
        return self.controllers[world].fraction(self.steps[world] * self.setups[world].time_step)

    def phase(self, world: int) -> str:
        """Phase that a world is in."""
        return self.controllers[world].course.phase

    def case_name(self, world: int) -> str:
        """Name of the case of a world, by which its checkpoint is known too."""
        return case_name(self.cases[world])

    @cached_property
    def maker(self) -> dict[str, Any]:
        """All that must be the same where a checkpoint goes on: libraries, device, engine."""
        engine = engine_fingerprint(*(kind for case in self.cases for kind in case.kinds))
        same = {name: value for name, value in self.provenance.items() if name not in ("dem-warp", "commit")}
        return same | {"engine": engine}

    # ---- checkpoints ---------------------------------------------------------------------------------------

    def _resume(self) -> None:
        """Bring every case that has a checkpoint to where an earlier run left it."""
        if self._checkpoints is None:
            return
        for w, (case, controller) in enumerate(zip(self.cases, self.controllers, strict=True)):
            try:
                if kept := self._checkpoints.load(case, self.maker):
                    fresh, snapshot = controller.course, kept[1]
                    controller.course = course_of(type(fresh), kept[0])
                    try:
                        controller.fraction(0.0)  # knows the phase
                        put_snapshot(self.solver, w, snapshot)
                    except (LookupError, TypeError, ValueError):
                        controller.course = fresh
                        raise
                    self.steps[w] = int(snapshot[STEP].item())
            except (LookupError, TypeError, ValueError) as error:
                path = self._checkpoints.path(case)
                _log.warning("%s: a checkpoint that cannot be used, its case starts afresh: %s", path, error)

    def save(self) -> None:
        """Write a checkpoint of every running case."""
        if self._checkpoints is None:
            return
        for w in self.running:
            snapshot = take_snapshot(self.solver, w)
            self._checkpoints.save(self.cases[w], self.maker, self.controllers[w].course, snapshot)
        self._saved = time.monotonic()

    # ---- what the controllers decide -----------------------------------------------------------------------

    def _look(self, due: Sequence[int]) -> list[tuple[int, CaseResult]]:
        """Let the controllers of the worlds that are due decide; results of those that ended."""
        flags = self.solver.flags.numpy()
        ended, moves = [], []
        for w, view in zip(due, self.solver.view(due), strict=True):
            verdict = _verdict(WorldFlag(int(flags[w])), view.time) if flags[w] else None
            if verdict is None:
                decision = self.controllers[w].look(view)
                if decision.remove is not None:
                    self.solver.remove(w, decision.remove)
                moves += [(w, wall, motion) for wall, motion in decision.move.items()]
                if not decision.done:
                    continue
                verdict = ("failed" if decision.failure else "finished", decision.failure)
                if not np.isfinite(view.positions[view.alive]).all():
                    verdict = ("diverged", "a grain is nowhere: its position is no number")
            self.solver.stop(w)
            self.running.remove(w)
            ended.append((w, self.result(w, *verdict)))
        self.solver.move_walls(moves)
        return ended

    def result(self, w: int, status: str = "running", reason: str = "") -> CaseResult:
        """Result of a world as it stands now, which may be before its end."""
        poses, course, setup = self.solver.poses(w), self.controllers[w].course, self.setups[w]
        counts = {"rebuilds": float(self.solver.rebuilds.numpy()[w])}
        return CaseResult(
            status=status,
            reason=reason,
            positions=poses["positions"],
            orientations=poses["orientations"],
            sizes=setup.grains.sizes[poses["slots"]],
            shapes=setup.grains.shapes[poses["slots"]],
            clumps=stack_spheres(setup.shapes),
            observables=course.observables | counts,
            phases=course.phases,
            provenance=self.provenance | {"laws": self.cases[w].laws.to_dict()},
        )


def begin(
    cases: Sequence[Case],
    device: str,
    checkpoints: Checkpoints | None = None,
    onlooker: Onlooker | None = None,
) -> tuple[Batch | None, list[int], dict[int, CaseResult]]:
    """Begin a batch of those cases that can be, and fail the others.

    Returns
    -------
    batch
        None where no case can be begun.
    begun
        Index of the case of each of its worlds.
    refused
        Results of the others by their indices, each with its reason.
    """
    try:
        return Batch(cases, device, checkpoints, onlooker), list(range(len(cases))), {}
    except (ValueError, MemoryError):
        faults = {i: _fault(case, device) for i, case in enumerate(cases)}
        refused = {i: _refusal(cases[i], reason, device) for i, reason in faults.items() if reason}
        if not refused:
            raise
        begun = [i for i in range(len(cases)) if i not in refused]
        batch = Batch([cases[i] for i in begun], device, checkpoints, onlooker) if begun else None
        return batch, begun, refused


def _fault(case: Case, device: str) -> str:
    """Reason that a case has no world; empty where it has one."""
    try:
        for setup in case.scene.prepare([case], device):
            neighbour_room(setup)
    except (ValueError, MemoryError) as error:
        return str(error) or "there is not enough memory for it"
    return ""


def _refusal(case: Case, reason: str, device: str) -> CaseResult:
    """Result of a case that cannot be begun: no grains."""
    return CaseResult(
        status="failed",
        reason=reason,
        positions=np.zeros((0, 3)),
        orientations=np.zeros((0, 4)),
        sizes=np.zeros(0),
        shapes=np.zeros(0, dtype=int),
        clumps=stack_spheres(case.grains.mixture.shapes),
        provenance=provenance(wp.get_device(device), case.numerics.precision),
    )


def _verdict(flags: WorldFlag, at: float) -> tuple[str, str] | None:
    for flag, (status, advice) in ADVICE.items():
        if flag in flags:
            return status, advice.format(time=at)
    return None
