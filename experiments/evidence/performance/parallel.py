"""Several processes at once on the CPU, each with a settled column of its own."""

import multiprocessing
from pathlib import Path
from typing import Any

import pandas as pd

from dem_warp.device import resolve_device
from experiments.evidence.performance.columns import Columns
from experiments.evidence.performance.result_pages import Part
from experiments.evidence.performance.timing import run_in, start, time_steps

PATIENCE = 600.0
"""Longest time that a process may take to get ready, or to finish [s]."""


def processes_table(columns: Columns, folder: Path, count: int, steps: int) -> Part:
    """Time settled columns, read from a folder, in one process, in `count` at once, and in one again."""
    counts = (1, count, 1)
    speeds = [sum(_together(columns, folder, n, steps)) / 1e6 for n in counts]
    alone = (speeds[0] + speeds[-1]) / 2
    table = pd.DataFrame(
        {"processes": counts, "million sphere-steps/s": speeds, "of one": [speed / alone for speed in speeds]}
    )
    text = "Processes at once on the CPU, each with a settled column; one before, one after."
    return "processes", text, table


def _together(columns: Columns, folder: Path, count: int, steps: int) -> list[float]:
    """Sphere-steps a second of each of `count` processes that are timed at the same time."""
    context = multiprocessing.get_context("spawn")
    barrier, results = context.Barrier(count), context.Queue()
    arguments = (columns.scale, len(columns.cases), folder, steps, barrier, results)
    workers = [context.Process(target=_work, args=arguments, daemon=True) for _ in range(count)]
    for worker in workers:
        worker.start()
    speeds = [results.get(timeout=2 * PATIENCE) for _ in workers]
    for worker in workers:
        worker.join()
    return speeds


def _work(scale: str, seeds: int, folder: Path, steps: int, barrier: Any, results: Any) -> None:
    device = resolve_device("cpu")
    solver = start(Columns(scale, seeds, device, folder).moments("settled", 1), device)
    run_in(solver)
    barrier.wait(PATIENCE)
    results.put(time_steps(solver, steps).sphere_steps)
