"""Many cases at once: on a GPU all worlds in one batch, on a CPU a world a process, spread over the cores."""

import os
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from dem_warp.batch import Onlooker, begin
from dem_warp.case import Case
from dem_warp.checkpoint import CHECKPOINT_EVERY, Checkpoints
from dem_warp.device import resolve_device
from dem_warp.processes import REPORT_EVERY, Processes, Report
from dem_warp.result import CaseResult, OnProgress, OnResult, Progress


def simulate(
    cases: Sequence[Case],
    device: str | None = None,
    workers: int | Processes | None = None,
    on_result: OnResult | None = None,
    on_progress: OnProgress | None = None,
    checkpoint: str | Path | None = None,
    checkpoint_every: float = CHECKPOINT_EVERY,
    onlooker: Onlooker | None = None,
) -> list[CaseResult]:
    """Simulate cases at once.

    Parameters
    ----------
    cases : sequence of Case
    device : str, optional
        "cpu", "cuda" or "cuda:N"; by default the GPU if there is one.
    workers : int or Processes, optional
        Processes on a CPU; by default one a core. Warp's CPU kernels run on one thread. A number of them
        start for this call; `Processes` stay for the next one.
    on_result : callable, optional
        Called with the index and the result of each case as it ends.
    on_progress : callable, optional
        Called with a `Progress` now and then.
    checkpoint : str or Path, optional
        Folder for checkpoints of the running cases. Cases that a killed run left there go on from where they
        were, to the same bits; the file of a case is removed when it has ended.
    checkpoint_every : float
        Wall time between two checkpoints [s].
    onlooker : callable, optional
        Called with each running `Batch` after every stretch of its steps, in the process that runs it; it may
        copy from the batch and changes nothing of it.

    Returns
    -------
    list of CaseResult
        In the order of the cases. A case that goes wrong has its status; it neither raises nor changes
        another case.

    Raises
    ------
    ValueError
        If the device is not there, or `checkpoint_every` is negative.
    """
    name = resolve_device(device)
    checkpoints = None if checkpoint is None else Checkpoints(checkpoint, checkpoint_every)
    results: dict[int, CaseResult] = {}
    started = time.perf_counter()

    def keep(index: int, result: CaseResult) -> None:
        results[index] = result
        if on_result:
            on_result(index, result)
        if checkpoints:
            checkpoints.drop(cases[index])

    def report(fractions: Sequence[float], phases: Sequence[str]) -> None:
        if on_progress:
            running = Counter(phase for i, phase in enumerate(phases) if i not in results)
            seconds = time.perf_counter() - started
            share = sum(fractions) / len(fractions)
            on_progress(Progress(len(results), len(cases), share, dict(running), seconds))

    with _processes(workers, len(cases)) as processes:
        if name == "cpu" and min(processes.count, len(cases)) > 1:
            processes.run(cases, keep, report, checkpoints, onlooker)
        else:
            _run_batches(cases, name, keep, report, checkpoints, onlooker)
    return [results[i] for i in range(len(cases))]


def _processes(workers: int | Processes | None, cases: int) -> AbstractContextManager[Processes]:
    """Processes for one call, or those of a caller, who ends them."""
    if isinstance(workers, Processes):
        return nullcontext(workers)
    return Processes(min(workers or os.cpu_count() or 1, cases))


def _run_batches(
    cases: Sequence[Case],
    device: str,
    keep: OnResult,
    report: Report,
    checkpoints: Checkpoints | None,
    onlooker: Onlooker | None,
) -> None:
    """Run batch after batch in this process."""
    fractions, phases = [0.0] * len(cases), ["waiting"] * len(cases)
    reported = time.perf_counter()
    for members in batches(cases, one_each=device == "cpu"):
        batch, begun, refused = begin([cases[i] for i in members], device, checkpoints, onlooker)
        for number, result in refused.items():
            fractions[members[number]] = 1.0
            keep(members[number], result)
        worlds = [members[number] for number in begun]
        while batch and batch.running:
            for w, result in batch.advance():
                keep(worlds[w], result)
            if not batch.running or time.perf_counter() - reported > REPORT_EVERY:
                reported = time.perf_counter()
                for w, i in enumerate(worlds):
                    fractions[i], phases[i] = batch.fraction(w), batch.phase(w)
                report(fractions, phases)


def batches(cases: Sequence[Case], one_each: bool) -> list[list[int]]:
    """Indices of the cases that run in one launch.

    These share all that kernels are compiled for, so that a case runs the same code in any company. On a CPU
    each runs alone, which keeps its world in the cache.
    """
    if one_each:
        return [[i] for i in range(len(cases))]
    groups: dict[Any, list[int]] = {}
    for i, case in enumerate(cases):
        mechanisms = frozenset(mechanism.name for mechanism in case.mechanisms)
        kind, forms = type(case.scene), case.laws.forms
        parts = len(case.wall_parts)
        build = (kind, case.numerics.precision, case.grains.sphere_count, mechanisms, forms, parts)
        groups.setdefault(build, []).append(i)
    return list(groups.values())
