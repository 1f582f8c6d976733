"""The cost of a case before it runs: grains, steps, bytes on a device; for balance, plans and times left."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from dem_warp import Case, DrawDown, LiftedCylinder
from dem_warp.device import resolve_device
from dem_warp.laws.contact_law import memory_size
from dem_warp.room import neighbour_room
from dem_warp.scenes.poured_scene import PouredScene
from dem_warp.solver import CHUNK

BULK_FRACTION = 0.55
"""Solid fraction of a poured bed, roughly."""

SLOPE = math.tan(math.radians(35.0))
"""Slope of a heap while the tube still leads it, roughly: its top is what the tube must clear."""

FALL, CALM, REST = 0.25, 0.1, 0.35
"""Time that the last grain of a counted rain takes to lie still, a bed to be at rest, and a heap [s]."""

TRICKLE = 1.4
"""Time that the last grains of a draw-down take to trickle down and to rest, beyond its flow [s]: 0.7 to 2.2
in seven runs, with balls of 2.5 to 4 mm radius and slots of 36 to 60 mm."""

IDLE_SPHERES = 100.0
"""Spheres that cost as much as a step without any."""


@dataclass(frozen=True)
class Cost:
    """Predicted size of a case."""

    grains: int
    """Grains that are kept ready."""
    spheres: int
    """Their spheres."""
    steps: float
    """Time steps from the first grain to rest."""

    @property
    def sphere_steps(self) -> float:
        """Spheres times steps."""
        return self.spheres * self.steps


def cost_of(case: Case[Any]) -> Cost:
    """Predict the size of a case; one of an unknown test counts as a second of a thousand spheres."""
    scene = case.scene
    if not isinstance(scene, PouredScene):
        return Cost(1000 // case.grains.sphere_count, 1000, 1.0 / case.time_step)
    grains = scene.supply(case)
    return Cost(grains, grains * case.grains.sphere_count, _duration(case, grains) / case.time_step)


def relative_costs(cases: Sequence[Case[Any]]) -> np.ndarray:
    """Return the predicted work of cases, in steps of a sphere, (n,); what cannot be predicted is 1."""
    costs = []
    for case in cases:
        try:
            cost = cost_of(case)
            costs.append(cost.steps * (IDLE_SPHERES + cost.spheres))
        except (ValueError, TypeError, AttributeError):
            costs.append(1.0)
    return np.array(costs, dtype=np.float64)


def _duration(case: Case[Any], grains: int) -> float:
    """Simulated time of a poured test [s]."""
    scene = case.scene
    if scene.grain_count is None:
        fill = grains / scene.rain_rate * BULK_FRACTION / scene.densest_fill + CALM
    else:
        fill = grains / scene.rain_rate + FALL
    if not isinstance(scene, LiftedCylinder):
        trickle = TRICKLE if isinstance(scene, DrawDown) else 0.0
        return fill + CALM + _own_phases(_Test(scene, case)) + trickle
    if scene.duration is not None:
        return max(scene.duration, fill + CALM)
    bulk = min(grains * _grain_volume(case) / BULK_FRACTION, scene.volume)
    height = (3.0 * bulk * SLOPE**2 / math.pi) ** (1.0 / 3.0)
    lift = max(height / scene.lift_speed, scene.vibration_time) + REST
    return fill + CALM + lift


def _grain_volume(case: Case[Any]) -> float:
    return float(case.grains.mean(lambda shape: shape.volume)) * case.grains.size_mean**3


@dataclass(frozen=True)
class _Test:
    """A test whose phases take as long for every case of it."""

    scene: Any
    case: Any = field(compare=False)


@lru_cache(maxsize=256)
def _own_phases(test: _Test) -> float:
    """Time that a test expects of its phases after the filling [s]."""
    [setup] = test.scene.prepare([test.case], resolve_device(None))
    phases = test.scene.controller(test.case, setup, CHUNK).phases
    return float(sum(phase.expected for name, phase in phases.items() if name not in ("fill", "settle")))


# ---- memory ------------------------------------------------------------------------------------------------


def device_bytes(case: Case[Any]) -> int:
    """Bytes that the world of a case takes on a device, its copy to step back to included.

    They follow from the longest neighbour lists that it may have; what compiled kernels and graphs take is
    not among them.
    """
    [setup] = case.scene.prepare([case], resolve_device(None))
    found, listed = neighbour_room(setup)
    real = 8 if case.numerics.precision == "double" else 4
    grains, spheres = setup.grains.count, setup.grains.count * case.grains.sphere_count
    remembered = memory_size(setup.mechanisms, setup.forms)
    entry = 2 * (4 + 4 * real + remembered * real)
    state = 2 * (24 + 32 + 12 * real) + 60 + 4 * real
    buckets = 4 * spheres
    lists = grains * listed * entry
    moving = grains * state + spheres * 8 * real + lists
    return int(2 * moving + grains * listed * 8 + spheres * (4 * found + 16 + 4 * real) + 8 * buckets)
