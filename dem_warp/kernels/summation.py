"""Sum of the contacts of a grain, in the order of its neighbour list.

On a CPU a single thread takes the grains in order and adds the opposite of each force to the partner. The
lanes of a GPU warp share the candidates of all its grains, 32 items at once; then the grains' lanes add up in
the order of the list. Any number of lanes adds the same floats; items without contact add zero.
"""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.kernels.contacts import contact_functions
from dem_warp.kernels.lanes import WARP, from_lane, running_sum, shared, sync_warp
from dem_warp.kernels.packing import packing
from dem_warp.types import Build, device_structs

MIN_LANES = 2
COMPONENTS = 7  # force, torque, rolling torque
ADDERS = 8
"""Lanes that sum one grain's components; a power of two."""

SUMS = COMPONENTS * WARP // MIN_LANES


@functools.cache
def serial_sum(build: Build):
    """Return a function that adds a grain's contacts to its reactions, for the grains of a world in order."""
    real, vec3, vec4 = build.precision.real, build.precision.vec3, build.precision.vec4
    types = device_structs(build.precision)
    Model, Grains, Neighbours = types.Model, types.Grains, types.Neighbours
    contacts = contact_functions(build)
    pack = packing(build.precision, build.is_periodic)

    @wp.func
    def add_contacts(model: Model, grains: Grains, neighbours: Neighbours, w: int, g: int, step: int):
        """Add the contacts of a grain; one that waits for its release has forces only on its partners."""
        f4 = pack.load_vec4(neighbours.reactions.force, g)
        t4 = pack.load_vec4(neighbours.reactions.torque, g)
        force = vec3(f4[0], f4[1], f4[2])
        torque = vec3(t4[0], t4[1], t4[2])
        rolling = f4[3]
        world = model.world[w]
        is_free = step >= model.release_step[g]
        first = neighbours.near.first[g]
        for item in range(first, first + neighbours.near.count[g]):
            if is_free or contacts.is_free(model, neighbours, w, item, step):
                f, t, r = contacts.contact(model, world, grains, neighbours, w, g, item, step)
                force += f
                torque += t
                rolling += r
        pack.store_vec4(neighbours.reactions.force, g, vec4(force[0], force[1], force[2], rolling))
        pack.store_vec4(neighbours.reactions.torque, g, vec4(torque[0], torque[1], torque[2], real(0.0)))

    return add_contacts


@functools.cache
def _totals(build: Build) -> SimpleNamespace:
    """Return functions on the results of 32 contacts and the grains' sums in a warp's shared memory."""
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
    def add(group: int, i: int, begin: int, end: int):
        """Add component `i` of the results from `begin` to `end` to the group's sum, in order."""
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
    """Return a function that sums the contacts of a warp's grains; every lane of the warp must call it."""
    vec3 = build.precision.vec3
    types = device_structs(build.precision)
    Model, Grains, Neighbours = types.Model, types.Grains, types.Neighbours
    contacts = contact_functions(build)
    totals = _totals(build)

    @wp.func
    def group_of(item: int, start: int, lanes: int) -> int:
        """Return the group of lanes of an item: the last group with `start` at or before it."""
        group = int(0)
        half = WARP // lanes // 2
        while half > 0:
            if from_lane(start, (group + half) * lanes) <= item:
                group += half
            half = half // 2
        return group

    @wp.func
    def add_up(thread: int, lanes: int, start: int, count: int, batch: int, group: int, last: int):
        """Add the results of a batch to the sums of its groups, several groups at once."""
        i = thread % ADDERS
        for n in range((last - group) // (WARP // ADDERS) + 1):
            own = group + n * (WARP // ADDERS) + thread // ADDERS
            begin = from_lane(start, own * lanes) - batch
            end = begin + from_lane(count, own * lanes)
            if own <= last and i < COMPONENTS:
                totals.add(own, i, wp.max(begin, 0), wp.min(end, WARP))

    @wp.func
    def sum_contacts(
        model: Model, grains: Grains, neighbours: Neighbours, w: int, g: int, count: int, first: int,
        step: int, thread: int, lane: int, lanes: int,
    ):  # fmt: skip
        """Sum the contacts; `count` is 0 for an inactive grain, `thread` is the lane's number in the warp."""
        group = thread // lanes
        totals.clear(group, lane, lanes)
        through = running_sum(wp.where(lane == 0, count, 0))
        start = from_lane(through, group * lanes) - count
        items = from_lane(through, WARP - 1)
        for batch in range(0, items, WARP):
            item = wp.min(batch + thread, items - 1)
            its_group = group_of(item, start, lanes)
            source = its_group * lanes
            place = item - from_lane(start, source)
            gi = from_lane(g, source)
            wi = from_lane(w, source)
            step_i = from_lane(step, source)
            first_i = from_lane(first, source)
            if batch + thread < items:
                f, t, r = contacts.contact(
                    model, model.world[wi], grains, neighbours, wi, gi, first_i + place, step_i
                )
                totals.write(thread, f, t, r)
            sync_warp()
            add_up(
                thread, lanes, start, count, batch, from_lane(its_group, 0), from_lane(its_group, WARP - 1)
            )
            sync_warp()
        sync_warp()
        force = vec3(totals.read(group, 0), totals.read(group, 1), totals.read(group, 2))
        torque = vec3(totals.read(group, 3), totals.read(group, 4), totals.read(group, 5))
        return force, torque, totals.read(group, 6)

    return sum_contacts
