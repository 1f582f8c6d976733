"""Speed of a machine, noted by every finished batch, and the wall time that a batch will take."""

from __future__ import annotations

import json
import math
import os
import re
import statistics
from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem_warp import Case
from dem_warp.cores import cores
from experiments.cases.forecast.work import Work, work_of
from experiments.io.files import read_file, write_text

if TYPE_CHECKING:
    from experiments.cases.workers.resources import Resources
    from experiments.cases.workers.workers import Workers

NOTES, FORMAT, LARGEST, KEPT = "dem-warp/batches.json", 1, 1_000_000, 1000
"""File of the noted batches in the user's cache, its format, its most bytes, and the batches it keeps."""

LEAST_SECONDS, LEAST_PART = 0.5, 0.5
"""Shortest time [s] and least part of the work that give a speed: progress comes ten times a second."""

FASTEST = {False: 2.0e8, True: 1.0e11}
"""Sphere-steps a second that no core and no GPU reaches: 6 and 8 times the fastest that was measured."""

SLOWEST = 1.0e4
"""Sphere-steps a second that every machine reaches: a hundredth of a heap of 30 spheres on one core."""

LARGE = 1000.0
"""Spheres of a case from which its speed says something about the machine."""

NEAR_STEP, NEAR_SIZE, LATEST = 1.5, 2.0, 9
"""Ratio of time steps and of spheres up to which a noted batch counts, and how many of the latest do."""

_CPU = re.compile(r"(.*, CPU, )(\d+) workers?")
"""Name of a machine's CPU with its number of workers."""

UNKNOWN = "unknown until the first batch"
"""Forecast of a machine on which no like batch has finished."""


@dataclass(frozen=True)
class Load:
    """A batch, as its workers share it."""

    machine: str
    on_gpu: bool
    kind: str
    spheres: float
    """Spheres that a worker has at once: those of a case on a CPU, of a launch on a GPU."""
    time_step: float
    """Geometric mean of the cases' time steps [s]."""
    sphere_steps: float
    """Sphere-steps of the busiest worker."""

    @classmethod
    def of(cls, works: Sequence[Work], workers: Workers | Resources) -> Load:
        """Share cases between workers."""
        total, kind = sum(work.spheres for work in works), "; ".join(sorted({work.kind for work in works}))
        step = statistics.geometric_mean(work.time_step for work in works)
        if not workers.on_gpu:
            each = [work.spheres * work.steps for work in works]
            busiest = max(sum(each) / workers.count, *each)
            return cls(workers.machine, False, kind, total / len(works), step, busiest)
        from experiments.cases.workers.batches import rounds_of

        grains = sum(work.grains for work in works)
        rounds = rounds_of(len(works), grains, workers.count, sharing=workers.sharing)
        launch = total / min(rounds * workers.count, len(works))
        longest = rounds * launch * max(work.steps for work in works)
        return cls(f"{workers.machine}, {workers.sharing} a GPU", True, kind, launch, step, longest)

    def is_like(self, other: Load) -> bool:
        """Tell that another batch runs at much the same speed."""
        step, size = self.time_step / other.time_step, self.spheres / other.spheres
        near = 1.0 / NEAR_STEP <= step <= NEAR_STEP and 1.0 / NEAR_SIZE <= size <= NEAR_SIZE
        return near and (_host(self.machine), self.kind) == (_host(other.machine), other.kind)


def _host(machine: str) -> str:
    """Return the name of a machine without its number of workers on a CPU, if each has a core."""
    found = _CPU.fullmatch(machine)
    return found[1] if found and int(found[2]) <= cores() else machine


def _notes() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / NOTES


def noted_batches() -> list[tuple[Load, float]]:
    """Return the noted batches and their speeds, the latest last, without those that cannot be true."""
    try:
        content = json.loads(read_file(_notes(), LARGEST))
        rows = content["batches"] if content["format"] == FORMAT else []
        found = [(Load(**row["load"]), float(row["speed"])) for row in rows]
        return [(load, speed) for load, speed in found if _is_possible(load, speed)]
    except (OSError, ValueError, TypeError, LookupError, RecursionError):
        return []


def _is_possible(load: Load, speed: float) -> bool:
    sizes = (load.spheres, load.time_step, load.sphere_steps)
    least = SLOWEST if load.sphere_steps > 1.0 else 0.0  # what a command does apart is one unit of work
    return all(0.0 < size < math.inf for size in sizes) and least < speed < FASTEST[load.on_gpu]


def note_batch(cases: Sequence[Case[Any] | Work], workers: Workers, part: float, seconds: float) -> None:
    """Note the speed of a finished batch, a part of which took a time [s], where it can be true."""
    if seconds < LEAST_SECONDS or part < LEAST_PART:
        return
    try:
        load = Load.of([case if isinstance(case, Work) else work_of(case) for case in cases], workers)
        if _is_possible(load, speed := load.sphere_steps * part / seconds):
            rows = [{"load": asdict(one), "speed": value} for one, value in [*noted_batches(), (load, speed)]]
            write_text(_notes(), json.dumps({"format": FORMAT, "batches": rows[-KEPT:]}) + "\n")
    except (ValueError, TypeError, AttributeError, OSError):
        return  # a run goes on without a note


def noted_speed(machine: str, like: Load | None = None) -> tuple[float, tuple[int, ...]] | None:
    """Return the median speed of a worker [sphere-steps/s], in like batches or in large ones; number them."""
    batches = [(n, *one) for n, one in enumerate(noted_batches())]
    found = [one for one in batches if (one[1].is_like(like) if like else one[1].spheres >= LARGE)]
    own = {n: speed for n, load, speed in found if load.machine.startswith(machine)}
    speeds = own or {n: speed for n, _, speed in found if like}
    return (statistics.median([*speeds.values()][-LATEST:]), tuple(speeds)) if speeds else None


def source_of(noted: Collection[int]) -> str:
    """Say that a number comes from some noted batches."""
    return f"from {len(noted)} {'batch' if len(noted) == 1 else 'batches'} on this machine"


def forecast(works: Sequence[Work], workers: Workers | Resources) -> tuple[float | None, tuple[int, ...]]:
    """Predict the wall time of a batch [s], None where it is unknown, from some noted batches."""
    load = Load.of(works, workers)
    speed = noted_speed(load.machine, load)
    return (load.sphere_steps / speed[0], speed[1]) if speed else (None, ())


def expected_seconds(cases: Sequence[Case[Any]], workers: Workers) -> float | None:
    """Predict the wall time of a batch [s]; None where it is unknown."""
    try:
        return forecast([work_of(case) for case in cases], workers)[0]
    except (ValueError, TypeError, AttributeError):
        return None
