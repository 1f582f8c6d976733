"""How fast heaps are simulated: sphere-steps a second filling, settled and lifting, and where the time goes.

A sphere-step is one sphere of a living grain moved on by one step. All worlds hold the study's centre point
with different seeds. The settled column stands still between the filling and the lift.

    python -m experiments.benchmarks.heap_throughput --scale bench --device cpu
    python -m experiments.benchmarks.heap_throughput --scale soft --device cuda --worlds 1 --worlds 12

Results are in README.md beside this file.
"""

import time
from collections import defaultdict
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pandas as pd
import typer
import warp as wp

from dem_warp.batch import Batch
from dem_warp.device import resolve_device
from dem_warp.solver import CHUNK
from experiments.study import load_study

SETTLED_CHUNKS = 16
REPEATS = 20


@dataclass
class Stretch:
    """What was done in one phase."""

    seconds: float = 0.0
    sphere_steps: float = 0.0
    steps: int = 0
    rebuilds: float = 0.0


def run_phases(batch: Batch) -> dict[str, Stretch]:
    """Run a batch to its end; time is counted for the phase that all running worlds are in."""
    stretches: dict[str, Stretch] = defaultdict(Stretch)
    while batch.running:
        phases = {batch.phase(w) for w in batch.running}
        if phases == {"settle"} and "settled" not in stretches and _is_calm(batch):
            stretches["settled"] = _timed(batch, lambda: batch.solver.advance(SETTLED_CHUNKS), SETTLED_CHUNKS)
        world = batch.running[0]
        before = batch.steps[world]
        stretch = _timed(batch, batch.advance, None)
        stretch.steps = batch.steps[world] - before
        stretch.sphere_steps *= stretch.steps
        if len(phases) == 1:
            total = stretches[phases.pop()]
            for name, value in vars(stretch).items():
                setattr(total, name, getattr(total, name) + value)
    return stretches


def _timed(batch: Batch, run: object, chunks: int | None) -> Stretch:
    """Time one call; `sphere_steps` is by step where the steps are not known beforehand."""
    solver = batch.solver
    grains = int((solver.alive.numpy().reshape(-1, solver.layout.grain_count)[batch.running] > 0).sum())
    before = solver.rebuilds.numpy()[batch.running].mean()
    running = list(batch.running)
    wp.synchronize_device(solver.device)
    started = time.perf_counter()
    run()  # type: ignore[operator]
    wp.synchronize_device(solver.device)
    seconds = time.perf_counter() - started
    steps = (chunks or 0) * CHUNK
    spheres = grains * solver.layout.sphere_count
    rebuilds = float(solver.rebuilds.numpy()[running].mean() - before)
    return Stretch(seconds, spheres * steps if chunks else spheres, steps, rebuilds)


def _is_calm(batch: Batch) -> bool:
    views = batch.solver.view(batch.running)
    speeds = np.concatenate([np.linalg.norm(view.velocities[view.alive], axis=1) for view in views])
    return bool(np.sqrt(np.mean(speeds**2)) < batch.cases[0].scene.rest_speed)


def kernel_times(batch: Batch) -> pd.Series:
    """Mean time of one step and of each kernel of a rebuild, every world being rebuilt [s]."""
    solver = batch.solver
    seconds: dict[str, float] = defaultdict(float)
    launch = solver._launch

    def timed(kernel: wp.Kernel, dim: int, inputs: list) -> None:
        wp.synchronize_device(solver.device)
        started = time.perf_counter()
        launch(kernel, dim, inputs)
        wp.synchronize_device(solver.device)
        seconds[kernel.key.split("__")[-1]] += (time.perf_counter() - started) / REPEATS

    solver._launch = timed  # type: ignore[method-assign]
    for _ in range(REPEATS):
        solver._step(0)
        solver._step(1)
        solver.stale.fill_(1)
        solver._rebuild()
    solver._launch = launch  # type: ignore[method-assign]
    seconds["step"] /= 2
    return pd.Series(seconds)


def table(name: str, counts: list[int], device: str) -> pd.DataFrame:
    """One row a phase and number of worlds."""
    study = load_study(scale=name)
    rows = []
    for count in counts:
        batch = Batch([study.case({}, seed) for seed in range(count)], device)
        for phase, stretch in run_phases(batch).items():
            rows.append(
                {
                    "worlds": count,
                    "phase": phase,
                    "grains": batch.solver.layout.grain_count,
                    "us_per_step": 1e6 * stretch.seconds / stretch.steps,
                    "million_sphere_steps_per_s": stretch.sphere_steps / stretch.seconds / 1e6,
                    "rebuilds_per_1000": 1000 * stretch.rebuilds / stretch.steps,
                }
            )
    return pd.DataFrame(rows)


def main(
    scale: Annotated[str, typer.Option(help="Scale of the buckwheat study.")] = "bench",
    device: Annotated[str, typer.Option(help="cpu or cuda.")] = "cpu",
    worlds: Annotated[list[int] | None, typer.Option(help="Numbers of worlds to measure.")] = None,
) -> None:
    """Print the table of phases and, for the first number of worlds, of kernels in a filling column."""
    name = resolve_device(device)
    counts = worlds or [1]
    print(table(scale, counts, name).round(2).to_string(index=False))
    batch = Batch([load_study(scale=scale).case({}, 0)] * counts[0], name)
    while batch.phase(0) == "fill":
        batch.advance()
    print("\none step, and one rebuild of the full tube, by kernel [ms]")
    print((1e3 * kernel_times(batch)).round(3).to_string())


if __name__ == "__main__":
    typer.run(main)
