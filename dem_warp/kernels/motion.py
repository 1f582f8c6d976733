"""Motion of the grains under the forces of a step, and the new places of their spheres.

On a GPU the lanes of a grain share its spheres. On a CPU the grains of a block move at once: their numbers
are contiguous, so that the compiler vectorises a loop without branches.
"""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.kernels.integration import integration_functions
from dem_warp.kernels.packing import packing
from dem_warp.types import Build, WorldFlag, device_structs

DIVERGED = wp.constant(int(WorldFlag.DIVERGED))
LEAVING = wp.constant(-2)
"""State of a grain whose spheres must still be removed from both copies of the state."""
BLOCK = 8
"""Grains that a CPU moves at once: the 64-bit numbers of its longest vector instructions."""


@functools.cache
def motion_functions(build: Build) -> SimpleNamespace:
    """Return the functions that move grains and place their spheres, of one build."""
    precision = build.precision
    real, vec3, vec4, quat, sphere = (
        precision.real, precision.vec3, precision.vec4, precision.quat, precision.sphere,
    )  # fmt: skip
    # a column for each grain of a block
    singles, triples = wp.types.vector(BLOCK, real), wp.types.matrix((3, BLOCK), real)
    places, turns = wp.types.matrix((3, BLOCK), wp.float64), wp.types.matrix((4, BLOCK), wp.float64)
    types = device_structs(precision)
    Model, World, Grains, Neighbours = types.Model, types.World, types.Grains, types.Neighbours
    pack = packing(precision, build.is_periodic)
    integration = integration_functions(precision)
    spheres_each = wp.constant(build.sphere_count)

    @wp.func
    def spread_spheres(
        model: Model, world: World, out: Grains, g: int, center: sphere, q: quat, lane: int, lanes: int
    ):
        """Set the sphere positions of a grain from its centre and orientation, a sphere per lane."""
        size = pack.last(center)
        shape = model.shape[g]
        for i in range(lane, model.shape_sphere_count[shape], lanes):
            local = model.shape_spheres[shape * spheres_each + i] * size
            offset = wp.quat_rotate(q, vec3(local[0], local[1], local[2]))
            pack.store_sphere(
                out.spheres, g * spheres_each + i, pack.pack_offset(center, offset, local[3], world)
            )

    @wp.func
    def clear_spheres(model: Model, out: Grains, g: int):
        """Remove a grain's spheres: with NaN as radius, nothing touches them."""
        for i in range(spheres_each):
            none = pack.load_sphere(out.spheres, g * spheres_each + i)
            none[3] = pack.no_radius()
            pack.store_sphere(out.spheres, g * spheres_each + i, none)

    @wp.func
    def left_domain(world: World, position: wp.vec3d) -> bool:
        d = position - world.origin
        h = world.half_extent
        return not (wp.abs(d[0]) < h[0] and wp.abs(d[1]) < h[1] and wp.abs(d[2]) < h[2])

    @wp.func
    def pushed(
        world: World, velocity: vec3, spin: vec3, turned: wp.quatd, mass: real, inertia: vec3,
        force: vec3, torque: vec3, rolling: real,
    ):  # fmt: skip
        """Return velocity, orientation and spin of a free grain after a step."""
        dt = world.time_step
        velocity += (force / mass + world.gravity) * dt
        velocity *= world.drag_factor  # last, where a factor of 1 changes no bit
        turned, spin = integration.turn(turned, spin, torque, inertia, rolling, dt, world.rolling_holds)
        return velocity, turned, spin

    @wp.func
    def within(world: World, place: wp.vec3d) -> wp.vec3d:
        """Return the image of a place in the period about the origin."""
        period = wp.float64(world.period) * wp.float64(world.unit)
        for axis in range(2):
            off = place[axis] - world.origin[axis]
            if off + off >= period:
                place[axis] = place[axis] - period
            elif off + off < -period:
                place[axis] = place[axis] + period
        return place

    @wp.func
    def moved(world: World, position: wp.vec3d, velocity: vec3) -> wp.vec3d:
        dt = world.time_step
        place = position + wp.vec3d(
            wp.float64(velocity[0] * dt), wp.float64(velocity[1] * dt), wp.float64(velocity[2] * dt)
        )
        if wp.static(build.is_periodic):
            place = within(world, place)
        return place

    @wp.func
    def fastest(velocity: vec3, spin: vec3, reach: real) -> real:
        """Return a bound of the speed of a grain's points [m/s]."""
        return wp.length(velocity) + wp.length(spin) * reach

    @wp.func
    def put(
        model: Model, world: World, grains: Grains, out: Grains, neighbours: Neighbours,
        alive: wp.array(dtype=int), flags: wp.array(dtype=int), w: int, g: int,
        position: wp.vec3d, velocity: vec3, turned: wp.quatd, spin: vec3, mass: real, speed: real,
        lane: int, lanes: int,
    ):  # fmt: skip
        """Store the new state of a grain: the first lane its pose, each lane some spheres."""
        center = pack.pack(position, pack.last(pack.load_sphere(grains.center, g)), world)
        if lane == 0:
            out.position[g] = position
            out.orientation[g] = turned
            pack.store_vec4(out.velocity, g, vec4(velocity[0], velocity[1], velocity[2], mass))
            pack.store_vec4(out.spin, g, vec4(spin[0], spin[1], spin[2], real(0.0)))
            pack.store_sphere(out.center, g, center)
            neighbours.travel[g] = neighbours.travel[g] + speed * world.time_step
            if not (speed < world.speed_limit):
                wp.atomic_or(flags, w, DIVERGED)
            if left_domain(world, position):
                alive[g] = LEAVING
        spread_spheres(model, world, out, g, center, integration.rounded(turned), lane, lanes)

    @wp.func
    def move(
        model: Model, grains: Grains, out: Grains, neighbours: Neighbours, alive: wp.array(dtype=int),
        flags: wp.array(dtype=int), w: int, g: int, step: int, force: vec3, torque: vec3, rolling: real,
        lane: int, lanes: int,
    ):  # fmt: skip
        """Compute the new pose, velocity, spin and spheres of a grain in every lane, and store them."""
        world = model.world[w]
        v4 = pack.load_vec4(grains.velocity, g)
        w4 = pack.load_vec4(grains.spin, g)
        velocity = vec3(v4[0], v4[1], v4[2])
        spin = vec3(w4[0], w4[1], w4[2])
        turned = grains.orientation[g]
        inertia = model.inertia[g]
        if step >= model.release_step[g]:
            velocity, turned, spin = pushed(
                world, velocity, spin, turned, v4[3], vec3(inertia[0], inertia[1], inertia[2]),
                force, torque, rolling,
            )  # fmt: skip
        position = moved(world, grains.position[g], velocity)
        speed = fastest(velocity, spin, inertia[3])
        put(
            model, world, grains, out, neighbours, alive, flags, w, g,
            position, velocity, turned, spin, v4[3], speed, lane, lanes,
        )  # fmt: skip

    @wp.func
    def wait(model: Model, world: World, grains: Grains, out: Grains, g: int, steps: int):
        """Move a grain that waits on by some steps in both copies, a step at a time for the same bits."""
        v4 = pack.load_vec4(grains.velocity, g)
        position = grains.position[g]
        for _step in range(steps):
            position = moved(world, position, vec3(v4[0], v4[1], v4[2]))
        center = pack.pack(position, pack.last(pack.load_sphere(grains.center, g)), world)
        turned = integration.rounded(grains.orientation[g])
        grains.position[g] = position
        out.position[g] = position
        pack.store_sphere(grains.center, g, center)
        pack.store_sphere(out.center, g, center)
        spread_spheres(model, world, grains, g, center, turned, 0, 1)
        spread_spheres(model, world, out, g, center, turned, 0, 1)

    @wp.func
    def taken(neighbours: Neighbours, g: int):
        """Return force with rolling torque, and torque, of a grain, and reset them."""
        force = pack.load_vec4(neighbours.reactions.force, g)
        torque = pack.load_vec4(neighbours.reactions.torque, g)
        pack.store_vec4(neighbours.reactions.force, g, vec4())
        pack.store_vec4(neighbours.reactions.torque, g, vec4())
        return force, torque

    @wp.func
    def gathered(model: Model, grains: Grains, neighbours: Neighbours, first: int, count: int):
        """Gather `count` grains from `first` on in columns, with their forces."""
        position = places()
        turned = turns()
        velocity = triples()
        spin = triples()
        force = triples()
        torque = triples()
        inertia = triples()
        mass = singles()
        rolling = singles()
        reach = singles()
        for k in range(count):
            g = first + k
            p = grains.position[g]
            q = grains.orientation[g]
            v4 = pack.load_vec4(grains.velocity, g)
            w4 = pack.load_vec4(grains.spin, g)
            i4 = model.inertia[g]
            f4, t4 = taken(neighbours, g)
            for n in range(3):
                position[n, k] = p[n]
                velocity[n, k] = v4[n]
                spin[n, k] = w4[n]
                force[n, k] = f4[n]
                torque[n, k] = t4[n]
                inertia[n, k] = i4[n]
            for n in range(4):
                turned[n, k] = q[n]
            mass[k] = v4[3]
            rolling[k] = f4[3]
            reach[k] = i4[3]
        return position, turned, velocity, spin, force, torque, inertia, mass, rolling, reach

    @wp.func
    def advanced(
        world: World, free: int, position: places, turned: turns, velocity: triples, spin: triples,
        force: triples, torque: triples, inertia: triples, mass: singles, rolling: singles, reach: singles,
    ):  # fmt: skip
        """Return the state of a block after a step, and its speeds; bits of `free` mark free grains."""
        k = int(0)
        while k < wp.static(BLOCK):  # a compiler cannot vectorise Warp's loops over ranges
            v, q, s = pushed(
                world,
                vec3(velocity[0, k], velocity[1, k], velocity[2, k]),
                vec3(spin[0, k], spin[1, k], spin[2, k]),
                wp.quatd(turned[0, k], turned[1, k], turned[2, k], turned[3, k]),
                mass[k],
                vec3(inertia[0, k], inertia[1, k], inertia[2, k]),
                vec3(force[0, k], force[1, k], force[2, k]),
                vec3(torque[0, k], torque[1, k], torque[2, k]),
                rolling[k],
            )
            is_free = (free >> k) & 1 == 1
            for n in range(3):
                velocity[n, k] = wp.where(is_free, v[n], velocity[n, k])
                spin[n, k] = wp.where(is_free, s[n], spin[n, k])
            for n in range(4):
                turned[n, k] = wp.where(is_free, q[n], turned[n, k])
            v = vec3(velocity[0, k], velocity[1, k], velocity[2, k])
            p = moved(world, wp.vec3d(position[0, k], position[1, k], position[2, k]), v)
            for n in range(3):
                position[n, k] = p[n]
            reach[k] = fastest(v, vec3(spin[0, k], spin[1, k], spin[2, k]), reach[k])
            k += 1
        return position, turned, velocity, spin, reach

    @wp.func
    def move_block(
        model: Model, world: World, grains: Grains, out: Grains, neighbours: Neighbours,
        alive: wp.array(dtype=int), flags: wp.array(dtype=int), w: int, first: int, count: int, step: int,
    ):  # fmt: skip
        """Move `count` grains from `first` on."""
        position, turned, velocity, spin, force, torque, inertia, mass, rolling, reach = gathered(
            model, grains, neighbours, first, count
        )
        free = int(0)
        for k in range(count):
            free |= wp.where(step >= model.release_step[first + k], 1 << k, 0)
        position, turned, velocity, spin, speed = advanced(
            world, free, position, turned, velocity, spin, force, torque, inertia, mass, rolling, reach
        )
        for k in range(count):
            g = first + k
            if alive[g] > 0:
                put(
                    model, world, grains, out, neighbours, alive, flags, w, g,
                    wp.vec3d(position[0, k], position[1, k], position[2, k]),
                    vec3(velocity[0, k], velocity[1, k], velocity[2, k]),
                    wp.quatd(turned[0, k], turned[1, k], turned[2, k], turned[3, k]),
                    vec3(spin[0, k], spin[1, k], spin[2, k]),
                    mass[k], speed[k], 0, 1,
                )  # fmt: skip
            elif alive[g] < 0:
                clear_spheres(model, out, g)
                alive[g] = alive[g] + 1

    @wp.func
    def move_world(
        model: Model, grains: Grains, out: Grains, neighbours: Neighbours, alive: wp.array(dtype=int),
        flags: wp.array(dtype=int), w: int, step: int,
    ):  # fmt: skip
        """Move all grains of a world, block by block."""
        world = model.world[w]
        for start in range(0, model.grain_count, wp.static(BLOCK)):
            first = w * model.grain_count + start
            count = wp.min(wp.static(BLOCK), model.grain_count - start)
            move_block(model, world, grains, out, neighbours, alive, flags, w, first, count, step)

    return SimpleNamespace(
        move=move,
        wait=wait,
        move_world=move_world,
        spread_spheres=spread_spheres,
        clear_spheres=clear_spheres,
        rounded=integration.rounded,
    )
