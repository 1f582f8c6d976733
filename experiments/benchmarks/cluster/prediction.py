"""Times that a dry run tells against those that waves then take, on studies and tests of every kind.

    python -m experiments.benchmarks.cluster.prediction

The machine is measured first, by the waves of `dem-warp doctor --measure`; then each wave runs. A prediction
is good where the ratio lies between 1 / 1.5 and 1.5. On a machine of its own, `--wall` times waves on all
cores. On one that others use, wall time is theirs too: so the default is one worker, this process, and its
time of the processor, in the measurement and in the waves. Neither counts the start of other processes then.
"""

from __future__ import annotations

import os
import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer

from dem_warp import Case
from dem_warp.batch import Batch
from experiments.benchmarks.results import write_results
from experiments.benchmarks.scenes import SKETCHES, sketch_case
from experiments.cases import OwnWorkers
from experiments.cases.cost import cost_of
from experiments.cases.workers.speed import measure_speed, wave_seconds
from experiments.report.kit.machine import machine
from experiments.studyfile import Study, load_study
from experiments.studyfile.campaign import TARGET_SCENE

HERE = Path(__file__).parent
STUDIES, BENCHMARKS = HERE.parents[1] / "studies", HERE.parent

WITHIN = 1.5
"""Factor within which a prediction is good."""

RADIUS = 3.0e-3
"""Radius of the balls of the sketches [m]."""

OUTLETS: dict[str, dict[str, Any]] = {"hopper": {"outlet": 0.036}, "draw-down": {"slot": 0.048}}
"""Outlets that such balls do not clog [m]."""


def waves(each: int) -> dict[str, list[Case]]:
    """Cases of studies that differ in test, grains and size; so many of each, more of the small ones."""
    trial, bench = load_study(STUDIES / "trial" / "study.toml", "bench"), load_study(None, "bench")
    few = load_study(None, "bench", {"scene": {"lifted-cylinder": {"grain_count": 200}}})
    fuzz = load_study(BENCHMARKS / "fuzz" / "corpus" / "study.toml")
    balls, clumps = (load_study(BENCHMARKS / "bridge" / f"{name}.toml") for name in ("sphere", "elongated"))
    found = {
        "trial, bench": _middle(trial, 4 * each),
        "trial, bench, lifted fast": _middle(trial, 4 * each, "fast"),
        "buckwheat, bench": _middle(bench, each),
        "buckwheat, bench, 200 grains": _middle(few, each),
        "fuzz corpus: cohesion, tilted plate": _middle(fuzz, each),
        "bridge: balls": _middle(balls, 2 * each),
        "bridge: elongated clumps": _middle(clumps, 2 * each),
        "dem-warp new": _middle(load_study(STUDIES / "template.toml"), each),
    }
    for name, sketch in SKETCHES.items():
        wide = sketch._replace(scene=replace(sketch.scene, **OUTLETS.get(name, {})))
        found[f"balls of 3 mm, {name}"] = [sketch_case(wide, RADIUS)] * each
    return found


def _middle(study: Study, count: int, scene: str = TARGET_SCENE) -> list[Case]:
    """So many cases in the middle of all factors."""
    return [study.case({}, seed, scene) for seed in range(1, count + 1)]


def main(
    each: Annotated[int, typer.Option(min=1, help="Cases of the larger studies.")] = 1,
    wall: Annotated[
        bool, typer.Option("--wall", help="Wall time on all cores, the machine being free.")
    ] = False,
    out: Annotated[Path, typer.Option(help="Folder of the table.")] = Path("out/prediction"),
) -> None:
    """Measure the machine, predict, run and compare."""
    workers = OwnWorkers("cpu", None if wall else 1)
    clock = time.perf_counter if wall else time.process_time
    speed = measure_speed(workers, clock)
    rows = []
    for name, cases in waves(each).items():
        costs = [cost_of(case) for case in cases]
        Batch(cases[:1], "cpu").advance()  # compiles
        started = clock()
        results = workers.simulate(cases)
        took = clock() - started
        steps = sum(phase["steps"] for result in results for phase in result.phases) / len(results)
        ended = ", ".join(sorted({result.status for result in results}))
        told = wave_seconds(costs, speed, workers.count, on_gpu=False)
        rows.append(
            {
                "study": name,
                "cases": len(cases),
                "spheres": costs[0].spheres,
                "steps told / taken": costs[0].steps / steps,
                "told s": told,
                "taken s": took,
                "told / taken": told / took,
                "ended": ended,
                "load": os.getloadavg()[0],
            }
        )
        print(rows[-1], flush=True)
    table = pd.DataFrame(rows)
    good = int(table["told / taken"].between(1.0 / WITHIN, WITHIN).sum())
    count = f"{workers.count} {'worker' if workers.count == 1 else 'workers'}"
    of = "wall time" if wall else "time of the processor"
    text = (
        f"{machine('cpu')}, {count}, {of}. Measured: {1e6 * speed.step:.3g} us "
        f"a step, {1e9 * speed.grain_step:.3g} ns a grain, {1e9 * speed.sphere_step:.3g} ns a sphere, "
        f"{speed.start:.3g} s to start. {good} of "
        f"{len(table)} within a factor of {WITHIN}."
    )
    print(write_results(out, "prediction", [("prediction", text, table)]).read_text(encoding="utf-8"))
    raise typer.Exit(int(good < len(table)))


if __name__ == "__main__":
    typer.run(main)
