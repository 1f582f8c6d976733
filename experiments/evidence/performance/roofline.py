"""Least traffic of a step through memory, and the speed of the device's memory.

The floor counts every array that a step works on once in and once out, a grain's own part of it: poses,
speeds, spheres and properties of the grains, the near entries of their lists, the histories of what touches.
Partners are taken to be found in the cache, where another grain's turn has brought them.
"""

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import warp as wp

from dem_warp.solver import Solver
from experiments.evidence.performance.contact_counts import ContactCounts, count_contacts, placed_centers

SAMPLE = 4
"""Worlds in which contacts are counted, for the mean."""

COPY_BYTES = {"cuda": 2**30, "cpu": 2**28}
"""Size of the array that is copied to measure the memory."""

COPIES = 10


def copy_bandwidth(device: str) -> float:
    """Bytes a second that a plain copy reads and writes, the best of ten [B/s]."""
    target = wp.get_device(device)
    count = COPY_BYTES["cuda" if target.is_cuda else "cpu"] // 16
    source, copy = (wp.zeros(count, dtype=wp.vec4, device=target) for _ in range(2))
    seconds = []
    for _ in range(COPIES + 1):
        wp.synchronize_device(target)
        started = time.perf_counter()
        wp.copy(copy, source)
        wp.synchronize_device(target)
        seconds.append(time.perf_counter() - started)
    return 2 * 16 * count / min(seconds[1:])


@dataclass(frozen=True, eq=False)
class Traffic:
    """Least memory traffic of one step of a batch."""

    list_length: float
    touching: float
    """Near entries of the neighbour lists, and how many of them touch, by grain; a grain that waits to be
    released has none."""
    table: pd.DataFrame
    """Array, bytes of an element, elements a grain, and how often each is moved: 2 for in and out."""

    @property
    def bytes_per_grain(self) -> float:
        """[B] a grain and step."""
        return float((self.table["bytes"] * self.table["elements"] * self.table["moves"]).sum())


def step_traffic(solver: Solver) -> Traffic:
    """Count what a step moves, from the arrays of a solver and its present contacts."""
    length, touching = _list_length(solver), _touching(solver)
    grains, neighbours = solver.layout.grain_total, solver.neighbours
    each, reactions = neighbours.memory.size / neighbours.history.size, _arrays(neighbours.reactions)
    state = [(name, array) for name, array in _arrays(solver.grains[0]) if name != "step"]
    rows = [
        *((name, array, array.size / grains, 2) for name, array in state),
        *((name, getattr(solver.model, name), 1.0, 1) for name in ("shape", "inertia", "release_step")),
        ("alive", solver.alive, 1.0, 1),
        ("numbers of near entries", neighbours.near.count, 1.0, 1),
        ("near entries", neighbours.near.item, length, 1),
        ("histories", neighbours.history, touching, 2),
        ("memories of mechanisms", neighbours.memory, touching * each, 2),
        ("path since the rebuild", neighbours.travel, 1.0, 2),
        *((f"reactions: {name}", array, array.size / grains, 2) for name, array in reactions),
    ]
    table = pd.DataFrame(
        [(name, _element_bytes(array), elements, moves) for name, array, elements, moves in rows],
        columns=["array", "bytes", "elements", "moves"],
    )
    return Traffic(length, touching, table[table["elements"] > 0])


def world_contacts(solver: Solver, world: int) -> ContactCounts:
    """Contacts of a world of one shape as they now stand."""
    setup, poses = solver.worlds[world], solver.poses(world)
    shape, sizes = setup.shapes[0], setup.grains.sizes[poses["slots"]]
    centers = placed_centers(shape, poses["positions"], poses["orientations"], sizes)
    radii = np.outer(sizes, shape.radii).ravel()
    grain = np.repeat(np.arange(len(sizes)), shape.sphere_count)
    return count_contacts(centers, radii, grain, [wall for wall, _ in setup.walls])


def _touching(solver: Solver) -> float:
    """Entries of a grain's list that touch, in the first worlds."""
    worlds = range(min(SAMPLE, solver.layout.world_count))
    grains = sum(len(solver.poses(world)["slots"]) for world in worlds)
    mutual = solver.build.cooperative
    return sum(world_contacts(solver, world).entries(mutual) for world in worlds) / grains


def _arrays(holder: Any) -> list[tuple[str, Any]]:
    return [(name, value) for name, value in vars(holder).items() if isinstance(value, wp.array)]


def _element_bytes(array: Any) -> int:
    return int(wp.types.type_size_in_bytes(array.dtype))


def _list_length(solver: Solver) -> float:
    worlds = solver.layout.world_count
    lengths = solver.neighbours.near.count.numpy().reshape(worlds, -1)
    views = solver.view(range(worlds))
    alive, released = (np.array([getattr(view, name) for view in views]) for name in ("alive", "released"))
    return float(lengths[alive & released].sum() / np.count_nonzero(alive))
