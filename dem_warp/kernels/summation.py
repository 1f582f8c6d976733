"""Sum of a grain's contacts, in the order of its neighbour list, on one thread or by a warp of the GPU.

A single thread walks through the list and evaluates what touches. A GPU warp would leave most of its lanes
idle that way, as about one entry in four touches. So the warp first searches, each lane a stretch of its
grain's list, and queues what touches; then all lanes evaluate the queue, 32 contacts at once; then the
grains' lanes add up, component by component, in the order of the list. Both ways, and any number of lanes,
add the same floats in the same order.
"""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.kernels.contacts import contact_functions
from dem_warp.kernels.lanes import (
    WARP,
    any_lane,
    bit_count,
    from_lane,
    load_quad,
    lowest_bit,
    running_sum,
    shared,
    sync_warp,
)
from dem_warp.types import Build, device_structs

MIN_LANES = 4
STRETCH = 16
"""Entries that a lane searches before the queue is emptied; a multiple of QUAD."""

QUAD = 4
"""List entries that a lane loads at once."""

COMPONENTS = 7  # force, torque, rolling torque
QUEUE = WARP * STRETCH  # every lane's stretch, all touching
SUMS = COMPONENTS * WARP // MIN_LANES


@wp.func_native(shared("int", QUEUE))
def queue(index: int, value: int, write: bool) -> int: ...


@functools.cache
def serial_sum(build: Build):
    """Function that sums a grain's contacts on one thread."""
    real, vec3 = build.precision.real, build.precision.vec3
    types = device_structs(build.precision)
    Model, World, Grains, Neighbours = types.Model, types.World, types.Grains, types.Neighbours
    contacts = contact_functions(build)

    @wp.func
    def sum_contacts(
        model: Model, world: World, grains: Grains, hood: Neighbours, w: int, g: int, count: int, first: int,
        step: int, thread: int, lane: int, lanes: int,
    ):  # fmt: skip
        force = vec3()
        torque = vec3()
        rolling = real(0.0)
        for slot in range(first, first + count):
            if contacts.touches(model, world, grains, w, g, hood.entry[slot], step):
                f, t, r = contacts.contact(model, world, grains, hood, w, g, slot, step)
                force += f
                torque += t
                rolling += r
        return force, torque, rolling

    return sum_contacts


@functools.cache
def _totals(build: Build) -> SimpleNamespace:
    """Results of 32 contacts and sums of the grains, in the shared memory of a warp."""
    real, vec3 = build.precision.real, build.precision.vec3
    kind = "float" if build.precision.is_fixed_point else "double"

    @wp.func_native(shared(kind, COMPONENTS * (WARP + 1)))
    def result(index: int, value: real, write: bool) -> real: ...

    @wp.func_native(shared(kind, SUMS))
    def total(index: int, value: real, write: bool) -> real: ...

    @wp.func
    def clear(group: int, lane: int, lanes: int):
        for i in range(lane, COMPONENTS, lanes):
            total(group * COMPONENTS + i, real(0.0), True)

    @wp.func
    def write(thread: int, f: vec3, t: vec3, r: real):
        for i in range(3):
            result(i * (WARP + 1) + thread, f[i], True)
            result((i + 3) * (WARP + 1) + thread, t[i], True)
        result(6 * (WARP + 1) + thread, r, True)

    @wp.func
    def add(group: int, lane: int, lanes: int, begin: int, end: int):
        """Adds results `begin` to `end` to the group's sums, one component a lane, in order."""
        for i in range(lane, COMPONENTS, lanes):
            value = total(group * COMPONENTS + i, real(0.0), False)
            for k in range(begin, end):
                value += result(i * (WARP + 1) + k, real(0.0), False)
            total(group * COMPONENTS + i, value, True)

    @wp.func
    def read(group: int, i: int) -> real:
        return total(group * COMPONENTS + i, real(0.0), False)

    return SimpleNamespace(clear=clear, write=write, add=add, read=read)


@functools.cache
def cooperative_sum(build: Build):
    """Function that sums the contacts of a warp's grains; every lane of the warp must call it."""
    vec3 = build.precision.vec3
    types = device_structs(build.precision)
    Model, World, Grains, Neighbours = types.Model, types.World, types.Grains, types.Neighbours
    contacts = contact_functions(build)
    totals = _totals(build)

    @wp.func
    def search(
        model: Model,
        world: World,
        grains: Grains,
        hood: Neighbours,
        w: int,
        g: int,
        begin: int,
        end: int,
        step: int,
    ) -> int:
        """Bit set of the slots from `begin` to `end` that touch."""
        bits = int(0)
        for slot in range(begin, end, QUAD):
            quad = load_quad(hood.entry, slot)
            for k in range(QUAD):
                if slot + k < end:
                    if contacts.touches(model, world, grains, w, g, quad[k], step):
                        bits = bits | (1 << (slot + k - begin))
        return bits

    @wp.func
    def enqueue(bits: int, position: int, item: int):
        """Queues the items `item` + bit in order."""
        left = int(bits)
        at = int(position)
        while left != 0:
            queue(at, item + lowest_bit(left), True)
            left = left & (left - 1)
            at += 1

    @wp.func
    def sum_contacts(
        model: Model, world: World, grains: Grains, hood: Neighbours, w: int, g: int, count: int, first: int,
        step: int, thread: int, lane: int, lanes: int,
    ):  # fmt: skip
        """`count` is 0 for a lane whose grain takes no part; `thread` is the lane's number in the warp."""
        group = thread // lanes
        stretch = wp.min((((count + QUAD - 1) // QUAD + lanes - 1) // lanes) * QUAD, STRETCH)
        totals.clear(group, lane, lanes)
        begin = int(0)
        while any_lane(begin < count):
            mine = wp.min(begin + lane * stretch, count)
            bits = search(
                model, world, grains, hood, w, g, first + mine, first + wp.min(mine + stretch, count), step
            )
            begin += lanes * stretch
            through = running_sum(bit_count(bits))
            before = through - bit_count(bits)
            enqueue(bits, before, (group << 16) | mine)
            start = from_lane(before, group * lanes)
            end = from_lane(through, group * lanes + lanes - 1)
            queued = from_lane(through, WARP - 1)
            sync_warp()
            for batch in range(0, queued, WARP):
                item = int(0)
                if batch + thread < queued:
                    item = queue(batch + thread, 0, False)
                source = (item >> 16) * lanes
                gi = from_lane(g, source)
                wi = from_lane(w, source)
                slot = from_lane(first, source) + (item & 0xFFFF)
                step_i = from_lane(step, source)
                if batch + thread < queued:
                    f, t, r = contacts.contact(model, model.world[wi], grains, hood, wi, gi, slot, step_i)
                    totals.write(thread, f, t, r)
                sync_warp()
                totals.add(group, lane, lanes, wp.max(start - batch, 0), wp.min(end - batch, WARP))
                sync_warp()
        sync_warp()
        force = vec3(totals.read(group, 0), totals.read(group, 1), totals.read(group, 2))
        torque = vec3(totals.read(group, 3), totals.read(group, 4), totals.read(group, 5))
        return force, torque, totals.read(group, 6)

    return sum_contacts
