"""Times that a dry run tells against those that waves then take, on studies and tests of every kind.

    python -m experiments.evidence.robustness.cluster.prediction
    python -m experiments.evidence.robustness.cluster.prediction --gpu --each 32 --table prediction

The machine is measured first, by the waves of `dem-warp doctor --measure`; then each wave runs. A prediction
is good where the ratio lies between 1 / 1.5 and 1.5. On a machine of its own, `--wall` times waves on all
cores. On one that others use, wall time is theirs too: so the default is one worker, this process, and its
time of the processor, in the measurement and in the waves. Neither counts the start of other processes then.
On a GPU the time is that of the wall. The exit code is 1 unless all predictions are good.
"""

from __future__ import annotations

import math
import os
import time
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer

from dem_warp import Case
from dem_warp.batch import Batch
from experiments.cases import OwnWorkers
from experiments.cases.forecast.cost import cost_of
from experiments.cases.workers.speed import Clock, Speed, measure_speed, wave_seconds
from experiments.evidence.machine import machine
from experiments.evidence.performance.results import write_results
from experiments.evidence.robustness.cluster.waves import first, fresh, tried

WITHIN = 1.5
"""Factor within which a prediction is good."""

SETS = {
    "prediction": ("The studies that stood first", first),
    "prediction-tried": ("Studies that were looked at meanwhile", tried),
    "prediction-fresh": ("Studies that were run only afterwards", fresh),
}
"""Waves by the name of their table: what they are, and the function that makes them."""


def main(
    each: Annotated[int, typer.Option(min=1, help="Cases of the larger studies.")] = 1,
    wall: Annotated[
        bool, typer.Option("--wall", help="Wall time on all cores, the machine being free.")
    ] = False,
    gpu: Annotated[bool, typer.Option("--gpu", help="Wall time on a GPU.")] = False,
    table: Annotated[list[str] | None, typer.Option(help="Table to make; left out: all.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the tables.")] = Path("out/prediction"),
) -> None:
    """Measure the machine, predict, run and compare."""
    if strange := set(table or ()) - set(SETS):
        raise typer.BadParameter(f"must be of {', '.join(SETS)}, not {', '.join(sorted(strange))}")
    workers = OwnWorkers("cuda" if gpu else "cpu", None if wall or gpu else 1)
    clock = time.perf_counter if wall or gpu else time.process_time
    speed = measure_speed(workers, clock)
    print(speed.text, flush=True)
    parts, good, waves = [], 0, 0
    for name in table or SETS:
        what, made = SETS[name]
        rows = pd.DataFrame([_row(*wave, workers, speed, clock) for wave in made(each).items()])
        within = int(rows["told / taken"].between(1.0 / WITHIN, WITHIN).sum())
        parts.append((name, f"{what}: {within} of {len(rows)} within a factor of {WITHIN}.", rows))
        good, waves = good + within, waves + len(rows)
    count = f"{workers.count} {'worker' if workers.count == 1 else 'workers'}"
    of = "wall time" if wall or gpu else "time of the processor"
    text = f"{machine(workers.name)}, {count}, {of}. Measured: {speed.text}.\n\n"
    parts[0] = (parts[0][0], text + parts[0][1], parts[0][2])
    print(write_results(out, "prediction", parts).read_text(encoding="utf-8"))
    raise typer.Exit(int(good < waves))


def _row(name: str, cases: list[Case], workers: OwnWorkers, speed: Speed, clock: Clock) -> dict[str, Any]:
    """Time told of a wave beside the time that it takes."""
    costs = [cost_of(case) for case in cases]
    Batch(cases[:1], workers.name).advance()  # compiles
    started = clock()
    results = workers.simulate(cases)
    took = clock() - started
    # a failed case does not tell the steps of its last phase
    ends = [result.phases for result in results if result.status == "finished"]
    steps = sum(phase["steps"] for phases in ends for phase in phases) / len(ends) if ends else math.nan
    told = wave_seconds(costs, speed, workers.count, workers.on_gpu, workers.sharing)
    row = {
        "study": name,
        "cases": len(cases),
        "spheres": costs[0].spheres,
        "steps told / taken": costs[0].steps / steps,
        "told s": told,
        "taken s": took,
        "told / taken": told / took,
        "ended": ", ".join(sorted({result.status for result in results})),
        "load": os.getloadavg()[0],
    }
    print(row, flush=True)
    return row


if __name__ == "__main__":
    typer.run(main)
