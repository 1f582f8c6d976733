"""The speed of a machine: measured once, stored for its user, and the time that a wave will take there."""

from __future__ import annotations

import itertools
import json
import math
import os
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from dem_warp import (
    Case,
    CaseResult,
    ClumpShape,
    DrawDown,
    GrainPopulation,
    Interaction,
    LiftedCylinder,
    Material,
    Numerics,
)
from experiments.cases.engines.engine import Engine
from experiments.cases.forecast.cost import Cost, cost_of
from experiments.cases.workers.batches import rounds_of
from experiments.cases.workers.workers import Workers
from experiments.io.files import read_file, write_text

Clock = Callable[[], float]
"""Tells a time [s]."""

SPEEDS = "speeds.json"
"""File of the measured speeds in the user's folder."""

LARGEST = 1_000_000
"""Bytes of the largest file of speeds that is read."""

FORM = 1
"""Form of the measurements that are stored, by which those of GPUs in an earlier one are told."""


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
    look_step: float = 0.0
    """Of a neighbour list's entry, for each skin that the fastest grain uses up [s]; see `Cost.looked`."""
    mesh: float = 1.0
    """Times that a step of grains takes where a wall is a mesh."""
    world_step: float = 0.0
    """Of a world with a heap in a step of a launch on a GPU: its scene is looked after by the host, one world
    after another, while the device waits [s]; see `Cost.tended`."""
    world_start: float = 0.0
    """Of a world of a launch on a GPU, once: the host makes it and takes its result [s]."""

    @property
    def text(self) -> str:
        """Its numbers, as a phrase."""
        sphere, look = 1e9 * self.sphere_step, 1e9 * self.look_step
        more = f"{look:.3g} ns a neighbour and skin" if look > 0.0 else f"{sphere:.3g} ns a sphere"
        on_gpu = self.world_step > 0.0
        world = f", {1e9 * self.world_step:.3g} ns a world" if on_gpu else ""
        once = f" and {1e3 * self.world_start:.2g} ms a world" if on_gpu else ""
        return (
            f"{1e6 * self.step:.3g} us a step{world}, {1e9 * self.grain_step:.3g} ns a grain and {more} "
            f"beyond, {self.mesh:.3g} times that where walls are meshes, "
            f"{self.start:.2g} s{once} to start"
        )

    def seconds(self, cost: Cost) -> float:
        """Wall time of a case on a worker of its own [s]."""
        return cost.steps * (self.step + self._grains_seconds(cost))

    def launch_seconds(self, costs: Sequence[Cost], launches: int = 1, sharing: int = 1) -> float:
        """Wall time of a launch on a GPU, one of so many like it that some cases are dealt out to [s].

        Parameters
        ----------
        sharing
            Launches that are on the GPU at once.

        Notes
        -----
        A step of a launch waits for its kernels, one after another, however little they do; beside that its
        grains take time only as far as they fill the device. The longer of the two hides the other, but for
        the corner, which the root of the sum of squares rounds off. The host's looks hide nothing. This form
        was chosen on the first twelve waves of `experiments.evidence.robustness.cluster.waves`, run on an H100.

        Launches that share a GPU take turns on it, each while the host looks after the worlds of the others:
        a step of theirs takes as long as one alone, or as their kernels one after another.
        """
        grains = sum(self._grains_seconds(cost) for cost in costs) / launches
        tended, kernels = sum(cost.tended for cost in costs) / launches, math.hypot(self.step, grains)
        step = max(self.world_step * tended + kernels, sharing * kernels)
        return self.world_start * len(costs) / launches + max(cost.steps for cost in costs) * step

    def _grains_seconds(self, cost: Cost) -> float:
        """Time of the grains of a step, by themselves [s]."""
        each = self.grain_step * cost.moved + self.look_step * cost.looked
        dearer = cost.law * (self.mesh if cost.meshed else 1.0)
        return dearer * (each + self.sphere_step * cost.spheres)


TYPICAL = {
    False: Speed(1.0e-5, 0.0, 3.0, grain_step=2.5e-7, look_step=7.0e-7, mesh=1.8),
    True: Speed(1.9e-5, 7.3e-11, 0.16, grain_step=1.8e-9, mesh=1.57, world_step=3.1e-7, world_start=2.6e-3),
}
"""Speeds of a core and of a large GPU, where none was measured: a first guess of the time left.

That of a GPU is an H100's, measured on 2026-11-25: 88 of 94 waves of studies on two other hosts with one took
between 1 / 1.5 and 1.5 of the time that it told. A measurement of a GPU scales it."""


