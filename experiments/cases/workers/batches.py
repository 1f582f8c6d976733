"""Batches: which cases run in one launch, so that a device is full and workers end together."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dem_warp import Case
from dem_warp.simulation import batches
from experiments.cases.forecast.cost import cost_of, device_bytes

WORLDS = 1024
"""Worlds that one launch on a GPU holds at the most: few enough that a killed run loses little."""

FULL_GRAINS = 330_000
"""Grains with which a large GPU reaches 95 % of its speed (`experiments/evidence/performance/README.md`, cost)."""

GPU_WORKERS = 2
"""Workers of a GPU, each with a launch of its own in a process of its own, where workers are processes that
are started here: while the host makes the worlds of one launch, looks at them or sends their results, another
has the GPU. One GPU without a cluster has one, this process."""

MEMORY_SHARE = 0.8
"""Part of a device's free memory that the worlds of a launch may take, by what is predicted of them."""


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
        Free memory that a GPU has for each of its workers [bytes]; None: of workers on CPUs, which simulate
        one case at a time.
    sharing : int
        Workers that share a GPU.

    Returns
    -------
    list of list of int
        Indices of the cases of each batch. On a GPU these share all that kernels are compiled for.
    """
    if memory is None:
        return [[int(index)] for index in _falling(costs)]
    dealt = []
    for group in batches(cases, one_each=False):
        members = np.array(group)[_falling(costs[group])]
        sizes = [cost_of(cases[i]) for i in group]
        grains = len(group) * max(size.grains for size in sizes)
        largest = cases[group[int(np.argmax([size.spheres for size in sizes]))]]
        rounds = rounds_of(len(group), grains, workers, _worlds_held(largest, memory), sharing)
        dealt += _dealt(members, rounds, workers)
    return sorted(dealt, key=lambda batch: -float(costs[batch].sum()))


def rounds_of(count: int, grains: float, workers: int, most: int = WORLDS, sharing: int = 1) -> int:
    """Rounds of a launch a worker, in which so many worlds, of so many grains in all, are simulated.

    The launches of the workers that share a GPU fill it together as nearly as they can, since the last world
    of each runs alone at the end. A launch holds `most` worlds at the most.
    """
    full = FULL_GRAINS / sharing
    return max(round(grains / (workers * full)), math.ceil(count / (workers * most)), 1)


def _worlds_held(largest: Case, memory: float) -> int:
    """Worlds no larger than a case that so much memory holds [bytes], `WORLDS` at the most."""
    return max(min(int(MEMORY_SHARE * memory / device_bytes(largest)), WORLDS), 1)


def _falling(costs: np.ndarray) -> np.ndarray:
    """Places of the costs from the highest on, equal ones in their order."""
    return np.argsort(-costs, kind="stable")


def _dealt(members: np.ndarray, rounds: int, workers: int) -> list[list[int]]:
    """Deal members out in rounds of a batch a worker; in each round all batches cost much the same."""
    parts = np.array_split(members, rounds)
    return [part[w::workers].tolist() for part in parts for w in range(min(workers, len(part)))]
