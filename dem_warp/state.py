"""The device arrays of a batch: constants (`Model`), state (`Grains`, twice) and neighbour lists."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dem_warp.clumps import stack_spheres
from dem_warp.laws.conventions import LawForms
from dem_warp.laws.mechanism import Mechanisms
from dem_warp.model import WorldSetup, shape_table
from dem_warp.types import FRAMES, Counts, Precision, device_structs


@dataclass(frozen=True)
class Layout:
    """Sizes of a batch, the same for each of its worlds."""

    world_count: int
    grain_count: int
    sphere_count: int
    wall_count: int
    weighed_count: int
    pair_count: int
    mechanisms: Mechanisms
    has_mesh: bool
    has_free_wall: bool
    is_periodic: bool
    forms: LawForms

    @classmethod
    def of(cls, worlds: Sequence[WorldSetup]) -> "Layout":
        """Return the layout of all worlds; worlds with fewer grains are padded."""
        alike: dict[str, set[Any]] = {
            "number of walls": {len(world.walls) for world in worlds},
            "number of weighed walls": {len(world.weighed) for world in worlds},
            "number of contacts": {len(world.contacts) for world in worlds},
            "mechanisms": {world.mechanisms for world in worlds},
            "forms of the contact law": {world.forms for world in worlds},
            "use of meshes": {world.triangle_count > 0 for world in worlds},
            "use of free walls": {world.free_wall is not None for world in worlds},
            "use of a period": {world.period is not None for world in worlds},
        }
        for name, found in alike.items():
            if len(found) > 1:
                rule = f"all in a batch must have the same {name}"
                raise ValueError(f"worlds: {rule}, got {sorted(found, key=str)}")
        return cls(
            len(worlds),
            max(world.grains.count for world in worlds),
            max(shape.sphere_count for world in worlds for shape in world.shapes),
            len(worlds[0].walls),
            len(worlds[0].weighed),
            len(worlds[0].contacts),
            worlds[0].mechanisms,
            worlds[0].triangle_count > 0,
            worlds[0].free_wall is not None,
            worlds[0].period is not None,
            worlds[0].forms,
        )

    @property
    def grain_total(self) -> int:
        return self.world_count * self.grain_count

    @property
    def cell_bits(self) -> tuple[int, int, int]:
        """Binary logarithms of the buckets of a world along x, y and z."""
        bits = max(int(np.ceil(np.log2(2 * self.grain_count * self.sphere_count))), 6)
        across = bits // 3
        return across, across, bits - 2 * across

    @property
    def sphere_total(self) -> int:
        return self.grain_total * self.sphere_count


def _padded(
    worlds: Sequence[WorldSetup], layout: Layout, rows: Sequence[np.ndarray], fill: Any, width: int
) -> np.ndarray:
    """Stack one array per world into (grain slots, width), with free slots filled."""
    out = np.empty((layout.world_count, layout.grain_count, width))
    out[:] = fill
    for w, row in enumerate(rows):
        out[w, : len(row)] = np.reshape(row, (len(row), width))
    return out.reshape(layout.grain_total, width)


def struct_array(struct: Any, rows: Sequence[dict[str, Any]], device: Any) -> wp.array:
    """Return a device array of a struct from one dictionary of fields per row."""
    host = np.zeros(len(rows), dtype=struct.numpy_dtype())
    for i, row in enumerate(rows):
        for name, value in row.items():
            host[name][i] = value
    return wp.array(host, dtype=struct, device=device)


WALL_SHAPE = ("kind", "axis", "radius", "upper_radius", "length", "reach")
"""Fields of a wall that follow from its shape."""


def _wall_rows(worlds: Sequence[WorldSetup]) -> list[dict[str, Any]]:
    """Return the fields of every wall at rest, world by world."""
    return [
        {name: getattr(wall, name) for name in WALL_SHAPE}
        | {
            "pair": pair,
            "point": wall.point,
            "orientation": (0.0, 0.0, 0.0, 1.0),
            "weighed": world.weighed.index(number) + 1 if number in world.weighed else 0,
        }
        for world in worlds
        for number, (wall, pair) in enumerate(world.walls)
    ]


def build_model(
    worlds: Sequence[WorldSetup],
    room: Sequence[tuple[int, int]],
    layout: Layout,
    precision: Precision,
    device: Any,
) -> Any:
    """Return the `Model` of a batch; `room` has the limits of `neighbour_room` for each world."""
    types = device_structs(precision)
    shapes = shape_table(worlds)
    real = np.float32 if precision.real is wp.float32 else np.float64
    spheres = stack_spheres(shapes)
    number = {shape: i for i, shape in enumerate(shapes)}
    shape_index = [np.array([number[s] for s in world.shapes])[world.grains.shapes] for world in worlds]
    inertia = [np.column_stack([world.inertias, world.bounding_radii]) for world in worlds]
    world_rows = [
        {
            "time_step": world.time_step,
            "gravity": world.gravity,
            "rolling_holds": float(world.rolling_holds),
            "unit": _unit_of(world, precision),
            "skin": world.skin,
            "reach": world.reach,
            "cell_rate": _unit_of(world, precision) / world.cell,
            **_period(world, precision, 2 ** layout.cell_bits[0]),
            "speed_limit": world.speed_limit,
            "drag_factor": np.exp(-world.air_drag * world.time_step),
            "force_rate": world.force_rate,
            "origin": world.origin,
            "half_extent": world.half_extent,
            "found_limit": found,
            "list_limit": listed,
        }
        for world, (found, listed) in zip(worlds, room, strict=True)
    ]
    contact_rows = [contact.parameters for world in worlds for contact in world.contacts]
    model = types.Model()
    model.world = struct_array(types.World, world_rows, device)
    model.contact = struct_array(types.ContactParams, contact_rows, device)
    model.wall = struct_array(types.Wall, _wall_rows(worlds), device)
    model.frame = wp.zeros(len(worlds) * layout.wall_count * FRAMES, dtype=types.Frame, device=device)
    model.shape_spheres = wp.array(spheres.reshape(-1, 4).astype(real), dtype=precision.vec4, device=device)
    model.shape_sphere_count = wp.array([s.sphere_count for s in shapes], dtype=int, device=device)
    model.shape = _ints(worlds, layout, shape_index, 0, device)
    model.inertia = wp.array(
        _padded(worlds, layout, inertia, 1.0, 4).astype(real), dtype=precision.vec4, device=device
    )
    model.release_step = _ints(worlds, layout, [world.grains.release_steps for world in worlds], 0, device)
    model.grain_count, model.pair_count = layout.grain_count, layout.pair_count
    return model


def _unit_of(world: WorldSetup, precision: Precision) -> float:
    """Return the length of one count of a sphere position [m]."""
    return world.length_unit if precision.is_fixed_point else 1.0


def _period(world: WorldSetup, precision: Precision, most: int) -> dict[str, Any]:
    """Return the period in counts of a sphere position, and its cells, `most` of them at most."""
    if world.period is None:
        return {}
    counts = world.period / _unit_of(world, precision)
    across = min(int(world.period / world.cell), most)
    return {"period": round(counts) if precision.is_fixed_point else counts, "across": across}


def _ints(
    worlds: Sequence[WorldSetup], layout: Layout, rows: Sequence[np.ndarray], fill: int, device: Any
) -> wp.array:
    return wp.array(_padded(worlds, layout, rows, fill, 1)[:, 0].astype(np.int32), dtype=int, device=device)


def build_grains(worlds: Sequence[WorldSetup], layout: Layout, precision: Precision, device: Any) -> Any:
    """Return the initial `Grains` of a batch, without places of the spheres."""
    types = device_structs(precision)
    real = np.float32 if precision.real is wp.float32 else np.float64
    positions = _padded(worlds, layout, [world.grains.positions for world in worlds], 0.0, 3)
    orientations = _padded(
        worlds, layout, [_unit(world.grains.orientations) for world in worlds], [0, 0, 0, 1], 4
    )
    velocity = [np.column_stack([world.grains.velocities, world.masses]) for world in worlds]
    spin = [np.column_stack([world.grains.spins, np.zeros(world.grains.count)]) for world in worlds]
    sizes = _padded(worlds, layout, [world.grains.sizes for world in worlds], 1.0, 1)[:, 0].astype(real)
    center = np.zeros((layout.grain_total, 4), dtype=np.int32 if precision.is_fixed_point else real)
    center[:, 3] = sizes.view(np.int32) if precision.is_fixed_point else sizes

    grains = types.Grains()
    grains.step = wp.zeros(layout.world_count, dtype=int, device=device)
    grains.position = wp.array(positions, dtype=wp.vec3d, device=device)
    grains.orientation = wp.array(orientations, dtype=wp.quatd, device=device)
    grains.velocity = wp.array(
        _padded(worlds, layout, velocity, 1.0, 4).astype(real), dtype=precision.vec4, device=device
    )
    grains.spin = wp.array(
        _padded(worlds, layout, spin, 0.0, 4).astype(real), dtype=precision.vec4, device=device
    )
    grains.center = wp.array(center, dtype=precision.sphere, device=device)
    grains.spheres = wp.zeros(layout.sphere_total, dtype=precision.sphere, device=device)
    return grains


def arrays_of(struct: Any) -> dict[str, wp.array]:
    """Return the arrays of a struct by field."""
    return {name: value for name, value in vars(struct).items() if isinstance(value, wp.array)}


def copy_grains(grains: Any, precision: Precision) -> Any:
    """Return a second copy of `Grains`, for steps that read one and write the other."""
    other = device_structs(precision).Grains()
    for name, array in arrays_of(grains).items():
        setattr(other, name, wp.clone(array))
    return other


def living_grains(worlds: Sequence[WorldSetup], layout: Layout, device: Any) -> wp.array:
    """Return 1 for each slot with a grain at the start, 0 for the others."""
    alive = np.zeros((layout.world_count, layout.grain_count), dtype=np.int32)
    for w, world in enumerate(worlds):
        alive[w, : world.grains.count] = 1
    return wp.array(alive.ravel(), dtype=int, device=device)


def build_neighbours(
    layout: Layout, capacity: int, remembered: int, precision: Precision, device: Any
) -> Any:
    """Return empty `Neighbours` of a batch; `remembered` is the number of a contact's values in memory."""
    types, real = device_structs(precision), precision.real
    neighbours, near, reactions = types.Neighbours(), types.Near(), types.Reactions()
    grains, worlds = layout.grain_total, layout.world_count
    slots, serial = grains * capacity, 0 if wp.get_device(device).is_cuda else grains
    neighbours.capacity = capacity
    neighbours.weighed = layout.weighed_count
    _clear(neighbours, grains, device, count=int, travel=real)
    _clear(neighbours, grains * layout.weighed_count, device, pushed=Counts)
    # all zero is a displacement of zero, remembered at step 0: no history
    _clear(neighbours, slots, device, entry=int, history=precision.vec4)
    _clear(neighbours, slots * remembered, device, memory=real)
    _clear(neighbours, worlds * layout.has_free_wall, device, borne=wp.int64, lift=wp.vec4d)
    _clear(neighbours, worlds, device, rebuilt=int)
    _clear(
        near, grains, device, count=int, speed=float, pace=float, path=real, travel=real, moves=int, afar=int
    )
    _clear(near, worlds, device, wall_speed=float, wall_path=real)
    _clear(near, slots, device, item=wp.vec2i)
    _clear(near, serial, device, first=int)
    near.top = wp.full(worlds, np.inf, dtype=float, device=device)
    _clear(reactions, serial, device, force=precision.vec4, torque=precision.vec4)
    neighbours.near, neighbours.reactions = near, reactions
    return neighbours


