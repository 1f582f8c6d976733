"""Processes that measure heaps while others simulate, since measuring holds Python's lock."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor

from dem_warp.processes import end_with_parent

_CONTEXT = multiprocessing.get_context("spawn")
"""Start of processes: a process with a GPU must not be forked."""


def measuring_processes(count: int, measure: Callable[..., object], cases: int) -> ProcessPoolExecutor:
    """Start processes that end with this one, one thread each: there is one for every core.

    Those for `cases` start at once, and load what `measure` needs while the cases are simulated.
    """
    pool = ProcessPoolExecutor(count, _CONTEXT, _begin, (measure,))
    for _ in range(min(count, cases)):
        pool.submit(_nothing)
    return pool


def _begin(measure: Callable[..., object]) -> None:
    """Limit the threads of all that was loaded with `measure`; what is loaded later is not limited."""
    from threadpoolctl import threadpool_limits

    end_with_parent()
    threadpool_limits(1, "blas")


def _nothing() -> None:
    """Start the process that runs this."""
