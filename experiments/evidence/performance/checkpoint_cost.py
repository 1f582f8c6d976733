"""Cost of checkpoints: the same case with and without them, in turn, in time of the processor.

    python -m experiments.evidence.performance.checkpoint_cost --pairs 5

A run writes a checkpoint every minute. Here one is written in every second of the processor's time, so that
what it costs stands out, and the cost of one is set against a minute.
"""

from __future__ import annotations

import os
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import typer

from dem_warp import Case
from dem_warp.batch import Batch
from dem_warp.checkpoint import CHECKPOINT_EVERY, Checkpoints
from experiments.cases.forecast.work import work_of
from experiments.evidence.machine import machine
from experiments.evidence.performance.result_pages import write_results
from experiments.studyfile import load_study

EVERY = 1.0
"""Time of the processor between two checkpoints here [s]."""


@dataclass(frozen=True)
class Run:
    """One run of a case."""

    seconds: float
    """Time of the processor, all of it [s]."""
    saved: tuple[tuple[float, float], ...]
    """Of each checkpoint: time of the processor, and wall time with the wait for the disk [s]."""
    size: int
    """Bytes of the last checkpoint."""
    end: bytes
    """Places of the grains at the end."""


def cases() -> dict[str, tuple[Case, float]]:
    """Cases by name, and the time of the processor after which each is stopped [s]; inf: at its own end."""
    bench, soft = load_study(None, "bench"), load_study(None, "soft")
    return {
        "buckwheat, bench": (bench.case({}, 1), float("inf")),
        "buckwheat, soft, its first stretch": (soft.case({}, 1), 10.0),
    }


def run(case: Case, stretches: float, folder: Path | None) -> Run:
    """Run a case to its end, or so many stretches of steps; checkpoints go to a folder, None: nowhere."""
    # the batch saves on order only: the clock here is the processor's
    batch = Batch([case], "cpu", None if folder is None else Checkpoints(folder, float("inf")))
    saved: list[tuple[float, float]] = []
    begun = last = time.process_time()
    count, end = 0, b""
    while count < stretches:
        ended = batch.advance()
        count += 1
        if folder is not None and batch.running and time.process_time() - last >= EVERY:
            last, wall = time.process_time(), time.perf_counter()
            batch.save()
            saved.append((time.process_time() - last, time.perf_counter() - wall))
        if ended:
            end = ended[0][1].positions.tobytes()
            break
    seconds = time.process_time() - begun
    end = end or batch.solver.poses(0)["positions"].tobytes()
    size = max((path.stat().st_size for path in folder.iterdir()), default=0) if folder else 0
    return Run(seconds, tuple(saved), size, end)


def stretches_within(case: Case, seconds: float) -> float:
    """Stretches that a case takes in a time of the processor [s]; inf: all of them."""
    if seconds == float("inf"):
        return seconds
    batch, begun, count = Batch([case], "cpu"), time.process_time(), 0
    while time.process_time() - begun < seconds:
        batch.advance()
        count += 1
    return count


def row(name: str, case: Case, limit: float, pairs: int) -> dict[str, Any]:
    """Row of a case."""
    stretches = stretches_within(case, limit)
    run(case, min(stretches, 3), None)  # compiles
    with_: list[Run] = []
    without: list[Run] = []
    for number in range(pairs):
        with tempfile.TemporaryDirectory() as place:
            for kept in (True, False) if number % 2 else (False, True):
                (with_ if kept else without).append(run(case, stretches, Path(place) if kept else None))
    if len({done.end for done in (*with_, *without)}) > 1:
        raise RuntimeError(f"{name}: checkpoints change the end")
    each = np.array([one for done in with_ for one in done.saved]).reshape(-1, 2)
    seconds = [done.seconds for done in without]
    added = [a.seconds / b.seconds - 1.0 for a, b in zip(with_, without, strict=True)]
    cost = float(np.median(each[:, 0])) if len(each) else 0.0
    return {
        "case": name,
        "grains": work_of(case).grains,
        "pairs": pairs,
        "s without": float(np.median(seconds)),
        "checkpoints in a run": len(each) / pairs,
        "added, one a second, %": 100.0 * float(np.median(added)),
        "least": 100.0 * min(added),
        "most": 100.0 * max(added),
        "ms of one": 1e3 * cost,
        "ms of one, with the disk": 1e3 * float(np.median(each[:, 1])) if len(each) else 0.0,
        "kB": with_[-1].size / 1e3,
        "one a minute, %": 100.0 * cost / CHECKPOINT_EVERY,
    }


def main(
    pairs: Annotated[int, typer.Option(min=1, help="Runs with and without, of each case.")] = 5,
    out: Annotated[Path, typer.Option(help="Folder of the table.")] = Path("out/checkpoints"),
) -> None:
    """Run each case with and without checkpoints, and write the table."""
    rows = [row(name, *found, pairs) for name, found in cases().items()]
    text = (
        f"{machine('cpu')}, load {os.getloadavg()[0]:.1f} at the end. A run "
        f"writes one every {CHECKPOINT_EVERY:.0f} s of wall time (the last column); a shorter case writes "
        f"none. Here one was written in every {EVERY:g} s of the processor's time. Ends are the same in "
        "every bit."
    )
    print(write_results(out, "checkpoints", [("checkpoints", text, pd.DataFrame(rows))]).read_text("utf-8"))


if __name__ == "__main__":
    typer.run(main)
