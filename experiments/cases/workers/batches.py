"""Batches: cases that run in one launch, chosen so that a device is full and workers end together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from dem_warp import Case
from dem_warp.device import resolve_device
from dem_warp.laws.contact_law import memory_size
from dem_warp.room import neighbour_room
from dem_warp.simulation import batches
from experiments.cases.forecast.work import work_of

WORLDS = 1024
"""Worlds of one launch on a GPU, at most: few enough that a killed run loses little."""

FULL_GRAINS = 330_000
"""Grains with which a large GPU reaches 95 % of its speed (evidence/performance/README.md, cost)."""

GPU_WORKERS = 2
"""Worker processes of a GPU, each with its own launch: while the host makes the worlds of one launch or sends
their results, another uses the GPU. One GPU without a cluster has one worker, this process."""

IDLE_SPHERES = 100.0
"""Spheres that cost as much as a step without any."""

MEMORY_SHARE = 0.8
"""Part of a device's free memory that the worlds of a launch may take, as predicted."""


def plan_batches(
    cases: Sequence[Case],
    costs: np.ndarray,
    workers: int = 1,
    memory: float | None = None,
    sharing: int = 1,
) -> list[list[int]]:
    """Deal cases out to batches, the costly ones first.

    Parameters
    ----------
    costs : array
        Predicted work of each case, (n,).
    workers : int
        Workers that take the batches.
    memory : float, optional
        Free memory of a GPU for each of its workers [bytes]; None: CPUs, which simulate one case at a time.
    sharing : int
        Workers that share a GPU.

    Returns
    -------
    list of list of int
        Indices of the cases of each batch; on a GPU, cases of the same kernels.
    """
    if memory is None:
        return [[int(index)] for index in _falling(costs)]
    dealt = []
    for group in batches(cases, one_each=False):
        members = np.array(group)[_falling(costs[group])]
        sizes = [work_of(cases[i]) for i in group]
        grains = len(group) * max(size.grains for size in sizes)
        largest = cases[group[int(np.argmax([size.spheres for size in sizes]))]]
        held = max(min(int(MEMORY_SHARE * memory / device_bytes(largest)), WORLDS), 1)
        rounds = rounds_of(len(group), grains, workers, held, sharing)
        for part in np.array_split(members, rounds):  # batches of a round cost much the same
            dealt += [part[w::workers].tolist() for w in range(min(workers, len(part)))]
    return sorted(dealt, key=lambda batch: -float(costs[batch].sum()))


def rounds_of(count: int, grains: float, workers: int, most: int = WORLDS, sharing: int = 1) -> int:
    """Return the rounds, of a launch a worker, for `count` worlds of `grains` in all.

    The launches of the workers that share a GPU fill it together as nearly as they can, since the last world
    of each runs alone at the end. A launch holds at most `most` worlds.
    """
    full = FULL_GRAINS / sharing
    return max(round(grains / (workers * full)), math.ceil(count / (workers * most)), 1)


def _falling(costs: np.ndarray) -> np.ndarray:
    """Return the places of the costs, the highest first, equal ones in their order."""
    return np.argsort(-costs, kind="stable")


def device_bytes(case: Case[Any]) -> int:
    """Bytes that the world of a case takes on a GPU, with its copy for stepping back; a CPU needs less.

    They follow from the longest neighbour lists that it may have. Compiled kernels and graphs come on top.
    """
    [setup] = case.scene.prepare([case], resolve_device(None))
    found, listed = neighbour_room(setup)
    real = 8 if case.numerics.precision == "double" else 4
    grains, spheres = setup.grains.count, setup.grains.count * case.grains.sphere_count
    remembered = memory_size(setup.mechanisms, setup.forms)
    lists = grains * listed * (4 + 4 * real + remembered * real)
    state = 2 * (24 + 32 + 12 * real) + 60 + 4 * real
    moving = grains * state + spheres * 8 * real + lists
    buckets = 8 * 4 * spheres
    return int(2 * moving + lists + grains * listed * 8 + spheres * (4 * found + 16 + 4 * real) + buckets)


def relative_work(cases: Sequence[Case[Any]]) -> np.ndarray:
    """Return the predicted work of cases, in steps of a sphere, (n,); 1 where it cannot be predicted."""
    found = []
    for case in cases:
        try:
            work = work_of(case)
            found.append(work.steps * (IDLE_SPHERES + work.spheres))
        except (ValueError, TypeError, AttributeError):
            found.append(1.0)
    return np.array(found, dtype=np.float64)
