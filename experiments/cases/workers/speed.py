"""The speed of a machine: measured once, stored for its user, and the time that a wave will take there."""

from __future__ import annotations

import itertools
import json
import math
import os
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dem_warp import (
    Case,
    CaseResult,
    ClumpShape,
    GrainPopulation,
    Interaction,
    LiftedCylinder,
    Material,
    Numerics,
)
from experiments.cases.cost import Cost, cost_of
from experiments.cases.engine import Engine
from experiments.cases.workers.batches import FULL_GRAINS, WORLDS
from experiments.cases.workers.workers import Workers
from experiments.files import read_file, write_text

Clock = Callable[[], float]
"""Tells a time [s]."""

SPEEDS = "speeds.json"
"""File of the measured speeds in the user's folder."""

LARGEST = 1_000_000
"""Bytes of the largest file of speeds that is read."""


@dataclass(frozen=True)
class Speed:
    """Wall time of steps on one worker, all of them being busy."""

    step: float
    """Of a step, however few grains there are [s]."""
    sphere_step: float
    """Of a sphere in a step, beyond that [s]."""
    start: float
    """From the order of a wave to its first step [s]."""
    on: str = ""
    """Day and number of workers of the measurement; empty: it was never measured."""
    grain_step: float = 0.0
    """Of a grain in a step, beyond that and its spheres [s]."""

    def seconds(self, cost: Cost) -> float:
        """Wall time of a case on a worker of its own [s]."""
        each = self.grain_step * cost.grains + self.sphere_step * cost.spheres
        return cost.steps * (self.step + each)


TYPICAL = {False: Speed(1.6e-5, 5.0e-8, 3.0, grain_step=2.7e-7), True: Speed(1.0e-5, 1.0e-10, 5.0)}
"""Speeds of a core and of a large GPU, where none was measured: a first guess of the time left."""


def user_folder() -> Path:
    """Folder of what dem-warp keeps for a user: ``dem-warp`` in ``XDG_CACHE_HOME``, or in ``~/.cache``."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "dem-warp"


def stored_speed(machine: str) -> Speed | None:
    """Speed that was measured of a machine; None where it never was."""
    try:
        return Speed(**_stored()[machine])
    except (KeyError, TypeError):
        return None


def store_speed(machine: str, speed: Speed) -> None:
    """Store the speed of a machine beside those of others."""
    text = json.dumps(_stored() | {machine: asdict(speed)}, indent=1, allow_nan=False)
    write_text(user_folder() / SPEEDS, text + "\n")


def _stored() -> dict[str, Any]:
    try:
        return dict(json.loads(read_file(user_folder() / SPEEDS, LARGEST)))
    except (OSError, ValueError, TypeError, RecursionError):
        return {}


# ---- prediction --------------------------------------------------------------------------------------------


def wave_seconds(costs: Sequence[Cost], speed: Speed, workers: int, on_gpu: bool) -> float:
    """Predict the wall time of a wave on so many workers [s]."""
    if not costs:
        return 0.0
    if on_gpu:
        grains, spheres = (sum(getattr(cost, name) for cost in costs) for name in ("grains", "spheres"))
        launches = max(math.ceil(grains / FULL_GRAINS), math.ceil(len(costs) / WORLDS), 1)
        rounds, longest = math.ceil(launches / workers), max(cost.steps for cost in costs)
        share = max(launches, min(workers, len(costs)))
        launch = Cost(math.ceil(grains / share), math.ceil(spheres / share), longest)
        return speed.start + rounds * speed.seconds(launch)
    alone = np.array([speed.seconds(cost) for cost in costs])
    return speed.start + max(float(alone.sum()) / workers, float(alone.max()))


def expected_seconds(cases: Sequence[Case], workers: Workers, engine: Engine | None = None) -> float | None:
    """Predict the wall time of a wave [s], another engine being as fast as dem-warp; None if it cannot be."""
    try:
        costs = [cost_of(case) for case in cases]
    except (ValueError, TypeError, AttributeError):
        return None
    on_gpu = workers.on_gpu and engine is None
    speed = stored_speed(workers.machine) or TYPICAL[on_gpu]
    return wave_seconds(costs, speed, workers.count, on_gpu)


def cpu_name(workers: int) -> str:
    """Name of this machine's CPU with so many workers."""
    return f"{platform.node()}, CPU, {workers} {'worker' if workers == 1 else 'workers'}"


