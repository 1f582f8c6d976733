"""Simulation of many cases: on a GPU all worlds in one batch, on a CPU one world per process."""

import time
from collections import Counter
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from dem_warp.batch import OnAdvance, begin
from dem_warp.case import Case
from dem_warp.checkpoint import CHECKPOINT_EVERY, Checkpoints
from dem_warp.cores import cores
from dem_warp.device import resolve_device
from dem_warp.processes import REPORT_EVERY, Processes, Report
from dem_warp.result import CaseResult, OnProgress, OnResult, Progress


def _short(result: CaseResult) -> str:
    """Write a result as one line; not in its class, whose file is in the engine's fingerprint."""
    seen = "".join(f", {name} {value:.4g}" for name, value in result.observables.items())
    return f"CaseResult({result.reason or result.status}, {len(result.positions)} grains{seen})"


CaseResult.__repr__ = _short  # type: ignore[method-assign, assignment]


def simulate(
    cases: Sequence[Case],
    device: str | None = None,
    workers: int | Processes | None = None,
    on_result: OnResult | None = None,
    on_progress: OnProgress | None = None,
    checkpoint: str | Path | None = None,
    checkpoint_every: float = CHECKPOINT_EVERY,
    on_advance: OnAdvance | None = None,
) -> list[CaseResult]:
    """Simulate cases at once, and return their results in order.

    Parameters
    ----------
    cases : sequence of Case
    device : str, optional
        "cpu", "cuda" or "cuda:N". Default: the GPU if there is one.
    workers : int or Processes, optional
        Processes on a CPU, where Warp's kernels use one thread. Default: one per core. A number of processes
        start for this call; `Processes` stay for the next one.
    on_result, on_progress : callable, optional
        Called with index and result of each ended case, and regularly with a `Progress`.
    checkpoint : str or Path, optional
        Folder for checkpoints. Cases that a killed run left there continue, to the same bits; the file of an
        ended case is removed.
    checkpoint_every : float
        Wall time between two checkpoints [s].
    on_advance : callable, optional
        Called with each running `Batch` after every advance, in its process; it must not change the batch.

    Raises
    ------
    ValueError
        If there is no such device, or `checkpoint_every` is negative. A failed case has its status; it
        neither raises nor changes another case.
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
            processes.run(cases, keep, report, checkpoints, on_advance)
        else:
            _run_batches(cases, name, keep, report, checkpoints, on_advance)
    return [results[i] for i in range(len(cases))]


def _processes(workers: int | Processes | None, cases: int) -> AbstractContextManager[Processes]:
    """Return processes for one call, or those of the caller, who ends them."""
    if isinstance(workers, Processes):
        return nullcontext(workers)
    return Processes(min(workers or cores(), cases))


def _run_batches(
    cases: Sequence[Case],
    device: str,
    keep: OnResult,
    report: Report,
    checkpoints: Checkpoints | None,
    on_advance: OnAdvance | None,
) -> None:
    """Run batch after batch in this process."""
    fractions, phases = [0.0] * len(cases), ["waiting"] * len(cases)
    reported = time.perf_counter()
    for members in batches(cases, one_each=device == "cpu"):
        batch, begun, refused = begin([cases[i] for i in members], device, checkpoints, on_advance)
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
    """Return the indices of the cases in each launch.

    They have the same compiled kernels, so that a case runs the same code in any batch. On a CPU each case
    runs alone, which keeps its world in the cache.
    """
    if one_each:
        return [[i] for i in range(len(cases))]
    groups: dict[Any, list[int]] = {}
    for i, case in enumerate(cases):
        mechanisms = frozenset(mechanism.name for mechanism in case.mechanisms)
        kind, forms = type(case.scene), case.laws.forms
        spheres = case.grains.sphere_count * getattr(case.scene, "sledge", 1)
        parts = len(case.wall_parts), len(getattr(case.scene, "wall_names", ()))
        build = (kind, case.numerics.precision, spheres, mechanisms, forms, parts)
        groups.setdefault(build, []).append(i)
    return list(groups.values())