def user_folder() -> Path:
    """Folder of what dem-warp keeps for a user: ``dem-warp`` in ``XDG_CACHE_HOME``, or in ``~/.cache``."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "dem-warp"


def stored_speed(machine: str) -> Speed | None:
    """Speed that was measured of a machine; None where it never was, or in an earlier form.

    The earlier ones had no meshes. On a GPU, where nobody counts neighbours, they had no form: each of its
    times was measured by itself there, and badly.
    """
    try:
        stored = dict(_stored()[machine])
        measured_now = stored.pop("form", None) == FORM or stored["look_step"]
        return Speed(**stored) if "mesh" in stored and measured_now else None
    except (KeyError, TypeError, ValueError):
        return None


def store_speed(machine: str, speed: Speed) -> None:
    """Store the speed of a machine beside those of others."""
    text = json.dumps(_stored() | {machine: asdict(speed) | {"form": FORM}}, indent=1, allow_nan=False)
    write_text(user_folder() / SPEEDS, text + "\n")


def _stored() -> dict[str, Any]:
    try:
        return dict(json.loads(read_file(user_folder() / SPEEDS, LARGEST)))
    except (OSError, ValueError, TypeError, RecursionError):
        return {}


# ---- prediction --------------------------------------------------------------------------------------------


def wave_seconds(costs: Sequence[Cost], speed: Speed, workers: int, on_gpu: bool, sharing: int = 1) -> float:
    """Predict the wall time of a wave on so many workers, of which so many share a GPU [s]."""
    if not costs:
        return 0.0
    if on_gpu:
        rounds = rounds_of(len(costs), sum(cost.grains for cost in costs), workers, sharing=sharing)
        launches = min(rounds * workers, len(costs))
        return speed.start + rounds * speed.launch_seconds(costs, launches, sharing)
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
    return wave_seconds(costs, speed, workers.count, on_gpu, workers.sharing)


def cpu_name(workers: int) -> str:
    """Name of this machine's CPU with so many workers."""
    return f"{platform.node()}, CPU, {workers} {'worker' if workers == 1 else 'workers'}"


# ---- measurement -------------------------------------------------------------------------------------------


BALLS, CLUMPS = (250, 1), (100, 9)
"""Grains of the reference cases that tell what a grain costs and what its neighbours, and spheres of each."""

BALLS_LOOKED, CLUMPS_LOOKED, BOX_LOOKED = 17.7, 64.1, 43.1
"""`Cost.looked` of these and of the box, counted in a run; the same on every machine, as the cases are."""

FEW = 30
"""Balls of the case whose steps cost least."""

SOFTENED = 50.0
"""Times that the reference cases on a GPU are softened: their time steps, and the steps between two looks at
the neighbour lists, are then those of most studies."""

SOME, MANY = 32, 512
"""Worlds of a launch that is far from full, as those of most studies, and of one that fills the device. Each
has its own seed, so that one or another always makes its lists anew, as in a study."""

SHORT = 0.6
"""Duration of the reference cases in many worlds [s]: all end together, so that the last of so many, of which
a study has fewer, does not count."""

PULL = 0.2
"""Weight of a factor's logarithm beside that of a wave's error: the time told of a wave is off by 0.2 of its
logarithm (standard deviation of 94), a GPU may differ by 1 from the typical one. A factor that no wave tells
of stays 1, one that a wave tells in full loses 4 %."""

OF_STUDIES = 1.3
"""Times as long as the reference waves tell that waves of studies take: chosen on 23 of them that ran beside
the reference on an H100, of which 22 are then told within a factor of 1.5, and 14 without it."""

WIDE_BOX, WIDE_BOXES = 2.0, 32
"""Times that the box on a GPU is as wide, and its worlds: few, since meshes are made for each by the host."""


def measure_speed(workers: Workers, clock: Clock = time.perf_counter) -> Speed:
    """Measure workers by waves of reference cases, as many as there are workers or fill them.

    On cores a few balls for short and for long give the start of a wave and the step; waves of many balls and
    of clumps of nine spheres give what a grain costs and what its neighbours; a box of balls whose walls are
    meshes gives what those cost. On a GPU such waves, as they come in studies, tell how many times as long as
    on a typical one they take. Another clock than that of the wall gives times of its own.
    """
    workers.simulate([few_spheres()])  # compiles what the next ones would
    speed = _measured_gpus(workers, clock) if workers.on_gpu else _measured_cores(workers, clock)
    count = f"{workers.count} {'worker' if workers.count == 1 else 'workers'}"
    return replace(speed, on=f"{time.strftime('%Y-%m-%d')}, {count}")


def _measured_cores(workers: Workers, clock: Clock) -> Speed:
    """Speed of workers on CPUs, of which each has one case of a wave."""

    def copies(case: Case[Any]) -> list[Case[Any]]:
        return [case] * workers.count

    short, long = few_spheres(), _reference(FEW, 1, duration=12.0)
    start, least = _start_and_step(*(_timed(workers, copies(case), clock) for case in (short, long)))
    sizes, taken = [(float(FEW), 0.0)], [least]
    references: list[tuple[float, Case[Any]]] = [
        (BALLS_LOOKED, _reference(*BALLS)),
        (CLUMPS_LOOKED, _reference(*CLUMPS)),
        (BOX_LOOKED, _box()),
    ]
    for looked, case in references:
        workers.simulate([case])
        seconds, steps = _timed(workers, copies(case), clock)
        sizes.append((cost_of(case).moved, looked))
        taken.append((seconds - start) / steps)
    step, grain, look = split_costs(sizes[:3], taken[:3])
    mesh = (taken[3] - step) / max(grain * sizes[3][0] + look * sizes[3][1], 1e-9)
    return Speed(step, 0.0, start, grain_step=grain, look_step=look, mesh=max(mesh, 1.0))


