"""Worlds that run in one launch, each with the controller of its scene."""

import logging
import time
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import warp as wp

from dem_warp.case import Case
from dem_warp.checkpoint import Checkpoints, case_name
from dem_warp.clumps import stack_spheres
from dem_warp.provenance import engine_fingerprint, provenance
from dem_warp.result import CaseResult
from dem_warp.rollback import Rollback
from dem_warp.room import neighbour_room
from dem_warp.scenes.scene import restore_state
from dem_warp.snapshot import STEP, put_snapshot, take_snapshot
from dem_warp.solver import CHUNK, Solver
from dem_warp.types import CheckRate, WorldFlag

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
        "a grain or a wall was too fast for the neighbour lists at {time:.4f} s: "
        "raise numerics.skin, or lower time_step_fraction",
    ),
}


OnAdvance = Callable[["Batch"], None]
"""Callback with a running batch, which it must not change; processes on a CPU get a pickled copy."""


class Batch:
    """Cases of one kind of scene, precision and largest number of spheres, as worlds of one launch.

    They are saved to `checkpoints` and continue from there; `on_advance` is called after every `advance`.
    """

    def __init__(
        self,
        cases: Sequence[Case],
        device: str,
        checkpoints: Checkpoints | None = None,
        on_advance: OnAdvance | None = None,
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
        self._on_advance = on_advance
        self._resume()

    def advance(self) -> list[tuple[int, CaseResult]]:
        """Step until the next controller is due, let it decide, and return the results of ended worlds."""
        ahead = min(
            self.controllers[w].period - self.steps[w] % self.controllers[w].period for w in self.running
        )
        self._rollback.keep()
        self.solver.advance(ahead // CHUNK)
        due = self._restore_late(ahead)
        ended = self._look(due)
        if self._checkpoints and time.monotonic() - self._saved >= self._checkpoints.every:
            self.save()
        if self._on_advance:
            self._on_advance(self)
        return ended

    def _restore_late(self, ahead: int) -> list[int]:
        """Count the steps taken, and return the worlds that are due for a look.

        A world that was too fast for its lists goes back, to repeat the steps with more frequent checks. One
        that was too fast even with a check in every step is due at once, and fails.
        """
        flags = self.solver.flags.numpy()
        late = {w for w in self.running if WorldFlag.LATE_REBUILD in WorldFlag(int(flags[w]))}
        again = set() if self.solver.check_rate == CheckRate.EVERY_STEP else late
        for w in again:
            self._rollback.restore(w)
        self.solver.check_rate = CheckRate(self.solver.check_rate + 1) if again else CheckRate.USUAL
        for w in set(self.running) - again:
            self.steps[w] += ahead
        return [
            w for w in self.running
            if w not in again and (w in late or self.steps[w] % self.controllers[w].period == 0)
        ]  # fmt: skip

    def fraction(self, world: int) -> float:
        """Return roughly the fraction done of a world, 0 to 1."""
        if world not in self.running:
            return 1.0
        return self.controllers[world].fraction(self.steps[world] * self.setups[world].time_step)

    def phase(self, world: int) -> str:
        return self.controllers[world].state.phase

    def case_name(self, world: int) -> str:
        """Return the name of a world's case and of its checkpoint."""
        return case_name(self.cases[world])

    @cached_property
    def maker(self) -> dict[str, Any]:
        """Libraries, device and engine, which must be the same where a checkpoint continues."""
        engine = engine_fingerprint(*(kind for case in self.cases for kind in case.kinds))
        same = {name: value for name, value in self.provenance.items() if name not in ("dem-warp", "commit")}
        return same | {"engine": engine}

    def _resume(self) -> None:
        """Continue every case that has a checkpoint."""
        if self._checkpoints is None:
            return
        for w, (case, controller) in enumerate(zip(self.cases, self.controllers, strict=True)):
            try:
                if kept := self._checkpoints.load(case, self.maker):
                    fresh, snapshot = controller.state, kept[1]
                    controller.state = restore_state(type(fresh), kept[0])
                    try:
                        controller.fraction(0.0)  # raises on an unknown phase
                        put_snapshot(self.solver, w, snapshot)
                    except (LookupError, TypeError, ValueError):
                        controller.state = fresh
                        raise
                    self.steps[w] = int(snapshot[STEP].item())
            except (LookupError, TypeError, ValueError) as error:
                path = self._checkpoints.path(case)
                _log.warning("%s: cannot use the checkpoint, its case starts again: %s", path, error)

    def save(self) -> None:
        """Write a checkpoint of every running case."""
        if self._checkpoints is None:
            return
        for w in self.running:
            snapshot = take_snapshot(self.solver, w)
            self._checkpoints.save(self.cases[w], self.maker, self.controllers[w].state, snapshot)
        self._saved = time.monotonic()

    def _look(self, due: Sequence[int]) -> list[tuple[int, CaseResult]]:
        """Let the controllers of the due worlds decide, and return the results of those that ended."""
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
                    verdict = ("diverged", "the position of a grain is not finite")
            self.solver.stop(w)
            self.running.remove(w)
            ended.append((w, self.result(w, *verdict)))
        self.solver.move_walls(moves)
        return ended

    def result(self, w: int, status: str = "running", reason: str = "") -> CaseResult:
        """Return the result of a world in its present state."""
        poses, state, setup = self.solver.poses(w), self.controllers[w].state, self.setups[w]
        counts = {"rebuilds": float(self.solver.rebuilds.numpy()[w])}
        return CaseResult(
            status=status,
            reason=reason,
            positions=poses["positions"],
            orientations=poses["orientations"],
            sizes=setup.grains.sizes[poses["slots"]],
            shapes=setup.grains.shapes[poses["slots"]],
            clumps=stack_spheres(setup.shapes),
            observables=state.observables | counts,
            phases=state.phases,
            provenance=self.provenance | {"laws": self.cases[w].laws.to_dict()},
        )


def begin(
    cases: Sequence[Case],
    device: str,
    checkpoints: Checkpoints | None = None,
    on_advance: OnAdvance | None = None,
) -> tuple[Batch | None, list[int], dict[int, CaseResult]]:
    """Begin a batch of the valid cases, and fail the others.

    Return the batch (None without a valid case), the index of the case of each world, and the results of the
    other cases by index, each with its reason.
    """
    try:
        return Batch(cases, device, checkpoints, on_advance), list(range(len(cases))), {}
    except (ValueError, MemoryError):
        faults = {i: _fault(case, device) for i, case in enumerate(cases)}
        refused = {i: _refusal(cases[i], reason, device) for i, reason in faults.items() if reason}
        if not refused:
            raise
        begun = [i for i in range(len(cases)) if i not in refused]
        batch = Batch([cases[i] for i in begun], device, checkpoints, on_advance) if begun else None
        return batch, begun, refused


def _fault(case: Case, device: str) -> str:
    """Return the reason why a case cannot begin; empty if it can."""
    try:
        for setup in case.scene.prepare([case], device):
            neighbour_room(setup)
    except (ValueError, MemoryError) as error:
        return str(error) or "out of memory"
    return ""


def _refusal(case: Case, reason: str, device: str) -> CaseResult:
    """Return the result of a case that cannot begin: no grains."""
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
