"""One world's part of a batch's device arrays, copied and restored.

A snapshot is independent of its batch: the world may continue in any batch of its build with the same bits.
The arrays are found in the structs, so that a new field of the state needs no change here.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from dem_warp.entries import max_partners
from dem_warp.solver import CHUNK, Solver
from dem_warp.state import WALL_SHAPE, arrays_of

Snapshot = dict[str, np.ndarray]
"""Part of a world in each array of the state, by name."""

STEP, COUNT, ENTRY = "grains.step", "neighbours.count", "neighbours.entry"
WALLS = "world.walls"


def take_snapshot(solver: Solver, world: int) -> Snapshot:
    """Return everything that determines the next steps of a world, except its setup.

    Call it between two calls of `Solver.advance`, when the first copy of the grains is the present one.
    """
    counts = _counts(solver, world)
    snapshot = {field.name: field.read() for field in _fields(solver, world, counts)}
    entries = _renumbered(solver, snapshot[ENTRY], *_first_walls(solver, world))
    return snapshot | {COUNT: counts[:, None], ENTRY: entries}


def put_snapshot(solver: Solver, world: int, snapshot: Snapshot) -> None:
    """Restore a world from a snapshot.

    Raise ValueError, without a change, if it is of another kind of world, its lists are too long, or a value
    in it is impossible.
    """
    if COUNT not in snapshot:
        raise ValueError(f"snapshot: must have {COUNT}, got {sorted(snapshot)}")
    fields = list(_fields(solver, world, snapshot[COUNT].ravel()))
    if odd := sorted(snapshot.keys() ^ {field.name for field in fields}):
        raise ValueError(f"snapshot: missing or unknown fields {odd}")
    in_batch, in_snapshot = _first_walls(solver, world)
    numbered = snapshot | {ENTRY: _renumbered(solver, snapshot[ENTRY], in_snapshot, in_batch)}
    filled = [field.filled(numbered[field.name]) for field in fields]
    _check_values(solver, world, snapshot, in_snapshot)
    for field, whole in zip(fields, filled, strict=True):
        for part in field.parts:
            part.assign(whole)
    solver.neighbours.near.top[world : world + 1].fill_(np.inf)


@dataclass(frozen=True, eq=False)
class _Field:
    """Part of one world in an array, the same in every copy of it."""

    name: str
    parts: tuple[Any, ...]
    axes: tuple[int, ...]
    """Axes before the last one, which holds the values of each item."""
    used: Any
    """Index of the items in use."""

    def read(self) -> np.ndarray:
        """Copy the items in use from the device."""
        return np.array(self._counted(self.parts[0].numpy())[self.used])

    def filled(self, values: np.ndarray) -> np.ndarray:
        """Return the whole part with other values for the items in use."""
        whole = self.parts[0].numpy().copy()
        old = self._counted(whole)[self.used]
        if (values.shape, values.dtype) != (old.shape, old.dtype):
            raise ValueError(
                f"{self.name}: must be {old.dtype} {old.shape}, got {values.dtype} {values.shape}"
            )
        self._counted(whole)[self.used] = values
        return whole

    def _counted(self, array: np.ndarray) -> np.ndarray:
        return array.reshape(*self.axes, -1)


def _fields(solver: Solver, world: int, counts: np.ndarray) -> Iterator[_Field]:
    """Yield the part in every array of a world whose grains have `counts` neighbours."""
    layout, capacity = solver.layout, solver.neighbours.capacity
    slots, grains = layout.grain_count, solver.worlds[world].grains.count
    if counts.shape != (grains,) or counts.max() > capacity:
        raise ValueError(f"{COUNT}: must be at most {capacity} for each of {grains} grains, got {counts}")
    listed = np.zeros((slots, capacity), dtype=bool)
    listed[:grains] = np.arange(capacity) < counts[:, None]
    walls = solver.model.wall.reshape((layout.world_count, -1))[world]
    yield _Field(WALLS, (walls,), (layout.wall_count,), slice(None))
    for name, arrays in state_arrays(solver).items():
        parts = tuple(array.reshape((layout.world_count, -1))[world] for array in arrays)
        each = parts[0].size // slots
        if name.startswith("neighbours.") and each >= capacity:
            yield _Field(name, parts, (slots, capacity), listed)
        elif each:
            yield _Field(name, parts, (slots,), slice(grains))
        else:
            yield _Field(name, parts, (1,), slice(1))


def _check_values(solver: Solver, world: int, snapshot: Snapshot, first_wall: int) -> None:
    """Raise ValueError for indices outside of arrays and values that are not finite."""
    for name, values in snapshot.items():
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            raise ValueError(f"{name}: must be finite")
    step, entries = int(snapshot[STEP].item()), snapshot[ENTRY]
    if step < 0 or step % CHUNK or (snapshot[COUNT] < 0).any():
        raise ValueError(f"{STEP}: must be a multiple of {CHUNK}, got {step}")
    partners = first_wall + len(solver.worlds[world].walls) + solver.worlds[world].triangle_count
    own, partner = np.divmod(entries, max_partners(solver.layout.sphere_count))
    if entries.size and ((own < 0) | (own >= solver.layout.sphere_count) | (partner >= partners)).any():
        raise ValueError(f"{ENTRY}: must be spheres, walls or triangles of the world")
    walls, present = snapshot[WALLS], _fields_of_walls(solver, world)
    for name in (*WALL_SHAPE, "pair", "weighed"):  # unchanged by a motion
        if not np.array_equal(walls[name].ravel(), present[name].ravel()):
            raise ValueError(f"{WALLS}.{name}: must be that of the world")


def _fields_of_walls(solver: Solver, world: int) -> np.ndarray:
    return solver.model.wall.reshape((solver.layout.world_count, -1))[world].numpy()


def state_arrays(solver: Solver) -> dict[str, tuple[Any, ...]]:
    """Return every non-empty array that steps change, with its copies."""
    first, second = (arrays_of(grains) for grains in solver.grains)
    state: dict[str, tuple[Any, ...]] = {
        f"grains.{name}": (array, second[name]) for name, array in first.items()
    }
    state |= {f"neighbours.{name}": (array,) for name, array in arrays_of(solver.neighbours).items()}
    state |= {f"world.{name}": (getattr(solver, name),) for name in ("alive", "flags", "rebuilds")}
    return {name: arrays for name, arrays in state.items() if arrays[0].size}


def _counts(solver: Solver, world: int) -> np.ndarray:
    """Return the number of neighbours of each grain of a world; 0 for a removed grain."""
    shape, grains = (solver.layout.world_count, -1), solver.worlds[world].grains.count
    counts = solver.neighbours.count.reshape(shape)[world].numpy()[:grains]
    alive = solver.alive.reshape(shape)[world].numpy()[:grains] > 0
    return np.where(alive, counts, 0)


def _first_walls(solver: Solver, world: int) -> tuple[int, int]:
    """Return the first wall's number among the partners, in the batch and in a snapshot without padding."""
    each = solver.layout.sphere_count
    return solver.layout.grain_count * each, solver.worlds[world].grains.count * each


def _renumbered(solver: Solver, entries: np.ndarray, first: int, new_first: int) -> np.ndarray:
    """Return neighbour entries with the walls counted from another number."""
    partner = entries % max_partners(solver.layout.sphere_count)
    return np.where(partner >= first, entries + np.int32(new_first - first), entries)
