"""Processes and threads that measure heaps while others simulate."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from typing import Any

from threadpoolctl import threadpool_limits

from dem_warp.processes import end_with_parent

_CONTEXT = multiprocessing.get_context("spawn")
"""Start of processes: a process with a GPU must not be forked."""


def measuring_processes(count: int, measure: Callable[..., object], cases: int) -> ProcessPoolExecutor:
    """Start processes that end with this one, one thread each: there is one for every core.

    Measuring holds Python's lock, so that threads would wait for one another.

    Those for `cases` start at once, and load what `measure` needs while the cases are simulated.
    """
    pool = ProcessPoolExecutor(count, _CONTEXT, _begin, (measure,))
    for _ in range(min(count, cases)):
        pool.submit(_nothing)
    return pool


def _begin(measure: Callable[..., object]) -> None:
    """Limit the threads of all that was loaded with `measure`; what is loaded later is not limited."""
    end_with_parent()
    threadpool_limits(1, "blas")


def _nothing() -> None:
    """Start the process that runs this."""


class MeasuringThreads(ThreadPoolExecutor):
    """Threads that measure with one BLAS thread: more of them wait, spinning, on cores that simulate."""

    def __init__(self, count: int) -> None:
        super().__init__(count)
        self._limits = threadpool_limits(1, "blas")

    def shutdown(self, *arguments: Any, **options: Any) -> None:
        """End the threads, and give BLAS its own back."""
        super().shutdown(*arguments, **options)
        self._limits.restore_original_limits()
