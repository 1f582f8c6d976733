"""The step: forces, motion and new sphere positions of every grain of every running world, in one launch."""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.kernels.lanes import WARP, prefetcher
from dem_warp.kernels.motion import motion_functions
from dem_warp.kernels.packing import packing
from dem_warp.kernels.summation import cooperative_sum, serial_sum
from dem_warp.types import Build, device_structs


@functools.cache
def step_kernels(build: Build) -> SimpleNamespace:
    """Return `step`, `remove` and `place_spheres` of one build."""
    precision = build.precision
    types = device_structs(precision)
    Model, Grains, Neighbours = types.Model, types.Grains, types.Neighbours
    pack = packing(precision, build.is_periodic)
    motion = motion_functions(build)
    sum_contacts, add_contacts = cooperative_sum(build), serial_sum(build)
    prefetch_item, prefetch_turn, prefetch_place, prefetch_four = (
        prefetcher(kind) for kind in (wp.vec2i, wp.quatd, wp.vec3d, precision.vec4)
    )
    module = wp.get_module(f"dem_warp_step_{build.name}")
    wp.set_module_options(
        {"fast_math": build.cooperative and precision.is_fixed_point, "enable_backward": False}, module
    )

    # five blocks per multiprocessor instead of four; laws beyond the base need the registers
    is_base = precision.is_fixed_point and build.has_base_law and not build.has_mesh
    limits = {"cuda_max_registers": 96} if is_base else {}

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
        """Step `slot_count` grain slots of `running` worlds, with `lanes` threads per grain."""
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
            moving = alive[g] > 0 and neighbours.near.afar[g] == 0
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
            motion.move(
                model, grains_in, grains_out, neighbours, alive,
                flags, w, g, step, force, torque, rolling,
                lane, lanes,
            )  # fmt: skip
        elif slot < slot_count and alive[g] < 0 and lane == 0:
            motion.clear_spheres(model, grains_out, g)
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
        """Step `slot_count` grain slots of `running` worlds in a single thread.

        The order of the grains determines the sums of their contacts.
        """
        for r in range(slot_count // model.grain_count):
            w = int(r)
            if slot_count < alive.shape[0]:
                w = running[r]
            step = grains_in.step[w]
            grains_out.step[w] = step + 1
            for g in range(w * model.grain_count, (w + 1) * model.grain_count):
                add_contacts(model, grains_in, neighbours, w, g, step)
            motion.move_world(model, grains_in, grains_out, neighbours, alive, flags, w, step)

    own_step = warp_step if build.cooperative else serial_step
    step = wp.kernel(own_step, module=module, grid_stride=False, **limits)

    @wp.kernel(module=module)
    def remove(model: Model, removed: wp.array(dtype=int), alive: wp.array(dtype=int), a: Grains, b: Grains):
        """Remove the grains listed in `removed` from both copies of the state."""
        g = removed[wp.tid()]
        alive[g] = 0
        motion.clear_spheres(model, a, g)
        motion.clear_spheres(model, b, g)

    @wp.kernel(module=module)
    def place_spheres(model: Model, grains: Grains):
        """Set centres and spheres from the poses; the last component of a centre is the size factor."""
        g = wp.tid()
        world = model.world[g // model.grain_count]
        center = pack.pack(grains.position[g], pack.last(grains.center[g]), world)
        grains.center[g] = center
        motion.spread_spheres(model, world, grains, g, center, motion.rounded(grains.orientation[g]), 0, 1)

    return SimpleNamespace(step=step, place_spheres=place_spheres, remove=remove, module=module)
