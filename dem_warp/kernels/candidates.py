"""Validity of the neighbour lists, and the candidates for contacts in the next steps.

The speeds of a grain and of its neighbours limit its path. The next steps use only the entries of a list that
are nearer than the paths of the two. Afterwards a world is flagged if a grain came farther.
"""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.entries import max_partners
from dem_warp.kernels.contacts import contact_functions
from dem_warp.kernels.lanes import WARP, bit_count, lanes_with, largest_of_warp
from dem_warp.kernels.motion import motion_functions
from dem_warp.kernels.packing import packing
from dem_warp.kernels.stale import ALL, SOME
from dem_warp.kernels.walls import wall_functions
from dem_warp.types import Build, WorldFlag, device_structs

LONGEST_CYCLE = 64
"""Most steps between two checks."""

HEADROOM = 4.0
"""Allowed speed of a grain over its present speed: an impact makes a falling grain spin."""

STRUCK = 2.0
"""Allowed speed of a grain after a collision over that of its fastest neighbour."""

SHAKEN = 0.25
"""Allowed speed of a grain over that of the fastest grain or wall of its world."""

EXPECTED = 1.5
"""Expected speed of a grain over its present speed."""

KEPT = 0.9
"""Least assumed speed of a grain over that at the last check, for grains that rattle."""

LEAST_PATH = 0.025
"""Least allowed path over the skin: grains at rest may be set in motion."""

JOINED = 0.25
"""Used part of the skin (up to one half) above which a world joins another world's rebuild."""

MOVED, MOVED_SERIAL = 0.1, 0.4
"""Used part of the skin (up to one half) above which a grain joins the rebuild of another one, on a GPU and
on a CPU."""

CLEARANCE = 2.0
"""Distance of a waiting grain from all free grains, over the skin, above which it has no list: until the next
check each of two moves at most half a skin, and lists reach one skin."""

PACE_LANES = 8
"""Threads that raise a grain's pace on a GPU."""

LATE_REBUILD = wp.constant(int(WorldFlag.LATE_REBUILD))


