"""Workers of this machine: a world a core on a CPU, batches on one GPU."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import warp as wp

from dem_warp import Case, CaseResult, Processes, simulate
from dem_warp.batch import OnAdvance
from dem_warp.checkpoint import CHECKPOINT_EVERY
from dem_warp.cores import cores
from dem_warp.device import resolve_device
from dem_warp.result import OnProgress, OnResult
from experiments.cases.engines.engine import Engine
from experiments.cases.forecast.speed import expected_seconds, note_batch
from experiments.cases.workers.batches import plan_batches
from experiments.cases.workers.call_results import CallResults
from experiments.cases.workers.division import run_divided
from experiments.cases.workers.resources import cpu_name
from experiments.cases.workers.workers import Workers

CHEAP_WORLDS = 30
"""Worlds of 2,500 clumps whose checkpoints take 2 % of a minute where the disk is slow
(`experiments/evidence/performance/README.md`, cost of checkpoints)."""


@dataclass(frozen=True)
class OwnWorkers:
    """Processes on the CPU, or this process on a GPU; they need no configuration."""

    device: str | None = None
    """``"cpu"``, ``"cuda"`` or ``"cuda:1"``; None: the GPU if there is one."""
    workers: int | None = None
    """Processes on the CPU; None: one a core."""
    on_advance: OnAdvance | None = None
    """Callback after each advance of a batch of dem-warp's own engine."""
    processes: Processes | None = None
    """Processes that stay from call to call; None: each call starts its own."""
    notes_speed: bool = True
    """Note the speed of finished batches: not those of a worker that shares its machine with others."""

    @cached_property
    def name(self) -> str:
        """Name of the device."""
        return resolve_device(self.device)

    @property
    def on_gpu(self) -> bool:
        """True if the device is a GPU."""
        return self.name != "cpu"

    @property
    def count(self) -> int:
        """Cases at once on a CPU, 1 on a GPU."""
        return 1 if self.on_gpu else self.workers or cores()

    @property
    def sharing(self) -> int:
        """1: this process has the GPU."""
        return 1

    @property
    def machine(self) -> str:
        """Name of the GPU, or of this machine and its number of processes."""
        return str(wp.get_device(self.name).name) if self.on_gpu else cpu_name(self.count)

    @property
    def helpers(self) -> int:
        """Processes that may measure at the same time."""
        return self.workers or cores()

    @property
    def leaves_cores(self) -> bool:
        """True if the cores of this machine are free for measuring."""
        return self.on_gpu

    @property
    def described(self) -> dict[str, Any]:
        """Device and number of processes."""
        return {"device": self.name, "workers": self.workers}

    def simulate(
        self,
        cases: Sequence[Case],
        engine: Engine | None = None,
        on_result: OnResult | None = None,
        on_progress: OnProgress | None = None,
        checkpoint: str | Path | None = None,
    ) -> list[CaseResult]:
        """Simulate cases, as `Workers.simulate` does.

        On a CPU all are one batch, whose processes take the costly cases first.
        """
        expected = None if engine else expected_seconds(cases, self)
        results = CallResults(cases, on_result, on_progress, expected, self.count, engine)

        def run(batch: int, members: list[int]) -> None:
            every = checkpoint_interval(len(members) if self.on_gpu else 1)
            own = partial(simulate, on_advance=self.on_advance, checkpoint_every=every)
            processes = self.processes or self.workers
            simulator = partial(engine, workers=self.workers) if engine else partial(own, workers=processes)
            answers = simulator(
                [cases[index] for index in members],
                device=self.name,
                on_result=lambda number, result: results.take(members[number], result),
                on_progress=partial(results.follow, batch, members),
                checkpoint=checkpoint,
            )
            if engine:  # one that does not call on_result
                results.take_all(members, answers)

        for number, batch in enumerate(self._batches(cases, results, engine)):
            run_divided(results, batch, partial(run, number))
            results.end(number)
        if engine is None and self.notes_speed:
            note_batch(cases, self, *results.pace)
        return results.in_order()

    def _batches(self, cases: Sequence[Case], results: CallResults, engine: Engine | None) -> list[list[int]]:
        if not cases:
            return []
        if self.on_gpu and engine is None:
            return plan_batches(cases, results.costs, memory=wp.get_device(self.name).free_memory)
        return [[index for batch in plan_batches(cases, results.costs) for index in batch]]


def checkpoint_interval(worlds: int) -> float:
    """Return the wall time between two checkpoints of a launch, which pauses while they are written [s]."""
    return CHECKPOINT_EVERY * max(1.0, worlds / CHEAP_WORLDS)


def watched_by(workers: Workers, on_advance: OnAdvance) -> Workers:
    """Return workers whose batches call a function as they advance, if they are this machine's own."""
    return replace(workers, on_advance=on_advance) if isinstance(workers, OwnWorkers) else workers


THIS_MACHINE = OwnWorkers()
"""Workers when none are named."""
