"""Between two rebuilds: how fast a world is, whether its neighbour lists still hold, and what is near.

All is done for some steps ahead. From the speeds of a grain and of its neighbours, which may strike it,
follows how far it may come in that time, so that only the entries of a list that are nearer than the paths of
the two can touch: the step looks at these alone. Afterwards it is seen whether all kept to it; a world whose
grains did not is flagged. Grains that wait high above all others, as most do when a rain begins, touch nobody
and are left out.
"""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.entries import max_partners
from dem_warp.kernels.contacts import contact_functions
from dem_warp.kernels.lanes import WARP, bit_count, lanes_with, largest_of_warp
from dem_warp.kernels.packing import packing
from dem_warp.kernels.stale import ALL, SOME
from dem_warp.kernels.walls import wall_functions
from dem_warp.types import Build, WorldFlag, device_structs

LONGEST_CYCLE = 64
"""Steps between two looks at the most."""

HEADROOM = 4.0
"""Speed that a grain is allowed to reach, over what it has: an impact makes a falling grain spin."""

STRUCK = 2.0
"""Speed that a grain is allowed to reach when it is struck, over that of its fastest neighbour."""

SHAKEN = 0.25
"""The same over that of the fastest grain or wall of its world, which may strike it through others."""

EXPECTED = 1.5
"""Speed that a grain is expected to reach, over what it has."""

KEPT = 0.9
"""Part of its speed at a look that a grain is taken to have at the next: one that rattles rests at times."""

LEAST_PATH = 0.025
"""Part of the skin that is allowed for at the least: grains at rest may be set in motion."""

JOINED = 0.25
"""Part of the skin, up to one half, from which on a world joins a rebuild that another one calls for."""

MOVED, MOVED_SERIAL = 0.1, 0.4
"""Part of the skin, up to one half, from which on a grain is searched anew when another one of its world must
be: on a GPU, where all are looked at anyway, and on a CPU."""

CLEARANCE = 2.0
"""Skins between a grain that waits and all that move freely, from which on it is left out of the lists: each
of the two comes half a skin before the next look, and a skin is what lists are made for."""

LATE_REBUILD = wp.constant(int(WorldFlag.LATE_REBUILD))


