"""Times that a dry run tells against those that waves then take, on studies of different size.

    python -m experiments.benchmarks.cluster.prediction

The machine is measured first. Each study's wave then runs on all cores; a prediction is good where the ratio
lies between 1 / 1.5 and 1.5.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from dem_warp import Case
from experiments.benchmarks.results import write_results
from experiments.cases import OwnWorkers
from experiments.cases.cost import cost_of
from experiments.cases.workers.speed import measure_speed, wave_seconds
from experiments.studyfile import load_study

TRIAL = Path(__file__).parents[2] / "studies" / "trial" / "study.toml"


def waves(each: int) -> dict[str, list[Case]]:
    """Cases of three studies: a hundred grains of three spheres, four hundred of nine, and half of these."""
    trial, bench = load_study(TRIAL, "bench"), load_study(None, "bench")
    few = load_study(None, "bench", {"scene": {"lifted-cylinder": {"grain_count": 200}}})
    return {
        "trial, bench": [trial.case({}, seed) for seed in range(4 * each)],
        "buckwheat, bench, 200 grains": [few.case({}, seed) for seed in range(each)],
        "buckwheat, bench": [bench.case({}, seed) for seed in range(each)],
    }


def main(
    each: Annotated[int, typer.Option(help="Cases of the larger studies.")] = 4,
    out: Annotated[Path, typer.Option(help="Folder of the table.")] = Path("out/prediction"),
) -> None:
    """Measure the machine, predict, run and compare."""
    workers = OwnWorkers("cpu")
    speed = measure_speed(workers)
    rows = []
    for name, cases in waves(each).items():
        costs = [cost_of(case) for case in cases]
        workers.simulate(cases[:1])  # compiles what the wave would
        started = time.perf_counter()
        results = workers.simulate(cases)
        took = time.perf_counter() - started
        steps = sum(phase["steps"] for result in results for phase in result.phases) / len(results)
        told = wave_seconds(costs, speed, workers.count, on_gpu=False)
        ratio, load = told / took, os.getloadavg()[0]
        rows.append((name, len(cases), costs[0].spheres, costs[0].steps / steps, told, took, ratio, load))
    columns = ["study", "cases", "spheres", "steps told / taken", "told s", "taken s", "told / taken", "load"]
    found = (
        f"{1e6 * speed.step:.3g} us a step, {1e9 * speed.sphere_step:.3g} ns a sphere, {speed.start:.3g} s"
    )
    text = f"{os.cpu_count()} cores; {found}, {speed.start:.3g} s to start."
    table = pd.DataFrame(rows, columns=columns)
    print(write_results(out, "prediction", [("prediction", text, table)]).read_text(encoding="utf-8"))


if __name__ == "__main__":
    typer.run(main)