def _clear(struct: Any, size: int, device: Any, **kinds: Any) -> None:
    """Give a struct arrays of zeros, by field."""
    for name, kind in kinds.items():
        setattr(struct, name, wp.zeros(size, dtype=kind, device=device))


def build_cells(
    layout: Layout, found_capacity: int, capacity: int, remembered: int, precision: Precision, device: Any
) -> Any:
    """Return empty `Cells` of a batch, with capacities for partners of a sphere and entries of a list."""
    cells = device_structs(precision).Cells()
    cells.bits = wp.vec3i(*layout.cell_bits)
    spheres = layout.sphere_total
    _clear(cells, layout.world_count << sum(layout.cell_bits), device, bucket_size=int, bucket_start=int)
    _clear(cells, layout.world_count, device, cursor=int)
    _clear(cells, spheres * wp.get_device(device).is_cuda, device, seeker=int)
    _clear(cells, 1, device, seekers=int)
    _clear(cells, spheres, device, bucket=int, rank=int, order=int, found_count=int, ordered=precision.sphere)
    _clear(cells, spheres * found_capacity, device, found=int)
    cells.found_capacity = found_capacity
    # a single thread writes one list after another
    drafts = capacity * (layout.grain_total if wp.get_device(device).is_cuda else 1)
    _clear(cells, drafts, device, drafts=int, draft_history=precision.vec4)
    _clear(cells, drafts * remembered, device, draft_memory=precision.real)
    return cells


def _unit(quaternions: np.ndarray) -> np.ndarray:
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
