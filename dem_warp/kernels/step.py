"""The step: forces, motion and new sphere positions of every grain of every running world, in one launch."""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.kernels.integration import integration_functions
from dem_warp.kernels.lanes import WARP, prefetcher
from dem_warp.kernels.packing import packing
from dem_warp.kernels.summation import cooperative_sum, serial_sum
from dem_warp.types import Build, WorldFlag, device_structs

DIVERGED = wp.constant(int(WorldFlag.DIVERGED))
LEAVING = -2  # a grain whose spheres have yet to be taken out of both copies of the state


@functools.cache
def step_kernels(build: Build) -> SimpleNamespace:
    """`step`, `remove` and `place_spheres` of one build."""
    precision = build.precision
    real, vec3, vec4, quat, sphere = (
        precision.real, precision.vec3, precision.vec4, precision.quat, precision.sphere,
    )  # fmt: skip
    types = device_structs(precision)
    Model, World, Grains, Neighbours = types.Model, types.World, types.Grains, types.Neighbours
    pack = packing(precision)
    motion = integration_functions(precision)
    sum_contacts = (cooperative_sum if build.cooperative else serial_sum)(build)
    prefetch_item, prefetch_turn, prefetch_place, prefetch_four = (
        prefetcher(kind) for kind in (wp.vec2i, wp.quatd, wp.vec3d, vec4)
    )
    spheres_each = wp.constant(build.sphere_count)
    module = wp.get_module(f"dem_warp_step_{build.name}")
    wp.set_module_options(
        {"fast_math": build.cooperative and precision.is_fixed_point, "enable_backward": False}, module
    )

    # five blocks find room on a multiprocessor instead of four; laws beyond the base need the registers
    is_base = precision.is_fixed_point and build.has_base_law and not build.has_mesh
    limits = {"cuda_max_registers": 96} if is_base else {}

    @wp.func
    def spread_spheres(
        model: Model, world: World, out: Grains, g: int, center: sphere, q: quat, lane: int, lanes: int
    ):
        """Sphere positions of a grain from its centre and orientation, a sphere a lane."""
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
        """Takes a grain's spheres out: compared with a radius that is not a number, nothing touches."""
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
    def move(
        model: Model, grains: Grains, out: Grains, neighbours: Neighbours, alive: wp.array(dtype=int),
        flags: wp.array(dtype=int), w: int, g: int, step: int, force: vec3, torque: vec3, rolling: real,
        lane: int, lanes: int,
    ):  # fmt: skip
        """New pose, velocity, spin and spheres of a grain; every lane works it out, the first stores it."""
        world = model.world[w]
        dt = world.time_step
        v4 = pack.load_vec4(grains.velocity, g)
        w4 = pack.load_vec4(grains.spin, g)
        velocity = vec3(v4[0], v4[1], v4[2])
        spin = vec3(w4[0], w4[1], w4[2])
        turned = grains.orientation[g]
        inertia = model.inertia[g]
        if step >= model.release_step[g]:
            velocity += (force / v4[3] + world.gravity) * dt
            velocity *= world.kept  # last, where a factor of 1 changes no bit
            turned, spin = motion.turn(
                turned,
                spin,
                torque,
                vec3(inertia[0], inertia[1], inertia[2]),
                rolling,
                dt,
                world.rolling_holds,
            )
        position = grains.position[g] + wp.vec3d(
            wp.float64(velocity[0] * dt), wp.float64(velocity[1] * dt), wp.float64(velocity[2] * dt)
        )
        center = pack.pack(position, pack.last(pack.load_sphere(grains.center, g)), world)
        speed = wp.length(velocity) + wp.length(spin) * inertia[3]
        if lane == 0:
            out.position[g] = position
            out.orientation[g] = turned
            pack.store_vec4(out.velocity, g, vec4(velocity[0], velocity[1], velocity[2], v4[3]))
            pack.store_vec4(out.spin, g, vec4(spin[0], spin[1], spin[2], real(0.0)))
            pack.store_sphere(out.center, g, center)
            neighbours.travel[g] = neighbours.travel[g] + speed * dt
            if not (speed < world.speed_limit):
                wp.atomic_or(flags, w, DIVERGED)
            if left_domain(world, position):
                alive[g] = LEAVING
        spread_spheres(model, world, out, g, center, motion.rounded(turned), lane, lanes)

    def warp_step(
        lanes: int,
        slot_count: int,
        # model
        model: Model,
        # state in
        running: wp.array(dtype=int),
        grains_in: Grains,
        # state in and out
        neighbours: Neighbours,
        alive: wp.array(dtype=int),
        flags: wp.array(dtype=int),
        # state out
        grains_out: Grains,
    ):
        """Moves `slot_count` grain slots of `running` worlds on by a step; `lanes` threads a grain."""
        thread = wp.tid()
        slot = thread // lanes
        lane = thread - slot * lanes
        w = int(0)
        g = int(0)
        count = int(0)
        first = int(0)
        step = int(0)
        moving = bool(False)
        if slot < slot_count:
            w = slot // model.grain_count
            place = slot - w * model.grain_count
            if slot_count < alive.shape[0]:
                w = running[w]
            g = w * model.grain_count + place
            first = g * neighbours.capacity
            if lane == 0:
                prefetch_item(neighbours.near.item, first)
                prefetch_turn(grains_in.orientation, g)
                prefetch_place(grains_in.position, g)
                prefetch_four(model.inertia, g)
            count = neighbours.near.count[g]
            moving = alive[g] > 0
            step = grains_in.step[w]
            if wp.static(build.cooperative):
                if not moving or step < model.release_step[g]:
                    count = 0
            if lane == 0 and place == 0:
                grains_out.step[w] = step + 1
        force, torque, rolling = sum_contacts(
            model, grains_in, neighbours, w, g, count, first, step, thread & (WARP - 1), lane, lanes
        )
        if moving:
            move(
                model, grains_in, grains_out, neighbours, alive,
                flags, w, g, step, force, torque, rolling,
                lane, lanes,
            )  # fmt: skip
        elif slot < slot_count and alive[g] < 0 and lane == 0:
            clear_spheres(model, grains_out, g)
            alive[g] = alive[g] + 1

    def serial_step(
        lanes: int,
        slot_count: int,
        # model
        model: Model,
        # state in
        running: wp.array(dtype=int),
        grains_in: Grains,
        # state in and out
        neighbours: Neighbours,
        alive: wp.array(dtype=int),
        flags: wp.array(dtype=int),
        # state out
        grains_out: Grains,
    ):
        """The same by a single thread, as each of many would read the arguments anew.

        It takes the slots in their order, which the sums of their contacts rest on.
        """
        for slot in range(slot_count):
            w = slot // model.grain_count
            place = slot - w * model.grain_count
            if slot_count < alive.shape[0]:
                w = running[w]
            g = w * model.grain_count + place
            step = grains_in.step[w]
            if place == 0:
                grains_out.step[w] = step + 1
            force, torque, rolling = sum_contacts(
                model, grains_in, neighbours, w, g, neighbours.near.count[g], g * neighbours.capacity,
                step, 0, 0, 1,
            )  # fmt: skip
            if alive[g] > 0:
                move(
                    model, grains_in, grains_out, neighbours, alive,
                    flags, w, g, step, force, torque, rolling,
                    0, 1,
                )  # fmt: skip
            elif alive[g] < 0:
                clear_spheres(model, grains_out, g)
                alive[g] = alive[g] + 1

    own_step = warp_step if build.cooperative else serial_step
    step = wp.kernel(own_step, module=module, grid_stride=False, **limits)

    @wp.kernel(module=module)
    def remove(model: Model, removed: wp.array(dtype=int), alive: wp.array(dtype=int), a: Grains, b: Grains):
        """Takes the grains listed in `removed` out of both copies of the state."""
        g = removed[wp.tid()]
        alive[g] = 0
        clear_spheres(model, a, g)
        clear_spheres(model, b, g)

    @wp.kernel(module=module)
    def place_spheres(model: Model, grains: Grains):
        """Centres and spheres from the poses; the size factor is in the last component of the centre."""
        g = wp.tid()
        world = model.world[g // model.grain_count]
        center = pack.pack(grains.position[g], pack.last(grains.center[g]), world)
        grains.center[g] = center
        spread_spheres(model, world, grains, g, center, motion.rounded(grains.orientation[g]), 0, 1)

    return SimpleNamespace(step=step, place_spheres=place_spheres, remove=remove, module=module)
