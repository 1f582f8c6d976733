"""Wall time of steps: worlds are started at a moment, run in, and timed over a few stretches."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import warp as wp

from dem_warp.scenes.lifted_cylinder import TUBE
from dem_warp.solver import CHUNK, Solver
from experiments.evidence.performance.columns import REST, Moment

RUN_IN = 0.05
"""Simulated time before the first stretch [s]: contact histories grow again, a settled column is at rest."""

STRETCHES = 3
"""Stretches that are timed; the median counts."""


@dataclass(frozen=True)
class Timing:
    """Speed of a batch."""

    steps: int
    """Steps of one stretch."""
    seconds: tuple[float, ...]
    """Wall time of each stretch [s]."""
    free_spheres: float
    """Mean number of spheres, in all worlds together, whose grain has been released and feels forces."""
    rebuilds: float
    """Rebuilds of the neighbour lists, a world and step."""

    @property
    def step_seconds(self) -> float:
        """Median wall time of a step [s]."""
        return float(np.median(self.seconds)) / self.steps

    @property
    def sphere_steps(self) -> float:
        """Spheres moved on by a step in a second; grains that wait to be released do not count [1/s]."""
        return self.free_spheres / self.step_seconds


def start(moments: Sequence[Moment], device: str) -> Solver:
    """Solver of columns from their moments on."""
    solver = Solver([moment.setup for moment in moments], device)
    for world, moment in enumerate(moments):
        if moment.tube_motion != REST:
            solver.move_wall(world, TUBE, moment.tube_motion)
    return solver


def run_in(solver: Solver, duration: float = RUN_IN) -> None:
    """Advance until every world has passed a simulated time [s]; compiles and captures all that is timed."""
    least = min(setup.time_step for setup in solver.worlds)
    solver.advance(math.ceil(duration / (least * CHUNK)))


def time_steps(solver: Solver, steps: int, stretches: int = STRETCHES) -> Timing:
    """Time stretches of at least n steps."""
    chunks = math.ceil(steps / CHUNK)
    free, rebuilds = [_free_grains(solver)], solver.rebuilds.numpy().mean()
    seconds = []
    for _ in range(stretches):
        wp.synchronize_device(solver.device)
        started = time.perf_counter()
        solver.advance(chunks)
        wp.synchronize_device(solver.device)
        seconds.append(time.perf_counter() - started)
        free.append(_free_grains(solver))
    rebuilt = float(solver.rebuilds.numpy().mean() - rebuilds) / (stretches * chunks * CHUNK)
    free_spheres = float(np.mean(free)) * solver.layout.sphere_count
    return Timing(chunks * CHUNK, tuple(seconds), free_spheres, rebuilt)


def _free_grains(solver: Solver) -> int:
    views = solver.view(range(solver.layout.world_count))
    return sum(int(np.count_nonzero(view.alive & view.released)) for view in views)
