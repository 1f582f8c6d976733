"""The work of a case before it runs: grains and steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

from dem_warp import Case, PlacedScene, PouredScene
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
    phases: Mapping[str, float] = field(default_factory=dict, compare=False)
    """Time steps of each phase; empty where they are unknown."""


def rest_of(command: str) -> Work:
    """Return all that a command does apart from its batches, e.g. its report, as one unit of work."""
    return Work(command, 1, 1, 1.0, 1.0)


def work_of(case: Case[Any]) -> Work:
    """Predict the size of a case; an unknown test counts as one second of a thousand spheres."""
    each, names = case.grains.sphere_count, " + ".join(kind.__name__ for kind in case.kinds)
    kind = f"{names}, {each} spheres a grain, {case.numerics.precision}"
    if not isinstance(case.scene, PouredScene | PlacedScene):
        return Work(kind, 1000 // each, 1000, case.time_step, 1.0 / case.time_step)
    grains = case.scene.supply(case)
    phases = {name: time / case.time_step for name, time in _durations(case, grains).items()}
    return Work(kind, grains, grains * each, case.time_step, sum(phases.values()), phases)


def _durations(case: Case[Any], grains: int) -> dict[str, float]:
    """Return the simulated time of each phase of a test [s], the rain in the first."""
    scene = case.scene
    if fixed := getattr(scene, "duration", None):
        return {"whole test": float(fixed)}
    first, *others = _phases(_Test(scene, case))
    if not isinstance(scene, PouredScene):
        return dict([first, *others])
    mean_volume = float(case.grains.mean(lambda shape: shape.volume)) * case.grains.size_mean**3
    filled = BULK_FRACTION * scene.volume / (grains * mean_volume)
    rain = grains / scene.grains_per_second(case) * (1.0 if scene.is_counted else min(filled, 1.0))
    return dict([(first[0], rain + first[1]), *others])


@dataclass(frozen=True)
class _Test:
    """A test, whose phases take as long for every case of it."""

    scene: Any
    case: Any = field(compare=False)


@lru_cache(maxsize=1024)
def _phases(test: _Test) -> tuple[tuple[str, float], ...]:
    """Time that a test expects of each of its phases with one grain [s]."""
    weighed = {"mass": None} if getattr(test.scene, "mass", None) else {}  # a mass excludes a count
    case = replace(test.case, scene=replace(test.scene, grain_count=1, **weighed))
    [setup] = case.scene.prepare([case], resolve_device(None))
    phases = case.scene.controller(case, setup, CHUNK).phases
    return tuple((name, float(phase.expected)) for name, phase in phases.items())
