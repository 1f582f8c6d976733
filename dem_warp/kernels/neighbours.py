"""Neighbour lists: every sphere of another grain, and every wall, nearer to a sphere than the skin.

On a GPU two grains have each other in their lists; on a CPU, which works each pair out once, the earlier one
has the other. Walls are numbered after the spheres of their world.

A list is sorted by the own sphere's number and then by the partner's, so its order, and with it the order of
a grain's force sum, depends on the grains alone: not on cells, skin, moment of the rebuild or batch.
Only worlds whose `stale` flag is set are rebuilt. A contact's history moves over to the new list with its
entry.
"""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.entries import partner_bits
from dem_warp.kernels.packing import packing
from dem_warp.laws.contact_law import memory_size
from dem_warp.types import Build, WorldFlag, device_structs

NEIGHBOUR_OVERFLOW = wp.constant(int(WorldFlag.NEIGHBOUR_OVERFLOW))


LIST_LANES = 8
"""Threads that share out the partners of a sphere on a GPU: about half as many as there are."""


def list_lanes(build: Build) -> int:
    """Threads a sphere that `write_lists` is to be launched with."""
    return LIST_LANES if build.cooperative else 1


@functools.cache
def neighbour_kernels(build: Build) -> SimpleNamespace:
    """The end of a rebuild, after the search: `write_lists` and `finish`."""
    precision = build.precision
    real, vec4 = precision.real, precision.vec4
    types = device_structs(precision)
    Model, Grains, Neighbours, Cells = types.Model, types.Grains, types.Neighbours, types.Cells
    pack = packing(precision)
    spheres_each = wp.constant(build.sphere_count)
    bits = wp.constant(partner_bits(build.sphere_count))
    memory_each = wp.constant(memory_size(build.mechanisms, build.forms))
    lanes = wp.constant(list_lanes(build))
    module = wp.get_module(f"dem_warp_neighbours_{build.name}")
    wp.set_module_options({"enable_backward": False}, module)

    @wp.func
    def place_of(array: wp.array(dtype=int), first: int, count: int, value: int, guess: int) -> int:
        """Index of the first of `count` sorted numbers that is not less than a value; walks from a guess."""
        place = wp.min(guess, count)
        while place > 0 and array[first + place - 1] >= value:
            place -= 1
        while place < count and array[first + place] < value:
            place += 1
        return place

    @wp.func
    def rank_of(array: wp.array(dtype=int), first: int, count: int, value: int) -> int:
        """Count of those among `count` numbers that are less than a value."""
        rank = int(0)
        for k in range(count):
            rank += wp.where(array[first + k] < value, 1, 0)
        return rank

    @wp.kernel(module=module, grid_stride=False)
    def write_lists(
        model: Model, stale: wp.array(dtype=int), cells: Cells, neighbours: Neighbours,
        flags: wp.array(dtype=int),
    ):  # fmt: skip
        """A sphere's part of its grain's new list, shared out to some lanes on a GPU.

        A partner's place is found by counting, as they are few. Histories come over from the old list.
        """
        thread = wp.tid()
        i = thread // lanes
        lane = thread - i * lanes
        g = i // spheres_each
        s = i - g * spheres_each
        w = g // model.grain_count
        if stale[w] == 0 or cells.rank[i] < 0:
            return
        world = model.world[w]
        before = int(0)
        for k in range(s):
            before += wp.min(cells.found_count[g * spheres_each + k], world.most_found)
        own = wp.min(cells.found_count[i], world.most_found)
        grain_total = model.shape.shape[0]
        old_row = neighbours.list[w] * grain_total + g
        new_row = (1 - neighbours.list[w]) * grain_total + g
        old_count = neighbours.count[old_row]
        old_first = old_row * neighbours.capacity
        found = i * cells.found_capacity
        for k in range(lane, own, lanes):
            partner = cells.found[found + k]
            place = before + rank_of(cells.found, found, own, partner)
            if place < world.most_listed:
                entry = (s << bits) | partner
                slot = new_row * neighbours.capacity + place
                history = vec4(real(0.0), real(0.0), real(0.0), real(-1.0))
                old = place_of(neighbours.entry, old_first, old_count, entry, place)
                if old < old_count and neighbours.entry[old_first + old] == entry:
                    history = pack.load_vec4(neighbours.history, old_first + old)
                    for m in range(memory_each):
                        remembered = neighbours.memory[(old_first + old) * memory_each + m]
                        neighbours.memory[slot * memory_each + m] = remembered
                neighbours.entry[slot] = entry
                pack.store_vec4(neighbours.history, slot, history)
        if lane == 0:
            # empty for the next time; every sphere of the bucket writes the same
            cells.bucket_size[cells.bucket[i]] = 0
            if cells.found_count[i] > world.most_found or before + own > world.most_listed:
                wp.atomic_or(flags, w, NEIGHBOUR_OVERFLOW)
            if s == model.shape_sphere_count[model.shape[g]] - 1:
                neighbours.count[new_row] = wp.min(before + own, world.most_listed)
                neighbours.travel[g] = real(0.0)

    @wp.kernel(module=module)
    def finish(
        grains: Grains, cells: Cells, neighbours: Neighbours,
        stale: wp.array(dtype=int), any_stale: wp.array(dtype=int), rebuilds: wp.array(dtype=int),
    ):  # fmt: skip
        w = wp.tid()
        if stale[w] != 0:
            neighbours.list[w] = 1 - neighbours.list[w]
            neighbours.rebuilt[w] = grains.step[w]
            stale[w] = 0
            cells.cursor[w] = 0
            rebuilds[w] = rebuilds[w] + 1
        if w == 0:
            any_stale[0] = 0

    return SimpleNamespace(write_lists=write_lists, finish=finish, module=module)
