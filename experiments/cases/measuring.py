"""Processes that measure heaps while others simulate: measuring holds Python's lock."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor

from dem_warp.processes import end_with_parent

_CONTEXT = multiprocessing.get_context("spawn")
"""Start of processes: a process with a GPU must not be forked."""


def measuring_processes(count: int, measure: Callable[..., object], cases: int) -> ProcessPoolExecutor:
    """Start processes with this one's end as theirs, one thread each: there is one for every core.

    Those for so many cases start at once, and load what ``measure`` needs while the cases are simulated.
    """
    pool = ProcessPoolExecutor(count, _CONTEXT, _begin, (measure,))
    for _ in range(min(count, cases)):
        pool.submit(_nothing)
    return pool


def _begin(measure: Callable[..., object]) -> None:
    """Limit the threads of all that has come with `measure`; what is loaded later is not limited."""
    from threadpoolctl import threadpool_limits

    end_with_parent()
    threadpool_limits(1, "blas")


def _nothing() -> None:
    """Do nothing, in a process that has begun."""