# ---- measurement -------------------------------------------------------------------------------------------


BALLS, CLUMPS = (250, 1), (100, 9)
"""Grains of the reference cases that tell what a grain costs and what a sphere, and spheres of each."""

FEW = 30
"""Balls of the case whose steps cost least."""


def measure_speed(workers: Workers, clock: Clock = time.perf_counter) -> Speed:
    """Measure workers by four waves of reference cases, as many as there are workers or fill them.

    A few balls for short and for long give the start of a wave and the step; waves of many balls and of
    clumps of nine spheres give what a grain costs and what a sphere. Another clock than that of the wall
    gives times of its own.
    """
    count = workers.count
    few, long = few_spheres(), _reference(FEW, 1, duration=12.0)
    workers.simulate([few])  # compiles what the next one would
    short_seconds, short_steps = _timed(workers, [few] * count, clock)
    long_seconds, long_steps = _timed(workers, [long] * count, clock)
    least = max((long_seconds - short_seconds) / max(long_steps - short_steps, 1), 1e-7)
    start = max(short_seconds - short_steps * least, 0.0)
    steps = []
    for grains, spheres in (BALLS, CLUMPS):
        copies = min(math.ceil(FULL_GRAINS / grains), WORLDS) if workers.on_gpu else 1
        case = _reference(grains, spheres)
        workers.simulate([case])
        seconds, taken = _timed(workers, [case] * (count * copies), clock)
        steps.append((copies, (seconds - start) / taken))
    step, grain_step, sphere_step = split_costs(least, *steps)
    day = time.strftime("%Y-%m-%d")
    on = f"{day}, {count} {'worker' if count == 1 else 'workers'}"
    return Speed(step, sphere_step, start, on, grain_step)


def split_costs(
    least: float, balls: tuple[int, float], clumps: tuple[int, float]
) -> tuple[float, float, float]:
    """Split times of a step into that of any step, of a grain and of a sphere; none is negative.

    Parameters
    ----------
    least
        Step of `FEW` balls [s].
    balls, clumps
        Copies of the case of `BALLS` and of that of `CLUMPS`, and the step of them together [s].
    """
    (ball_copies, ball_step), (clump_copies, clump_step) = balls, clumps
    ball = max((ball_step - least) / (ball_copies * BALLS[0] - FEW), 0.0)
    step = max(least - FEW * ball, 1e-7)
    clump = max((clump_step - step) / (clump_copies * CLUMPS[0]), 0.0)
    sphere = min(max((clump - ball) / (CLUMPS[1] - 1), 0.0), ball)
    return step, ball - sphere, sphere


def _timed(workers: Workers, cases: Sequence[Case], clock: Clock) -> tuple[float, int]:
    """Time of a wave [s], and steps of a case."""
    started = clock()
    results = workers.simulate(cases)
    return clock() - started, _steps(results[0])


def _steps(result: CaseResult) -> int:
    return sum(phase["steps"] for phase in result.phases)


def few_spheres() -> Case[LiftedCylinder]:
    """Build the case of a heap of thirty spheres, which takes a tenth of a second."""
    return _reference(FEW, 1)


def _reference(grains: int, spheres: int, duration: float | None = None) -> Case[LiftedCylinder]:
    """Case of a small heap of balls, or of cubes of nine spheres."""
    steel, radius = Material(7800.0, 7.0e10, 0.3), 2.0e-3
    shape = ClumpShape.sphere(radius)
    if spheres == CLUMPS[1]:
        corners = np.array([(0, 0, 0), *itertools.product((-1, 1), repeat=3)]) * radius / 3.0
        shape = ClumpShape.from_spheres(corners, np.full(spheres, 0.6 * radius))
    side = 2.0 * radius * max(round((3.0 * grains) ** (1.0 / 3.0)), 7)
    return Case(
        LiftedCylinder(side, side, steel, grain_count=grains, duration=duration),
        GrainPopulation(shape, Material(700.0, 1.0e7, 0.25)),
        Interaction(0.2, 0.4, 0.05),
        Interaction(0.5, 0.4, 0.05),
        seed=1,
        # grains move as far in a step, and lists are made anew as often, as in studies
        numerics=Numerics(modulus_scale=400.0 if grains == FEW else 200.0),
    )
