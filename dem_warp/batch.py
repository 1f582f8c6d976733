"""Worlds that run in one launch, each under the controller of its scene."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from dem_warp.case import Case
from dem_warp.clumps import stack_spheres
from dem_warp.result import CaseResult
from dem_warp.scenes.scene import Decision
from dem_warp.solver import CHUNK, Solver
from dem_warp.types import WorldFlag

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


class Batch:
    """Cases of one kind of scene, precision and largest number of spheres, as worlds of one launch."""

    def __init__(self, cases: Sequence[Case], device: str) -> None:
        self.cases = list(cases)
        self.setups = cases[0].scene.prepare(cases, device)
        self.solver = Solver(self.setups, device, cases[0].numerics.precision)
        self.controllers = [
            case.scene.controller(case, setup, CHUNK) for case, setup in zip(cases, self.setups, strict=True)
        ]
        self.running = list(range(len(cases)))
        self.chunk = 0

    def advance(self) -> list[tuple[int, CaseResult]]:
        """Step until the next controller is due, let it decide, and return the worlds that ended."""
        apart = min(self.controllers[w].period for w in self.running) // CHUNK
        ahead = apart - self.chunk % apart
        self.solver.advance(ahead)
        self.chunk += ahead
        return self._look([w for w in self.running if self.chunk * CHUNK % self.controllers[w].period == 0])

    def fraction(self, world: int) -> float:
        """Roughly how much of a world is done, 0 to 1."""
        if world not in self.running:
            return 1.0
        return self.controllers[world].fraction(self.chunk * CHUNK * self.setups[world].time_step)

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
        poses, controller, setup = self.solver.poses(w), self.controllers[w], self.setups[w]
        late = WorldFlag.LATE_REBUILD in WorldFlag(int(self.solver.flags.numpy()[w]))
        counts = {"rebuilds": float(self.solver.rebuilds.numpy()[w]), "late_rebuilds": float(late)}
        return CaseResult(
            status=status,
            reason=reason,
            positions=poses["positions"],
            orientations=poses["orientations"],
            sizes=setup.grains.sizes[poses["slots"]],
            shapes=setup.grains.shapes[poses["slots"]],
            clumps=stack_spheres(setup.shapes),
            observables=controller.observables | counts,
            phases=controller.phases,
            provenance=self._provenance(),
        )

    def _provenance(self) -> dict[str, Any]:
        device = self.solver.device
        return {
            "warp": wp.__version__,
            "numpy": np.__version__,
            "device": device.name if device.is_cuda else "CPU",
            "precision": self.solver.precision.name,
        }


def _verdict(flags: WorldFlag, at: float) -> tuple[str, str] | None:
    for flag, (status, advice) in ADVICE.items():
        if flag in flags:
            return status, advice.format(time=at)
    return None