@functools.cache
def candidate_kernels(build: Build) -> SimpleNamespace:
    """Return the kernels to launch before some steps, in this order, and `find_fastest`; they need no law."""
    precision = build.precision
    real = precision.real
    types = device_structs(precision)
    Model, World, Grains, Neighbours = types.Model, types.World, types.Grains, types.Neighbours
    pack = packing(precision, build.is_periodic)
    contacts, motion, walls = contact_functions(build), motion_functions(build), wall_functions(build)
    spheres_each = wp.constant(build.sphere_count)
    mask = wp.constant(max_partners(build.sphere_count) - 1)
    walls_each = wp.constant(build.wall_count)
    lanes, pace_lanes = (wp.constant(n if build.cooperative else 1) for n in (WARP, PACE_LANES))
    moved = wp.constant(MOVED if build.cooperative else MOVED_SERIAL)
    module = wp.get_module(f"dem_warp_candidates_{build.name}")
    wp.set_module_options({"enable_backward": False}, module)

    @wp.func
    def speed_of(model: Model, grains: Grains, g: int) -> float:
        """Return the speed of the fastest point of a grain [m/s]."""
        v = pack.load_vec4(grains.velocity, g)
        omega = pack.load_vec4(grains.spin, g)
        turning = wp.length(wp.vec3(float(omega[0]), float(omega[1]), float(omega[2])))
        return wp.length(wp.vec3(float(v[0]), float(v[1]), float(v[2]))) + turning * float(
            model.inertia[g][3]
        )

    @wp.func
    def farthest(world: World, pace: float, ahead: int) -> real:
        """Return the longest path of a grain at a speed, and falling, in some steps [m]."""
        time = real(ahead) * world.time_step
        falling = real(HEADROOM) * wp.length(world.gravity) * time
        return wp.clamp((real(pace) + falling) * time, real(LEAST_PATH) * world.skin, real(0.5) * world.skin)

    @wp.func
    def wall_path(model: Model, world: World, grains: Grains, w: int, i: int, steps: int) -> real:
        """Return the longest path of a wall in some steps [m]."""
        index = w * walls_each + i
        time = wp.float64(steps) * wp.float64(world.time_step)
        frame = walls.frame_of(model, index, grains.step[w])
        return real(walls.path(model.wall[index], frame, world, time))

    @wp.func
    def rise(model: Model, world: World, neighbours: Neighbours, w: int, i: int, steps: int) -> real:
        """Return the longest path of a wall by the forces on it in some steps [m]; 0 if it is not free."""
        longest = real(0.0)
        if wp.static(build.has_free_wall):
            wall = model.wall[w * walls_each + i]
            if wall.mass > wp.float64(0.0):
                time = wp.float64(steps) * wp.float64(world.time_step)
                speed = wp.float64(HEADROOM) * wp.abs(neighbours.lift[w][1])
                path = real((speed + wp.abs(wall.force) / wall.mass * time) * time)
                longest = wp.clamp(path, real(LEAST_PATH) * world.skin, real(0.5) * world.skin)
        return longest

    @wp.func
    def risen(neighbours: Neighbours, w: int) -> real:
        """Return the path of the free wall since the last rebuild of all lists [m]; 0 without one."""
        path = real(0.0)
        if wp.static(build.has_free_wall):
            path = real(neighbours.lift[w][2])
        return path

    @wp.func
    def wall_speed(
        model: Model, world: World, grains: Grains, neighbours: Neighbours, w: int, i: int
    ) -> float:
        """Return the speed of a wall [m/s]."""
        speed = float(wall_path(model, world, grains, w, i, 1) / world.time_step)
        if wp.static(build.has_free_wall):
            speed += float(wp.abs(neighbours.lift[w][1]))
        return speed

    @wp.func
    def waits(model: Model, grains: Grains, w: int, g: int) -> bool:
        """Return True if a grain is released after the longest cycle."""
        return model.release_step[g] > grains.step[w] + wp.static(LONGEST_CYCLE)

    @wp.func
    def waits_afar(
        model: Model, world: World, grains: Grains, neighbours: Neighbours, w: int, g: int
    ) -> bool:
        """Return True if a grain waits so high that no free grain touches it before the next check."""
        lowest = float(grains.position[g][2]) - float(model.inertia[g][3])
        clearance = wp.static(CLEARANCE) * float(world.skin) + float(world.reach)
        return waits(model, grains, w, g) and lowest > neighbours.near.top[w] + clearance

    @wp.func
    def uses_up(
        model: Model, world: World, grains: Grains, neighbours: Neighbours, g: int, ahead: int, part: real
    ) -> bool:
        """Return True if the path of a listed grain may exceed a part of the skin within some steps."""
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
        """Set the speeds, and mark a world in which a grain or a wall may use up half of the skin."""
        g = wp.tid()
        w = g // model.grain_count
        if idle[w] != 0:
            return
        world = model.world[w]
        for i in range(g % model.grain_count, walls_each, model.grain_count):
            further = rise(model, world, neighbours, w, i, ahead)
            path = wall_path(model, world, grains, w, i, ahead) + further
            wp.atomic_max(neighbours.near.wall_path, w, path)
            wp.atomic_max(neighbours.near.wall_speed, w, wall_speed(model, world, grains, neighbours, w, i))
            whole = wall_path(model, world, grains, w, i, grains.step[w] + ahead - neighbours.rebuilt[w])
            if real(2.0) * (whole + further + risen(neighbours, w)) > world.skin:
                wp.atomic_max(stale, w, ALL)
                any_stale[0] = 1
        neighbours.near.speed[g] = wp.max(speed_of(model, grains, g), float(KEPT) * neighbours.near.speed[g])
        own = float(HEADROOM) * neighbours.near.speed[g]
        neighbours.near.pace[g] = wp.max(own, float(SHAKEN) * fastest[w])
        afar = waits_afar(model, world, grains, neighbours, w, g)
        neighbours.near.afar[g] = wp.where(afar, 1, 0)
        if afar:
            neighbours.travel[g] = world.skin  # it gets a list as soon as it needs one
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
        """Mark the worlds that would soon be stale too: a rebuild of many takes about as long as of one."""
        g = wp.tid()
        w = g // model.grain_count
        if idle[w] == 0 and alive[g] > 0 and stale[w] == 0:
            if uses_up(model, model.world[w], grains, neighbours, g, ahead, real(JOINED)):
                stale[w] = SOME

    @wp.kernel(module=module, grid_stride=False)
    def raise_pace(
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
        """Raise the pace of a grain for neighbours that may hit it."""
        thread = wp.tid()
        g = thread // pace_lanes
        lane = thread - g * pace_lanes
        if g >= alive.shape[0]:
            return
        w = g // model.grain_count
        if idle[w] != 0 or alive[g] <= 0 or neighbours.near.afar[g] != 0:
            return
        world = model.world[w]
        pace = float(STRUCK) * fastest[w]
        if real(pace) * real(ahead) * world.time_step <= real(LEAST_PATH) * world.skin:
            # the world is too slow for the neighbours to matter
            if lane == 0:
                neighbours.near.pace[g] = wp.max(neighbours.near.pace[g], pace)
            return
        fastest_neighbour = float(0.0)
        for k in range(lane, neighbours.count[g], pace_lanes):
            partner = neighbours.entry[g * neighbours.capacity + k] & mask
            speed = neighbours.near.wall_speed[w]
            if partner < model.grain_count * spheres_each:
                j = w * model.grain_count + partner // spheres_each
                speed = neighbours.near.speed[j]
                if wp.static(not build.cooperative):
                    # the pair is in this list only
                    struck = float(STRUCK) * neighbours.near.speed[g]
                    neighbours.near.pace[j] = wp.max(neighbours.near.pace[j], struck)
            fastest_neighbour = wp.max(fastest_neighbour, speed)
        # a pace is never below HEADROOM times the own speed
        if float(STRUCK) * fastest_neighbour > float(HEADROOM) * neighbours.near.speed[g]:
            wp.atomic_max(neighbours.near.pace, g, float(STRUCK) * fastest_neighbour)

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
        """List, in order, the entries that may touch in the next steps; a warp per grain on a GPU."""
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
            # a single thread reads consecutive items from its cache
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
                if wp.static(build.has_free_wall):
                    lift = neighbours.lift[w]
                    before = wp.where(neighbours.rebuilt[w] == step, wp.float64(0.0), lift[2])
                    allowed = before
                    for i in range(walls_each):
                        allowed += wp.float64(rise(model, world, neighbours, w, i, ahead))
                    neighbours.lift[w] = wp.vec4d(lift[0], lift[1], before, allowed)

    @wp.kernel(module=module, grid_stride=False)
    def find_fastest(
        row: int,
        past: int,
        # model
        model: Model,
        # state in
        alive: wp.array(dtype=int),
        idle: wp.array(dtype=int),
        # state in and out
        grains: Grains,
        copy: Grains,
        neighbours: Neighbours,
        # state out
        fastest: wp.array(dtype=float),
        flags: wp.array(dtype=int),
    ):
        """Find each world's fastest grain or wall, and the highest point of its free grains.

        It has `row` threads per world, on a GPU whole warps that move waiting grains on by `past` steps, and
        flags worlds in which a grain moved farther than its lists allow.
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
                if wp.static(build.cooperative):
                    if past > 0 and neighbours.near.afar[g] != 0:
                        if past % 2 == 0:  # from the copy that was the present one before these steps
                            motion.wait(model, world, grains, copy, g, past)
                        else:
                            motion.wait(model, world, copy, grains, g, past)
                speed = speed_of(model, grains, g)
                if not waits(model, grains, w, g):
                    top = float(grains.position[g][2]) + float(model.inertia[g][3])
                travel = neighbours.travel[g]
                outruns = neighbours.near.afar[g] == 0 and real(2.0) * travel > world.skin
                if outruns or travel - neighbours.near.travel[g] > neighbours.near.path[g]:
                    wp.atomic_or(flags, w, LATE_REBUILD)
            for i in range(place, walls_each, model.grain_count):
                whole = wall_path(model, world, grains, w, i, grains.step[w] - neighbours.rebuilt[w])
                if real(2.0) * (whole + risen(neighbours, w)) > world.skin:
                    wp.atomic_or(flags, w, LATE_REBUILD)
                speed = wp.max(speed, wall_speed(model, world, grains, neighbours, w, i))
            if place == 0:
                neighbours.near.wall_path[w] = real(0.0)
                neighbours.near.wall_speed[w] = 0.0
                if wp.static(build.has_free_wall):
                    if neighbours.lift[w][2] > neighbours.lift[w][3]:
                        wp.atomic_or(flags, w, LATE_REBUILD)
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
        raise_pace=raise_pace,
        select_near=select_near,
        find_fastest=find_fastest,
        module=module,
    )
