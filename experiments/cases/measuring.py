"""Processes that measure heaps while others simulate: measuring holds Python's lock."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor

from dem_warp.processes import end_with_parent

_CONTEXT = multiprocessing.get_context("spawn")
"""Start of processes: a process with a GPU must not be forked."""


def measuring_processes(count: int) -> ProcessPoolExecutor:
    """Start processes with this one's end as theirs, one thread each: there is one for every core."""
    return ProcessPoolExecutor(count, _CONTEXT, _begin)


def _begin() -> None:
    from threadpoolctl import threadpool_limits

    end_with_parent()
    threadpool_limits(1, "blas")
