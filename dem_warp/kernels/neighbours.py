"""Neighbour lists: every sphere of another grain, and every wall, nearer to a sphere than the skin.

Two grains have each other in their lists. Walls are numbered after the spheres of their world.

A list is sorted by the own sphere's number and then by the partner's, so its order, and with it the order of
a grain's force sum, depends on the grains alone: not on cells, skin, moment of the rebuild, batch or device.
The cells are the buckets of a hash grid that wraps around in each direction; two cells of one bucket are told
apart by the distance of their spheres. Only worlds whose `stale` flag is set are rebuilt. A contact's history
moves over to the new list with its entry.
"""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.kernels.packing import packing
from dem_warp.kernels.walls import wall_functions
from dem_warp.types import SPHERE_BITS, Build, WorldFlag, device_structs

NEVER = -1
CELLS_AROUND = 27
OWN_CELL = CELLS_AROUND // 2
NEIGHBOUR_OVERFLOW = wp.constant(int(WorldFlag.NEIGHBOUR_OVERFLOW))


@functools.cache
def neighbour_kernels(build: Build) -> SimpleNamespace:
    """`mark_stale`, and the launches of a rebuild in their order.

    These are `bin_spheres`, `open_buckets`, `fill_buckets`, `search`, `write_lists` and `finish`.
    """
    precision = build.precision
    real, vec4 = precision.real, precision.vec4
    types = device_structs(precision)
    Model, World, Grains, Neighbours = types.Model, types.World, types.Grains, types.Neighbours
    pack = packing(precision)
    walls = wall_functions(precision)
    spheres_each = wp.constant(build.sphere_count)
    walls_each = wp.constant(build.wall_count)
    module = wp.get_module(f"dem_warp_neighbours_{build.name}")
    wp.set_module_options({"enable_backward": False}, module)

    @wp.struct
    class Cells:
        bits: wp.vec3i  # a bucket table of 2**bits in each direction
        bucket_size: wp.array(dtype=int)  # all zero between rebuilds, (worlds * buckets,)
        bucket_start: wp.array(dtype=int)  # (worlds * buckets,)
        cursor: wp.array(dtype=int)  # (worlds,)
        bucket: wp.array(dtype=int)  # of a sphere, (spheres,)
        rank: wp.array(dtype=int)  # of a sphere in its bucket, (spheres,)
        order: wp.array(dtype=int)  # spheres by bucket, (spheres,)
        ordered: wp.array(dtype=precision.sphere)  # their positions, (spheres,)
        found: wp.array(dtype=int)  # partners of a sphere, sorted, (spheres * found_capacity,)
        found_count: wp.array(dtype=int)  # (spheres,)
        found_capacity: int

    @wp.func
    def cell_of(a: precision.sphere, world: World) -> wp.vec3i:
        rate = world.cell_rate
        return wp.vec3i(
            int(wp.floor(real(a[0]) * rate)),
            int(wp.floor(real(a[1]) * rate)),
            int(wp.floor(real(a[2]) * rate)),
        )

    @wp.func
    def bucket_of(x: int, y: int, z: int, bits: wp.vec3i, w: int) -> int:
        mx = x & ((1 << bits[0]) - 1)
        my = y & ((1 << bits[1]) - 1)
        mz = z & ((1 << bits[2]) - 1)
        return (((((w << bits[2]) + mz) << bits[1]) + my) << bits[0]) + mx

    @wp.func
    def exists(model: Model, alive: wp.array(dtype=int), g: int, s: int) -> bool:
        return alive[g] > 0 and s < model.shape_sphere_count[model.shape[g]]

    @wp.kernel(module=module)
    def mark_stale(
        ahead: int,
        # model
        model: Model,
        # state in
        grains: Grains,
        alive: wp.array(dtype=int),
        idle: wp.array(dtype=int),
        hood: Neighbours,
        # state out
        stale: wp.array(dtype=int),
        any_stale: wp.array(dtype=int),
    ):
        """Marks a world in which a grain or a wall may use up its half of the skin within `ahead` steps."""
        g = wp.tid()
        w = g // model.grain_count
        if idle[w] != 0:
            return
        world = model.world[w]
        if g % model.grain_count == 0:
            for i in range(walls_each):
                wall = model.wall[w * walls_each + i]
                steps = grains.step[w] + ahead - wp.max(wall.start_step, hood.rebuilt[w])
                path = wp.length(wall.velocity) * wp.float64(steps) * wp.float64(world.time_step)
                if wp.float64(2.0) * path > wp.float64(world.skin):
                    stale[w] = 1
                    any_stale[0] = 1
        if alive[g] <= 0:
            return
        v = pack.load_vec4(grains.velocity, g)
        omega = pack.load_vec4(grains.spin, g)
        speed = wp.length(wp.vec3(float(v[0]), float(v[1]), float(v[2])))
        speed += wp.length(wp.vec3(float(omega[0]), float(omega[1]), float(omega[2]))) * float(
            model.inertia[g][3]
        )
        # a grain may be pushed on the way: allow for half as much again
        reach = hood.travel[g] + real(1.5 * speed) * real(ahead) * world.time_step
        if real(2.0) * reach > world.skin:
            stale[w] = 1
            any_stale[0] = 1

    @wp.kernel(module=module)
    def bin_spheres(
        model: Model, grains: Grains, alive: wp.array(dtype=int), stale: wp.array(dtype=int), cells: Cells
    ):
        i = wp.tid()
        g = i // spheres_each
        w = g // model.grain_count
        if stale[w] == 0:
            return
        if not exists(model, alive, g, i - g * spheres_each):
            cells.rank[i] = NEVER
            return
        c = cell_of(pack.load_sphere(grains.spheres, i), model.world[w])
        b = bucket_of(c[0], c[1], c[2], cells.bits, w)
        cells.bucket[i] = b
        cells.found_count[i] = 0
        cells.rank[i] = wp.atomic_add(cells.bucket_size, b, 1)

    @wp.kernel(module=module)
    def open_buckets(model: Model, stale: wp.array(dtype=int), cells: Cells):
        """Gives each occupied bucket its place; which place is a race, and nothing depends on it."""
        i = wp.tid()
        w = i // (spheres_each * model.grain_count)
        if stale[w] != 0 and cells.rank[i] == 0:
            b = cells.bucket[i]
            cells.bucket_start[b] = wp.atomic_add(cells.cursor, w, cells.bucket_size[b])

    @wp.kernel(module=module)
    def fill_buckets(model: Model, grains: Grains, stale: wp.array(dtype=int), cells: Cells):
        i = wp.tid()
        w = i // (spheres_each * model.grain_count)
        if stale[w] != 0 and cells.rank[i] >= 0:
            first = w * spheres_each * model.grain_count
            slot = first + cells.bucket_start[cells.bucket[i]] + cells.rank[i]
            cells.order[slot] = i
            pack.store_sphere(cells.ordered, slot, pack.load_sphere(grains.spheres, i))

    @wp.func
    def sort_found(cells: Cells, i: int, count: int):
        """Sorts the partners of sphere `i`, which are few, by insertion."""
        first = i * cells.found_capacity
        for n in range(1, count):
            partner = cells.found[first + n]
            k = int(n)
            while k > 0 and cells.found[first + k - 1] > partner:
                cells.found[first + k] = cells.found[first + k - 1]
                k -= 1
            cells.found[first + k] = partner

    @wp.func
    def append(cells: Cells, i: int, partner: int):
        """Adds a partner to those of sphere `i`, in any order; past the capacity only the count goes on."""
        n = wp.atomic_add(cells.found_count, i, 1)
        if n < cells.found_capacity:
            cells.found[i * cells.found_capacity + n] = partner

    @wp.kernel(module=module)
    def search(model: Model, grains: Grains, stale: wp.array(dtype=int), cells: Cells):
        """Partners of each sphere: pairs in its own bucket, and with the half of the buckets ahead of it.

        Threads follow the buckets, so that neighbouring threads read the same memory.
        """
        slot = wp.tid()
        w = slot // (spheres_each * model.grain_count)
        first = w * spheres_each * model.grain_count
        if stale[w] == 0 or slot - first >= cells.cursor[w]:
            return
        i = cells.order[slot]
        g = i // spheres_each
        world = model.world[w]
        a = pack.load_sphere(cells.ordered, slot)
        reach = pack.last(a) + world.skin
        c = cell_of(a, world)
        for n in range(OWN_CELL, CELLS_AROUND):
            b = bucket_of(c[0] + n % 3 - 1, c[1] + (n // 3) % 3 - 1, c[2] + n // 9 - 1, cells.bits, w)
            begin = first + cells.bucket_start[b]
            end = begin + cells.bucket_size[b]
            if n == OWN_CELL:
                begin = slot + 1
            for k in range(begin, end):
                q = pack.load_sphere(cells.ordered, k)
                d = pack.difference(a, q, world)
                touching = reach + pack.last(q)
                if wp.dot(d, d) < touching * touching:
                    j = cells.order[k]
                    if j // spheres_each != g:
                        append(cells, i, j - first)
                        append(cells, j, i - first)
        for k in range(walls_each):
            wall = model.wall[w * walls_each + k]
            if walls.overlaps(wall, pack.place(a, world), reach, grains.step[w], world.time_step):
                append(cells, i, model.grain_count * spheres_each + k)

    @wp.func
    def first_of_sphere(entry: wp.array(dtype=int), first: int, count: int, s: int) -> int:
        """Index of the first entry of own sphere `s` or a later one, by bisection."""
        low = int(0)
        high = int(count)
        while low < high:
            middle = (low + high) // 2
            if (entry[first + middle] >> SPHERE_BITS) < s:
                low = middle + 1
            else:
                high = middle
        return low

    @wp.kernel(module=module)
    def write_lists(
        model: Model, stale: wp.array(dtype=int), cells: Cells, hood: Neighbours, flags: wp.array(dtype=int)
    ):
        """A sphere's part of its grain's new list; histories come over from the old, both being sorted."""
        i = wp.tid()
        g = i // spheres_each
        s = i - g * spheres_each
        w = g // model.grain_count
        if stale[w] == 0 or cells.rank[i] < 0:
            return
        # empty for the next time; every sphere of the bucket writes the same
        cells.bucket_size[cells.bucket[i]] = 0
        before = int(0)
        for k in range(s):
            before += wp.min(cells.found_count[g * spheres_each + k], cells.found_capacity)
        own = wp.min(cells.found_count[i], cells.found_capacity)
        if cells.found_count[i] > cells.found_capacity or before + own > hood.capacity:
            wp.atomic_or(flags, w, NEIGHBOUR_OVERFLOW)
            own = wp.clamp(own, 0, wp.max(hood.capacity - before, 0))
        sort_found(cells, i, own)
        grain_total = model.shape.shape[0]
        old_row = hood.list[w] * grain_total + g
        new_row = (1 - hood.list[w]) * grain_total + g
        old_count = hood.count[old_row]
        old_first = old_row * hood.capacity
        old = first_of_sphere(hood.entry, old_first, old_count, s)
        for k in range(own):
            entry = (s << SPHERE_BITS) | cells.found[i * cells.found_capacity + k]
            slot = new_row * hood.capacity + before + k
            while old < old_count and hood.entry[old_first + old] < entry:
                old += 1
            history = vec4(real(0.0), real(0.0), real(0.0), real(-1.0))
            if old < old_count and hood.entry[old_first + old] == entry:
                history = pack.load_vec4(hood.history, old_first + old)
            hood.entry[slot] = entry
            pack.store_vec4(hood.history, slot, history)
        if s == model.shape_sphere_count[model.shape[g]] - 1:
            hood.count[new_row] = wp.min(before + own, hood.capacity)
            hood.travel[g] = real(0.0)

    @wp.kernel(module=module)
    def finish(
        grains: Grains, cells: Cells, hood: Neighbours,
        stale: wp.array(dtype=int), any_stale: wp.array(dtype=int), rebuilds: wp.array(dtype=int),
    ):  # fmt: skip
        w = wp.tid()
        if stale[w] != 0:
            hood.list[w] = 1 - hood.list[w]
            hood.rebuilt[w] = grains.step[w]
            stale[w] = 0
            cells.cursor[w] = 0
            rebuilds[w] = rebuilds[w] + 1
        if w == 0:
            any_stale[0] = 0

    return SimpleNamespace(
        Cells=Cells,
        mark_stale=mark_stale,
        bin_spheres=bin_spheres,
        open_buckets=open_buckets,
        fill_buckets=fill_buckets,
        search=search,
        write_lists=write_lists,
        finish=finish,
        module=module,
    )
