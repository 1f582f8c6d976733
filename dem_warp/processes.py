"""Cases spread over processes on a CPU: one world a task, as Warp's CPU kernels use one thread."""

import multiprocessing
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from typing import Any

from dem_warp.batch import Onlooker, begin
from dem_warp.case import Case
from dem_warp.checkpoint import Checkpoints
from dem_warp.device import resolve_device
from dem_warp.result import CaseResult, OnResult

REPORT_EVERY = 0.5
"""Time between two reports of progress [s]."""

PHASE_LENGTH = 16
"""Characters of a phase's name that travel between processes."""

Report = Callable[[Sequence[float], Sequence[str]], None]
"""Takes the fraction done and the phase of every case."""

_shared: dict[str, Any] = {}


def _start_worker(fractions: Any, phases: Any) -> None:
    _shared.update(fractions=fractions, phases=phases)
    end_with_parent()


def end_with_parent() -> None:
    """Let this process end when its parent is gone: a parent that was killed cannot tell its workers."""
    threading.Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    if parent := multiprocessing.parent_process():
        parent.join()
        os._exit(1)


def _run_case(
    index: int, case: Case, checkpoints: Checkpoints | None, onlooker: Onlooker | None
) -> CaseResult:
    """Run one case in a worker, leaving its progress in the shared memory."""
    batch, _, refused = begin([case], resolve_device("cpu"), checkpoints, onlooker)
    if batch is None:
        return refused[0]
    while True:
        ended = batch.advance()
        if ended:
            return ended[0][1]
        _shared["fractions"][index] = batch.fraction(0)
        name = batch.phase(0).encode()[:PHASE_LENGTH].ljust(PHASE_LENGTH)
        _shared["phases"][index * PHASE_LENGTH : (index + 1) * PHASE_LENGTH] = name


def run_in_processes(
    cases: Sequence[Case],
    workers: int,
    on_result: OnResult,
    report: Report,
    checkpoints: Checkpoints | None = None,
    onlooker: Onlooker | None = None,
) -> None:
    """Run cases, `workers` at a time.

    Parameters
    ----------
    cases : sequence of Case
    workers : int
    on_result : callable
        Called with index and result of each case as it ends.
    report : callable
        Called now and then with the fraction done and the phase of every case.
    checkpoints : Checkpoints, optional
        Where the processes save their cases and take them up.
    onlooker : Onlooker, optional
        Sees the batch of each case, in its process.
    """
    context = multiprocessing.get_context("spawn")
    fractions = context.Array("d", len(cases))
    phases = context.Array("c", b"waiting".ljust(PHASE_LENGTH) * len(cases))
    with ProcessPoolExecutor(workers, context, _start_worker, (fractions, phases)) as pool:
        futures: dict[Future[CaseResult], int] = {
            pool.submit(_run_case, i, case, checkpoints, onlooker): i for i, case in enumerate(cases)
        }
        pending = set(futures)
        try:
            while pending:
                finished, pending = wait(pending, REPORT_EVERY, FIRST_COMPLETED)
                for future in finished:
                    fractions[futures[future]] = 1.0
                    on_result(futures[future], future.result())
                report(fractions[:], _names(bytes(phases[:])))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in multiprocessing.active_children():
                process.terminate()
            raise


def _names(phases: bytes) -> list[str]:
    starts = range(0, len(phases), PHASE_LENGTH)
    return [phases[i : i + PHASE_LENGTH].rstrip(b" \0").decode() for i in starts]
