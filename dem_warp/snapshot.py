"""One world's part of a batch's device arrays, copied out and put back.

A snapshot knows nothing of the batch that it was taken from: its world may go on in any batch of its build,
at any place and beside any others, and comes to the same bits.

The arrays are found by going through the structs, and how one is parted follows from its length: a new field
of the state needs nothing here.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from dem_warp.entries import max_partners
from dem_warp.solver import CHUNK, Solver
from dem_warp.state import arrays_of

Snapshot = dict[str, np.ndarray]
"""Part of a world in each array of the state, by the array's name."""

STEP, COUNT, ENTRY = "grains.step", "neighbours.count", "neighbours.entry"
WALLS = "world.walls"
FIXED_OF_WALLS = ("kind", "pair", "axis", "radius", "upper_radius", "length", "reach", "weighed")
"""Fields of a wall that no motion changes."""


def take_snapshot(solver: Solver, world: int) -> Snapshot:
    """Everything that the next steps of a world follow from, beside its setup.

    To be called between two calls of `Solver.advance`: the first copy of the grains is then the present one,
    and the next step writes the second, or on a CPU the only one.
    """
    counts = _counts(solver, world)
    snapshot = {field.name: field.read() for field in _fields(solver, world, counts)}
    entries = _renumbered(solver, snapshot[ENTRY], *_first_walls(solver, world))
    return snapshot | {COUNT: counts[:, None], ENTRY: entries}


def put_snapshot(solver: Solver, world: int, snapshot: Snapshot) -> None:
    """Bring a world to where it was when a snapshot of it was taken.

    Raises
    ------
    ValueError
        When the snapshot is none of such a world, its neighbour lists are longer than the batch's, or a value
        in it can be none of a run's. The world is then as it was before.
    """
    if COUNT not in snapshot:
        raise ValueError(f"a snapshot must have {COUNT}, got {sorted(snapshot)}")
    fields = list(_fields(solver, world, snapshot[COUNT].ravel()))
    if odd := sorted(snapshot.keys() ^ {field.name for field in fields}):
        raise ValueError(f"a snapshot must have the fields of the state, got a difference in {odd}")
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
    """Part of one world in an array; the same in every copy that there is of it."""

    name: str
    parts: tuple[Any, ...]
    axes: tuple[int, ...]
    """Axes that it is counted by; a last axis beside them holds the values of each."""
    used: Any
    """Index into the axes of what is in use; the rest is room."""

    def read(self) -> np.ndarray:
        """Copy what is in use from the device."""
        return np.array(self._counted(self.parts[0].numpy())[self.used])

    def filled(self, values: np.ndarray) -> np.ndarray:
        """The whole part with other values where it is in use."""
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
    """Every array that has something of a world, whose grains have `counts` neighbours."""
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
    """Refuse what steps would look up outside of their arrays, and what is no number."""
    for name, values in snapshot.items():
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            raise ValueError(f"{name}: must be finite")
    step, entries = int(snapshot[STEP].item()), snapshot[ENTRY]
    if step < 0 or step % CHUNK or (snapshot[COUNT] < 0).any():
        raise ValueError(f"a snapshot must be of whole chunks of {CHUNK} steps, got step {step}")
    partners = first_wall + len(solver.worlds[world].walls) + solver.worlds[world].triangle_count
    own, partner = np.divmod(entries, max_partners(solver.layout.sphere_count))
    if entries.size and ((own < 0) | (own >= solver.layout.sphere_count) | (partner >= partners)).any():
        raise ValueError(f"{ENTRY}: must name spheres, walls or triangles of the world")
    walls, present = snapshot[WALLS], _fields_of_walls(solver, world)
    for name in FIXED_OF_WALLS:
        if not np.array_equal(walls[name].ravel(), present[name].ravel()):
            raise ValueError(f"{WALLS}: must be those of the world, got another {name}")


def _fields_of_walls(solver: Solver, world: int) -> np.ndarray:
    return solver.model.wall.reshape((solver.layout.world_count, -1))[world].numpy()


def state_arrays(solver: Solver) -> dict[str, tuple[Any, ...]]:
    """Every array that steps change, with its copies; those that a build leaves out have no elements."""
    first, second = (arrays_of(grains) for grains in solver.grains)
    state: dict[str, tuple[Any, ...]] = {
        f"grains.{name}": (array, second[name]) for name, array in first.items()
    }
    state |= {f"neighbours.{name}": (array,) for name, array in arrays_of(solver.neighbours).items()}
    state |= {f"world.{name}": (getattr(solver, name),) for name in ("alive", "flags", "rebuilds")}
    return {name: arrays for name, arrays in state.items() if arrays[0].size}


def _counts(solver: Solver, world: int) -> np.ndarray:
    """Neighbours of each of a world's grains; those of a grain that was taken out are never looked at."""
    shape, grains = (solver.layout.world_count, -1), solver.worlds[world].grains.count
    counts = solver.neighbours.count.reshape(shape)[world].numpy()[:grains]
    alive = solver.alive.reshape(shape)[world].numpy()[:grains] > 0
    return np.where(alive, counts, 0)


def _first_walls(solver: Solver, world: int) -> tuple[int, int]:
    """Number of the first wall among the partners: in the batch, and in a snapshot, which has no padding."""
    each = solver.layout.sphere_count
    return solver.layout.grain_count * each, solver.worlds[world].grains.count * each


def _renumbered(solver: Solver, entries: np.ndarray, first: int, new_first: int) -> np.ndarray:
    """Neighbour entries whose walls are counted from another number."""
    partner = entries % max_partners(solver.layout.sphere_count)
    return np.where(partner >= first, entries + np.int32(new_first - first), entries)
