"""The work of a case before it runs: grains and steps."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

from dem_warp import Case, PouredScene
from dem_warp.device import resolve_device
from dem_warp.solver import CHUNK

BULK_FRACTION = 0.55
"""Typical solid fraction of a poured bed."""


@dataclass(frozen=True)
class Work:
    """Predicted size of a case."""

    kind: str
    """Purpose of the case's kernels: cases of one kind run at comparable speeds."""
    grains: int
    spheres: int
    time_step: float
    """[s]."""
    steps: float
    """Time steps from the first grain to rest."""


def rest_of(command: str) -> Work:
    """Return all that a command does apart from its batches, e.g. its report, as one unit of work."""
    return Work(command, 1, 1, 1.0, 1.0)


def work_of(case: Case[Any]) -> Work:
    """Predict the size of a case; an unknown test counts as one second of a thousand spheres."""
    each, names = case.grains.sphere_count, " + ".join(kind.__name__ for kind in case.kinds)
    kind = f"{names}, {each} spheres a grain, {case.numerics.precision}"
    if not isinstance(case.scene, PouredScene):
        return Work(kind, 1000 // each, 1000, case.time_step, 1.0 / case.time_step)
    grains = case.scene.supply(case)
    return Work(kind, grains, grains * each, case.time_step, _duration(case, grains) / case.time_step)


def _duration(case: Case[Any], grains: int) -> float:
    """Return the simulated time of a poured test [s]: its rain and its own expected phases."""
    scene = case.scene
    if fixed := getattr(scene, "duration", None):
        return float(fixed)
    mean_volume = float(case.grains.mean(lambda shape: shape.volume)) * case.grains.size_mean**3
    filled = BULK_FRACTION * scene.volume / (grains * mean_volume)
    rain = grains / scene.rain_rate * (min(filled, 1.0) if scene.grain_count is None else 1.0)
    return rain + _phases(_Test(scene, case))


@dataclass(frozen=True)
class _Test:
    """A test, whose phases take as long for every case of it."""

    scene: Any
    case: Any = field(compare=False)


@lru_cache(maxsize=1024)
def _phases(test: _Test) -> float:
    """Time that a test expects of its phases when one grain is poured [s]."""
    case = replace(test.case, scene=replace(test.scene, grain_count=1))
    [setup] = case.scene.prepare([case], resolve_device(None))
    phases = case.scene.controller(case, setup, CHUNK).phases
    return float(sum(phase.expected for phase in phases.values()))
