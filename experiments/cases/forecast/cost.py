"""The cost of a case before it runs: grains, steps, bytes on a device; for balance, plans and times left."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from dem_warp import Case
from dem_warp.device import resolve_device
from dem_warp.laws.contact_law import memory_size
from dem_warp.room import neighbour_room
from dem_warp.scenes.poured_scene import PouredScene, default_skin
from dem_warp.walls import Mesh
from experiments.cases.forecast.course import BULK_FRACTION, expected_course

IDLE_SPHERES = 100.0
"""Spheres that cost as much as a step without any."""

LAW_COSTS = {"jkr": 1.55, "capillary_bridge": 1.2}
"""Times that a law makes the grains of a step dearer, by its name: the reference cases of `workers.speed`
with it over those without, on one core; the other mechanisms that were timed lie within 1.1 of 1."""

EMPTY = 0.15
"""Time that the place of a grain which is gone takes in a step on one core, over that of a grain: 0.11 to
0.17 in three beds that all grains were taken out of."""

APART = 0.9
"""Least distance of two spheres of different grains, over the sum of their radii, roughly."""

POINTS = (0.5 + np.arange(2048)[:, None] * 1.2207440846057596 ** np.array([-1.0, -2.0, -3.0])) % 1.0
"""Points that fill a unit cube evenly, (n, 3): Roberts' sequence, whose ratio solves x^4 = x + 1."""

SKIN_STEP = 0.05
"""Step of the logarithm of the skin at which neighbours are counted."""


@dataclass(frozen=True)
class Cost:
    """Predicted size of a case."""

    grains: int
    """Grains that are kept ready."""
    spheres: int
    """Their spheres."""
    steps: float
    """Time steps from the first grain to rest."""
    present: float = 1.0
    """Part of the grains that is there, the mean over the steps."""
    looked: float = 0.0
    """Skins that the fastest grain uses up in a step, times the entries of all neighbour lists, the mean over
    the steps: the lists are looked through whenever a part of the skin is used up."""
    law: float = 1.0
    """Times that the contact law makes a grain's step dearer than the base law."""
    meshed: bool = False
    """A wall is a mesh: the kernels that know meshes are slower, whatever touches."""
    tended: float = 1.0
    """Time that a look at the scene takes the host, over that of a look at a heap, mean over the steps."""

    @property
    def moved(self) -> float:
        """Grains that cost as much as those that are there and the places of those that are gone."""
        return self.grains * (EMPTY + (1.0 - EMPTY) * self.present)

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
    course = expected_course(case, grains)
    time = sum(stage.time for stage in course)
    skin = case.numerics.skin or default_skin(case)
    each = grains * listed_entries(case, skin) * case.time_step / skin

    def mean(values: Sequence[float]) -> float:
        return sum(value * stage.time for value, stage in zip(values, course, strict=True)) / time

    return Cost(
        grains,
        grains * case.grains.sphere_count,
        time / case.time_step,
        mean([stage.present for stage in course]),
        each * mean([stage.pace * stage.present for stage in course]),
        float(np.prod([LAW_COSTS.get(law.name, 1.0) for law in case.mechanisms])),
        any(isinstance(wall, Mesh) for wall in scene.walls(case.grains.grain_reach)),
        mean([stage.tended for stage in course]),
    )


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


def listed_entries(case: Case[Any], skin: float) -> float:
    """Entries of the neighbour list of a grain in a bed, where the earlier of two grains lists the other.

    Notes
    -----
    Spheres of other grains are spread evenly over the space that a grain and the gap around it leave them; an
    entry is a sphere of the grain with one that is nearer to it than the skin.
    """
    return case.grains.mean(
        lambda shape: _entries(_Spheres.of(shape), _rounded(skin / case.grains.size_mean))
    )


def _rounded(length: float) -> float:
    return math.exp(SKIN_STEP * round(math.log(length) / SKIN_STEP))


@dataclass(frozen=True)
class _Spheres:
    """Spheres of a shape, to look results up by."""

    centers: bytes
    radii: bytes
    volume: float

    @classmethod
    def of(cls, shape: Any) -> _Spheres:
        centers, radii = (np.asarray(each, dtype=np.float64) for each in (shape.centers, shape.radii))
        return cls(centers.tobytes(), radii.tobytes(), float(shape.volume))


@lru_cache(maxsize=1024)
def _entries(spheres: _Spheres, skin: float) -> float:
    radii = np.frombuffer(spheres.radii)
    centers = np.frombuffer(spheres.centers).reshape(-1, 3)
    other = float(radii.mean())
    reach = radii + other + skin
    low, high = (centers - reach[:, None]).min(axis=0), (centers + reach[:, None]).max(axis=0)
    points = low + (high - low) * POINTS
    free, near = np.ones(len(points), dtype=bool), np.zeros(len(points))
    for center, radius, far in zip(centers, radii, reach, strict=True):
        away = np.linalg.norm(points - center, axis=1)
        free &= away >= APART * (radius + other)
        near += away < far
    density = BULK_FRACTION * len(radii) / spheres.volume
    return float(0.5 * density * np.prod(high - low) * (near * free).mean())


# ---- memory ------------------------------------------------------------------------------------------------


def device_bytes(case: Case[Any]) -> int:
    """Bytes that the world of a case takes on a GPU, its copy to step back to included; a CPU needs less.

    They follow from the longest neighbour lists that it may have; what compiled kernels and graphs take is
    not among them.
    """
    [setup] = case.scene.prepare([case], resolve_device(None))
    found, listed = neighbour_room(setup)
    real = 8 if case.numerics.precision == "double" else 4
    grains, spheres = setup.grains.count, setup.grains.count * case.grains.sphere_count
    remembered = memory_size(setup.mechanisms, setup.forms)
    entry = 4 + 4 * real + remembered * real
    state = 2 * (24 + 32 + 12 * real) + 60 + 4 * real
    buckets = 4 * spheres
    lists = grains * listed * entry
    moving = grains * state + spheres * 8 * real + lists
    drafts = lists
    return int(
        2 * moving + drafts + grains * listed * 8 + spheres * (4 * found + 16 + 4 * real) + 8 * buckets
    )
