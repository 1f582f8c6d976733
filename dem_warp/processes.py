"""Cases spread over processes on a CPU: one world a task, as Warp's CPU kernels use one thread."""

import multiprocessing
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dem_warp.batch import CaseResult, OnProgress, OnResult
    from dem_warp.case import Case

REPORT_EVERY = 0.5
PHASES = ("waiting", "fill", "settle", "lift", "rest")

_shared: dict[str, Any] = {}


def _start_worker(fractions: Any, phases: Any) -> None:
    _shared.update(fractions=fractions, phases=phases)


def _run_case(index: int, case: "Case") -> "CaseResult":
    from dem_warp.batch import simulate

    def report(progress: Any) -> None:
        _shared["fractions"][index] = progress.fraction
        for phase in progress.phase_counts:
            _shared["phases"][index] = PHASES.index(phase)

    return simulate([case], device="cpu", workers=1, on_progress=report)[0]


def run_in_processes(
    cases: Sequence["Case"], workers: int, on_result: "OnResult", on_progress: "OnProgress"
) -> list["CaseResult"]:
    """Results of the cases in their order, `workers` at a time; each is handed on as soon as it is there."""
    context = multiprocessing.get_context("spawn")
    fractions = context.Array("d", len(cases))
    phases = context.Array("i", len(cases))
    results: dict[int, CaseResult] = {}
    started = time.perf_counter()
    with ProcessPoolExecutor(workers, context, _start_worker, (fractions, phases)) as pool:
        futures: dict[Future[CaseResult], int] = {
            pool.submit(_run_case, i, case): i for i, case in enumerate(cases)
        }
        pending = set(futures)
        try:
            while pending:
                finished, pending = wait(pending, REPORT_EVERY, FIRST_COMPLETED)
                for future in finished:
                    index = futures[future]
                    results[index] = future.result()
                    on_result(index, results[index])
                on_progress(_progress(fractions, phases, results, len(cases), time.perf_counter() - started))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in multiprocessing.active_children():
                process.terminate()
            raise
    return [results[i] for i in range(len(cases))]


def _progress(fractions: Any, phases: Any, results: dict[int, Any], total: int, seconds: float) -> Any:
    from dem_warp.batch import Progress

    running = [i for i in range(total) if i not in results]
    counts = Counter(PHASES[phases[i]] for i in running)
    return Progress(
        done=len(results),
        total=total,
        fraction=(len(results) + sum(fractions[i] for i in running)) / total,
        phase_counts=dict(counts),
        seconds=seconds,
    )
