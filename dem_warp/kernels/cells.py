"""Search of near spheres in a hash grid of cells: each bucket is a run of spheres in memory.

Only worlds whose `stale` flag is set are searched. Places in memory are assigned in a race, and partners of a
sphere are found in any order; `neighbours` sorts them.
"""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.kernels.lanes import ALL_LANES, WARP, from_lane, lanes_with, running_sum
from dem_warp.kernels.packing import packing
from dem_warp.kernels.stale import SOME
from dem_warp.kernels.triangles import triangle_functions
from dem_warp.kernels.walls import wall_functions
from dem_warp.types import Build, device_structs

ABSENT = -1
CELLS_AROUND = 27
OWN_CELL = CELLS_AROUND // 2


@functools.cache
def cell_kernels(build: Build) -> SimpleNamespace:
    """Return `bin_spheres`, `open_buckets`, `fill_buckets` and `search`, in their order of launch."""
    precision = build.precision
    real = precision.real
    types = device_structs(precision)
    Model, World, Grains, Cells = types.Model, types.World, types.Grains, types.Cells
    Near = types.Near
    pack = packing(precision, build.is_periodic)
    walls = wall_functions(build)
    triangles = triangle_functions(precision)
    spheres_each = wp.constant(build.sphere_count)
    walls_each = wp.constant(build.wall_count)
    module = wp.get_module(f"dem_warp_cells_{build.name}")
    wp.set_module_options({"enable_backward": False}, module)

    @wp.func
    def around(cell: int, world: World) -> int:
        """Return the number along x or y of a cell, or of the one next to it; a period has numbers anew."""
        if wp.static(build.is_periodic):
            return (cell + world.across) % world.across
        return cell

    @wp.func
    def cell_of(a: precision.sphere, world: World) -> wp.vec3i:
        rate = world.cell_rate
        if wp.static(build.is_periodic):
            wide = real(world.across) / real(world.period)
            return wp.vec3i(
                around(int(wp.floor((real(a[0]) + real(0.5) * real(world.period)) * wide)), world),
                around(int(wp.floor((real(a[1]) + real(0.5) * real(world.period)) * wide)), world),
                int(wp.floor(real(a[2]) * rate)),
            )
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
    def bin_spheres(
        model: Model, grains: Grains, alive: wp.array(dtype=int), stale: wp.array(dtype=int), near: Near,
        cells: Cells,
    ):  # fmt: skip
        i = wp.tid()
        g = i // spheres_each
        w = g // model.grain_count
        if stale[w] == 0:
            return
        if near.afar[g] != 0 or not exists(model, alive, g, i - g * spheres_each):
            cells.rank[i] = ABSENT
            return
        c = cell_of(pack.load_sphere(grains.spheres, i), model.world[w])
        b = bucket_of(c[0], c[1], c[2], cells.bits, w)
        cells.bucket[i] = b
        cells.found_count[i] = 0
        cells.rank[i] = wp.atomic_add(cells.bucket_size, b, 1)

    @wp.func
    def room_for(cells: Cells, thread: int, w: int, size: int) -> int:
        """Reserve `size` places of a world and return the first; a warp of one world reserves together."""
        through = running_sum(size)
        of_warp = from_lane(through, WARP - 1)
        begin = int(0)
        if lanes_with(w == from_lane(w, 0)) == ALL_LANES:
            if thread % WARP == 0 and of_warp > 0:
                begin = wp.atomic_add(cells.cursor, w, of_warp)
            begin = from_lane(begin, 0) + through - size
        elif size > 0:
            begin = wp.atomic_add(cells.cursor, w, size)
        return begin

    @wp.kernel(module=module, grid_stride=False)
    def open_buckets(model: Model, stale: wp.array(dtype=int), cells: Cells):
        """Assign each occupied bucket a place, in a race; no result depends on it."""
        i = wp.tid()
        w = wp.min(i // (spheres_each * model.grain_count), stale.shape[0] - 1)
        size = int(0)
        if i < cells.rank.shape[0] and stale[w] != 0:
            if cells.rank[i] == 0:
                size = cells.bucket_size[cells.bucket[i]]
        begin = room_for(cells, i, w, size)
        if size > 0:
            cells.bucket_start[cells.bucket[i]] = begin

    @wp.kernel(module=module, grid_stride=False)
    def fill_buckets(model: Model, grains: Grains, stale: wp.array(dtype=int), near: Near, cells: Cells):
        """Write the spheres by bucket, and on a GPU list those that search.

        If only some grains have moved, these alone search.
        """
        i = wp.tid()
        w = wp.min(i // (spheres_each * model.grain_count), stale.shape[0] - 1)
        slot = int(0)
        seeks = bool(False)
        if i < cells.rank.shape[0] and stale[w] != 0:
            if cells.rank[i] >= 0:
                first = w * spheres_each * model.grain_count
                slot = first + cells.bucket_start[cells.bucket[i]] + cells.rank[i]
                cells.order[slot] = i
                pack.store_sphere(cells.ordered, slot, pack.load_sphere(grains.spheres, i))
                seeks = stale[w] != SOME or near.moves[i // spheres_each] != 0
        if wp.static(build.cooperative):
            through = running_sum(wp.where(seeks, 1, 0))
            begin = int(0)
            if i % WARP == WARP - 1 and through > 0:
                begin = wp.atomic_add(cells.seekers, 0, through)
            begin = from_lane(begin, WARP - 1)
            if seeks:
                cells.seeker[begin + through - 1] = slot

    @wp.func
    def append(cells: Cells, i: int, partner: int):
        """Add a partner of sphere `i`; past the capacity only the count grows."""
        n = wp.atomic_add(cells.found_count, i, 1)
        if n < cells.found_capacity:
            cells.found[i * cells.found_capacity + n] = partner

    @wp.func
    def append_triangles(
        model: Model, cells: Cells, i: int, w: int, k: int, position: wp.vec3d, reach: real, step: int
    ):
        """Add the triangles of wall `k` that are near to sphere `i`."""
        wall = w * walls_each + k
        facets = model.facets[wall]
        if facets.count == 0:
            return
        q = walls.to_mesh(walls.frame_of(model, wall, step), position)
        near = wp.float64(reach)
        # the tree's boxes are in float32, with an error of about 1e-7 of the mesh's size
        center = wp.vec3(float(q[0]), float(q[1]), float(q[2]))
        half = float(reach) + 1.0e-6 * float(model.wall[wall].reach)
        corner = wp.vec3(half, half, half)
        query = wp.mesh_query_aabb(facets.bvh, center - corner, center + corner)
        t = int(0)
        while wp.mesh_query_aabb_next(query, t):
            d = triangles.from_triangle(model.triangle[facets.first + t], q)
            if wp.dot(d, d) < near * near:
                append(cells, i, model.grain_count * spheres_each + facets.number + t)

    @wp.func
    def find_walls(
        model: Model, world: World, grains: Grains, cells: Cells, w: int, i: int, a: precision.sphere,
        lane: int, lanes: int,
    ):  # fmt: skip
        """Add the walls and triangles that are near to sphere `i`, a wall per lane."""
        reach = pack.last(a) + world.skin + world.reach
        place = pack.place(a, world)
        for k in range(lane, walls_each, lanes):
            if walls.touches(model, w, k, place, reach, grains.step[w]):
                append(cells, i, model.grain_count * spheres_each + k)
            if wp.static(build.has_mesh):
                append_triangles(model, cells, i, w, k, place, reach, grains.step[w])

    def warp_search(
        threads: int, model: Model, grains: Grains, stale: wp.array(dtype=int), near: Near, cells: Cells
    ):
        """Find the partners of each sphere that searches, with a lane per cell if few search.

        If only some grains have moved, these search for the others, too.
        """
        thread = wp.tid()
        count = cells.seekers[0]
        sharing = int(WARP)
        while sharing > 1 and count * sharing > threads:
            sharing = sharing // 2
        lane = thread % sharing
        for n in range(thread // sharing, count, threads // sharing):
            slot = cells.seeker[n]
            w = slot // (spheres_each * model.grain_count)
            first = w * spheres_each * model.grain_count
            i = cells.order[slot]
            world = model.world[w]
            a = pack.load_sphere(cells.ordered, slot)
            reach = pack.last(a) + world.skin + world.reach
            c = cell_of(a, world)
            for m in range(lane, CELLS_AROUND, sharing):
                x, y = around(c[0] + m % 3 - 1, world), around(c[1] + (m // 3) % 3 - 1, world)
                b = bucket_of(x, y, c[2] + m // 9 - 1, cells.bits, w)
                begin = first + cells.bucket_start[b]
                for k in range(begin, begin + cells.bucket_size[b]):
                    q = pack.load_sphere(cells.ordered, k)
                    d = pack.difference(a, q, world)
                    touching = reach + pack.last(q)
                    if wp.dot(d, d) < touching * touching:
                        j = cells.order[k]
                        h = j // spheres_each
                        if h != i // spheres_each:
                            append(cells, i, j - first)
                            if stale[w] == SOME and near.moves[h] == 0:
                                append(cells, j, i - first)
            find_walls(model, world, grains, cells, w, i, a, lane, sharing)

    def serial_search(
        threads: int, model: Model, grains: Grains, stale: wp.array(dtype=int), near: Near, cells: Cells
    ):
        """Find the partners of each sphere in a single thread.

        Each pair is found once, in its own bucket and the half of the buckets after it; only the earlier
        grain lists the other. If only some grains have moved, these alone search, also for the others.
        """
        slot = wp.tid()
        w = slot // (spheres_each * model.grain_count)
        first = w * spheres_each * model.grain_count
        if stale[w] == 0 or slot - first >= cells.cursor[w]:
            return
        i = cells.order[slot]
        g = i // spheres_each
        alone = stale[w] == SOME
        if alone and near.moves[g] == 0:
            return
        world = model.world[w]
        a = pack.load_sphere(cells.ordered, slot)
        reach = pack.last(a) + world.skin + world.reach
        c = cell_of(a, world)
        for n in range(wp.where(alone, 0, OWN_CELL), CELLS_AROUND):
            x, y = around(c[0] + n % 3 - 1, world), around(c[1] + (n // 3) % 3 - 1, world)
            b = bucket_of(x, y, c[2] + n // 9 - 1, cells.bits, w)
            begin = first + cells.bucket_start[b]
            end = begin + cells.bucket_size[b]
            if not alone and n == OWN_CELL:
                begin = slot + 1
            for k in range(begin, end):
                q = pack.load_sphere(cells.ordered, k)
                d = pack.difference(a, q, world)
                touching = reach + pack.last(q)
                if wp.dot(d, d) < touching * touching:
                    j = cells.order[k]
                    h = j // spheres_each
                    if h != g and (not alone or h > g or near.moves[h] == 0):
                        append(cells, wp.min(i, j), wp.max(i, j) - first)
        find_walls(model, world, grains, cells, w, i, a, 0, 1)

    own_search = warp_search if build.cooperative else serial_search
    search = wp.kernel(own_search, module=module, grid_stride=False)

    return SimpleNamespace(
        bin_spheres=bin_spheres,
        open_buckets=open_buckets,
        fill_buckets=fill_buckets,
        search=search,
        module=module,
    )