def _measured_gpus(workers: Workers, clock: Clock) -> Speed:
    """Speed of GPUs, of which each has one launch of a wave and one worker."""
    references: list[tuple[Case[Any], int]] = [
        (_reference(*BALLS), SOME),
        (_reference(*CLUMPS), SOME),
        *((_reference(*grains, duration=SHORT), MANY) for grains in (BALLS, CLUMPS, (FEW, 1))),
        (_box(WIDE_BOX), WIDE_BOXES),
    ]
    taken = []
    for case, worlds in references:
        case = replace(case, numerics=Numerics(modulus_scale=SOFTENED))
        wave = [replace(case, seed=1 + w) for w in range(worlds * workers.count)]
        workers.simulate(wave[: workers.count])  # compiles; a wave of a study comes once, too
        seconds, steps = _timed(workers, wave, clock)
        taken.append(([replace(cost_of(case), steps=steps)] * len(wave), OF_STUDIES * seconds))
    return scaled_speed(taken, workers.count)


def scaled_speed(taken: Sequence[tuple[Sequence[Cost], float]], workers: int = 1) -> Speed:
    """Scale the typical speed of a GPU, so that it tells the times that waves have taken.

    Parameters
    ----------
    taken
        Costs of a wave's cases, with the steps that they took, and its wall time [s].
    workers
        GPUs that the waves ran on.

    Notes
    -----
    One factor is that of all that the host does or waits for, one that of the device's grains, one that of
    meshes. More cannot be told apart reliably: a wave takes now a third longer, now less, and whatever splits
    a launch's time into its parts by differences of such times gives some of them far too short.
    """
    from scipy.optimize import least_squares

    def off(logarithms: np.ndarray) -> list[float]:
        speed = _scaled(*np.exp(logarithms))
        told = [wave_seconds(costs, speed, workers, on_gpu=True) for costs, _ in taken]
        errors = [math.log(each / seconds) for each, (_, seconds) in zip(told, taken, strict=True)]
        return errors + [PULL * float(each) for each in logarithms]

    speed = _scaled(*np.exp(least_squares(off, np.zeros(3)).x))  # logarithms, as no time is negative
    return replace(speed, mesh=max(speed.mesh, 1.0))


def _scaled(host: float, grains: float, mesh: float) -> Speed:
    """Typical speed of a GPU, times such factors."""
    typical = TYPICAL[True]
    return Speed(
        float(host * typical.step),
        float(grains * typical.sphere_step),
        float(host * typical.start),
        grain_step=float(grains * typical.grain_step),
        mesh=float(mesh * typical.mesh),
        world_step=float(host * typical.world_step),
        world_start=float(host * typical.world_start),
    )


def _start_and_step(short: tuple[float, float], long: tuple[float, float]) -> tuple[float, float]:
    """Time to the first step of a wave, and of a step [s], of times and steps of a short and a long one."""
    least = max((long[0] - short[0]) / max(long[1] - short[1], 1), 1e-7)
    return max(short[0] - short[1] * least, 0.0), least


def split_costs(sizes: Sequence[tuple[float, float]], taken: Sequence[float]) -> tuple[float, float, float]:
    """Split times of a step into that of any step, of a grain and of another size; none is negative.

    Parameters
    ----------
    sizes
        Grains that a step moved, and another size of it, of each reference.
    taken
        Time of its step [s].
    """
    from scipy.optimize import nnls

    seconds = np.array(taken)
    shares = np.column_stack([np.ones(len(seconds)), np.array(sizes, dtype=np.float64)]) / seconds[:, None]
    scale = np.linalg.norm(shares, axis=0)
    step, grain, other = nnls(shares / scale, np.ones(len(seconds)))[0] / scale
    return max(float(step), 1e-7), float(grain), float(other)


def _timed(workers: Workers, cases: Sequence[Case], clock: Clock) -> tuple[float, float]:
    """Time of a wave [s], and steps of its cases in the mean, as a prediction has them."""
    started = clock()
    results = workers.simulate(cases)
    seconds = clock() - started
    return seconds, sum(map(_steps, results)) / len(results)


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


def _box(times: float = 1.0) -> Case[DrawDown]:
    """Case of a small box of balls with a slot, whose walls are meshes; so many times as wide."""
    like: Case[Any] = _reference(*BALLS)
    width, depth, height, slot, drop = (times * size for size in (0.04, 0.016, 0.02, 0.024, 0.03))
    return replace(like, scene=DrawDown(width, depth, height, slot, drop, like.scene.wall_material))