@functools.cache
def watch_kernels(build: Build) -> SimpleNamespace:
    """Kernels to launch before some steps, in this order, and `find_fastest` for after them."""
    precision = build.precision
    real = precision.real
    types = device_structs(precision)
    Model, World, Grains, Neighbours = types.Model, types.World, types.Grains, types.Neighbours
    pack = packing(precision)
    contacts = contact_functions(build)
    walls = wall_functions(build.without_forces)
    spheres_each = wp.constant(build.sphere_count)
    mask = wp.constant(max_partners(build.sphere_count) - 1)
    walls_each = wp.constant(build.wall_count)
    lanes = wp.constant(WARP if build.cooperative else 1)
    moved = wp.constant(MOVED if build.cooperative else MOVED_SERIAL)
    module = wp.get_module(f"dem_warp_watch_{build.name}")
    wp.set_module_options({"enable_backward": False}, module)

    @wp.func
    def speed_of(model: Model, grains: Grains, g: int) -> float:
        """Of the fastest point of a grain [m/s]."""
        v = pack.load_vec4(grains.velocity, g)
        omega = pack.load_vec4(grains.spin, g)
        turning = wp.length(wp.vec3(float(omega[0]), float(omega[1]), float(omega[2])))
        return wp.length(wp.vec3(float(v[0]), float(v[1]), float(v[2]))) + turning * float(
            model.inertia[g][3]
        )

    @wp.func
    def farthest(world: World, pace: float, ahead: int) -> real:
        """Farthest that a grain comes in some steps, struck to reach a speed and falling besides [m]."""
        time = real(ahead) * world.time_step
        falling = real(HEADROOM) * wp.length(world.gravity) * time
        return wp.clamp((real(pace) + falling) * time, real(LEAST_PATH) * world.skin, real(0.5) * world.skin)

    @wp.func
    def wall_path(model: Model, world: World, grains: Grains, w: int, i: int, steps: int) -> real:
        """Farthest that a wall may come in some steps [m]."""
        index = w * walls_each + i
        time = wp.float64(steps) * wp.float64(world.time_step)
        frame = walls.frame_of(model, index, grains.step[w])
        return real(walls.path(model.wall[index], frame, world, time))

    @wp.func
    def waits(model: Model, grains: Grains, w: int, g: int) -> bool:
        """Tell whether a grain is released after the longest cycle that may come."""
        return model.release_step[g] > grains.step[w] + wp.static(LONGEST_CYCLE)

    @wp.func
    def waits_afar(
        model: Model, world: World, grains: Grains, neighbours: Neighbours, w: int, g: int
    ) -> bool:
        """Tell whether a grain waits so high that none that moves freely meets it before the next look."""
        lowest = float(grains.position[g][2]) - float(model.inertia[g][3])
        clearance = wp.static(CLEARANCE) * float(world.skin) + float(world.reach)
        return waits(model, grains, w, g) and lowest > neighbours.near.top[w] + clearance

    @wp.func
    def uses_up(
        model: Model, world: World, grains: Grains, neighbours: Neighbours, g: int, ahead: int, part: real
    ) -> bool:
        """Tell whether a grain in the lists may come farther than a part of the skin within some steps."""
        speed = real(EXPECTED * neighbours.near.speed[g])
        path = wp.max(speed * real(ahead) * world.time_step, real(LEAST_PATH) * world.skin)
        return neighbours.near.afar[g] == 0 and neighbours.travel[g] + path > part * world.skin

    @wp.kernel(module=module)
    def mark_stale(
        ahead: int,
        # model
        model: Model,
        # state in
        grains: Grains,
        alive: wp.array(dtype=int),
        idle: wp.array(dtype=int),
        fastest: wp.array(dtype=float),
        neighbours: Neighbours,
        # state out
        stale: wp.array(dtype=int),
        any_stale: wp.array(dtype=int),
    ):
        """Sets the speeds, and marks a world in which a grain or a wall may use up its half of the skin."""
        g = wp.tid()
        w = g // model.grain_count
        if idle[w] != 0:
            return
        world = model.world[w]
        if g % model.grain_count == 0:
            neighbours.near.wall_path[w] = real(0.0)
            neighbours.near.wall_speed[w] = 0.0
            for i in range(walls_each):
                path = wall_path(model, world, grains, w, i, ahead)
                neighbours.near.wall_path[w] = wp.max(neighbours.near.wall_path[w], path)
                speed = float(wall_path(model, world, grains, w, i, 1) / world.time_step)
                neighbours.near.wall_speed[w] = wp.max(neighbours.near.wall_speed[w], speed)
                whole = wall_path(model, world, grains, w, i, grains.step[w] + ahead - neighbours.rebuilt[w])
                if real(2.0) * whole > world.skin:
                    wp.atomic_max(stale, w, ALL)
                    any_stale[0] = 1
        neighbours.near.speed[g] = wp.max(speed_of(model, grains, g), float(KEPT) * neighbours.near.speed[g])
        own = float(HEADROOM) * neighbours.near.speed[g]
        neighbours.near.pace[g] = wp.max(own, float(SHAKEN) * fastest[w])
        afar = waits_afar(model, world, grains, neighbours, w, g)
        neighbours.near.afar[g] = wp.where(afar, 1, 0)
        if afar:
            neighbours.travel[g] = world.skin  # it is searched as soon as it needs a list
        moves = uses_up(model, world, grains, neighbours, g, ahead, real(moved))
        neighbours.near.moves[g] = wp.where(moves, 1, 0)
        if alive[g] > 0 and uses_up(model, world, grains, neighbours, g, ahead, real(0.5)):
            if stale[w] == 0:
                wp.atomic_max(stale, w, SOME)
            any_stale[0] = 1

    @wp.kernel(module=module)
    def join(
        ahead: int,
        # model
        model: Model,
        # state in
        grains: Grains,
        alive: wp.array(dtype=int),
        idle: wp.array(dtype=int),
        neighbours: Neighbours,
        # state out
        stale: wp.array(dtype=int),
    ):
        """Marks the worlds that would soon be stale too: a rebuild of many is hardly longer than of one."""
        g = wp.tid()
        w = g // model.grain_count
        if idle[w] == 0 and alive[g] > 0 and stale[w] == 0:
            if uses_up(model, model.world[w], grains, neighbours, g, ahead, real(JOINED)):
                stale[w] = SOME

    @wp.kernel(module=module, grid_stride=False)
    def heed_neighbours(
        ahead: int,
        # model
        model: Model,
        # state in
        alive: wp.array(dtype=int),
        idle: wp.array(dtype=int),
        fastest: wp.array(dtype=float),
        # state in and out
        neighbours: Neighbours,
    ):
        """Raises the pace of a grain for the neighbours that may strike it; a warp a grain on a GPU."""
        thread = wp.tid()
        g = thread // lanes
        lane = thread - g * lanes
        w = g // model.grain_count
        if idle[w] != 0 or alive[g] <= 0 or neighbours.near.afar[g] != 0:
            return
        world = model.world[w]
        pace = float(STRUCK) * fastest[w]
        if real(pace) * real(ahead) * world.time_step <= real(LEAST_PATH) * world.skin:
            # so slow a world that it hardly matters who strikes
            if lane == 0:
                neighbours.near.pace[g] = wp.max(neighbours.near.pace[g], pace)
            return
        striker = float(0.0)
        for k in range(lane, neighbours.count[g], lanes):
            partner = neighbours.entry[g * neighbours.capacity + k] & mask
            speed = neighbours.near.wall_speed[w]
            if partner < model.grain_count * spheres_each:
                j = w * model.grain_count + partner // spheres_each
                speed = neighbours.near.speed[j]
                if wp.static(not build.cooperative):
                    # this list alone has the two of them
                    struck = float(STRUCK) * neighbours.near.speed[g]
                    neighbours.near.pace[j] = wp.max(neighbours.near.pace[j], struck)
            striker = wp.max(striker, speed)
        striker = largest_of_warp(striker)
        if lane == 0:
            neighbours.near.pace[g] = wp.max(neighbours.near.pace[g], float(STRUCK) * striker)

    @wp.kernel(module=module, grid_stride=False)
    def select_near(
        ahead: int,
        # model
        model: Model,
        # state in
        grains: Grains,
        alive: wp.array(dtype=int),
        idle: wp.array(dtype=int),
        # state in and out
        neighbours: Neighbours,
        fastest: wp.array(dtype=float),
    ):
        """Lists, in order, the entries that may touch in the next steps; a warp a grain on a GPU."""
        thread = wp.tid()
        g = thread // lanes
        lane = thread - g * lanes
        w = g // model.grain_count
        if idle[w] != 0:
            return
        world = model.world[w]
        own = farthest(world, neighbours.near.pace[g], ahead)
        step = grains.step[w]
        count = neighbours.count[g]
        if alive[g] <= 0 or neighbours.near.afar[g] != 0:
            count = 0
        first = g * neighbours.capacity
        if wp.static(not build.cooperative):
            # a single thread reads items that follow each other, and finds them in its cache
            if g % model.grain_count != 0:
                first = neighbours.near.first[g - 1] + neighbours.near.count[g - 1]
            neighbours.near.first[g] = first
        found = int(first)
        for k in range(lane, count + lane, lanes):
            slot = g * neighbours.capacity + k
            entry = int(0)
            is_near = bool(False)
            if k < count:
                entry = neighbours.entry[slot]
                partner = entry & mask
                path = neighbours.near.wall_path[w]
                if partner < model.grain_count * spheres_each:
                    path = farthest(
                        world, neighbours.near.pace[w * model.grain_count + partner // spheres_each], ahead
                    )
                is_near = contacts.nears(model, world, grains, w, g, entry, world.reach + own + path, step)
            bits = lanes_with(is_near)
            if is_near:
                neighbours.near.item[found + bit_count(bits & ((1 << lane) - 1))] = wp.vec2i(entry, slot)
            found += bit_count(bits)
        if lane == 0:
            neighbours.near.count[g] = found - first
            neighbours.near.path[g] = own
            neighbours.near.travel[g] = neighbours.travel[g]
            if g % model.grain_count == 0:
                fastest[w] = 0.0
                neighbours.near.top[w] = -wp.inf

    @wp.kernel(module=module, grid_stride=False)
    def find_fastest(
        row: int,
        # model
        model: Model,
        # state in
        grains: Grains,
        alive: wp.array(dtype=int),
        idle: wp.array(dtype=int),
        neighbours: Neighbours,
        # state out
        fastest: wp.array(dtype=float),
        flags: wp.array(dtype=int),
    ):
        """Speed of the fastest grain or wall of each world, and highest point of the grains that do not wait.

        `row` threads a world, whole warps on a GPU. Flags the worlds in which a grain came farther than its
        lists allowed for.
        """
        thread = wp.tid()
        w = thread // row
        place = thread - w * row
        speed = float(0.0)
        top = float(-wp.inf)
        if idle[w] == 0 and place < model.grain_count:
            world = model.world[w]
            g = w * model.grain_count + place
            if alive[g] > 0:
                speed = speed_of(model, grains, g)
                if not waits(model, grains, w, g):
                    top = float(grains.position[g][2]) + float(model.inertia[g][3])
                travel = neighbours.travel[g]
                outruns = neighbours.near.afar[g] == 0 and real(2.0) * travel > world.skin
                if outruns or travel - neighbours.near.travel[g] > neighbours.near.path[g]:
                    wp.atomic_or(flags, w, LATE_REBUILD)
            if place == 0:
                for i in range(walls_each):
                    whole = wall_path(model, world, grains, w, i, grains.step[w] - neighbours.rebuilt[w])
                    if real(2.0) * whole > world.skin:
                        wp.atomic_or(flags, w, LATE_REBUILD)
                    speed = wp.max(speed, float(wall_path(model, world, grains, w, i, 1) / world.time_step))
        speed = largest_of_warp(speed)
        top = largest_of_warp(top)
        if thread % lanes == 0:
            if speed > 0.0:
                wp.atomic_max(fastest, w, speed)
            if top > -wp.inf:
                wp.atomic_max(neighbours.near.top, w, top)

    return SimpleNamespace(
        mark_stale=mark_stale,
        join=join,
        heed_neighbours=heed_neighbours,
        select_near=select_near,
        find_fastest=find_fastest,
        module=module,
    )
