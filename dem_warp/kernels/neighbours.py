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

from dem_warp.entries import max_partners, partner_bits
from dem_warp.kernels.contacts import contact_functions
from dem_warp.kernels.packing import packing
from dem_warp.kernels.stale import ALL
from dem_warp.laws.contact_law import memory_size
from dem_warp.types import Build, WorldFlag, device_structs

NEIGHBOUR_OVERFLOW = wp.constant(int(WorldFlag.NEIGHBOUR_OVERFLOW))


NO_ENTRY = wp.constant(2**31 - 1)
"""Above every entry."""

LIST_LANES = 8
"""Threads that share out the partners of a sphere on a GPU: about half as many as there are."""


def list_threads(build: Build) -> int:
    """Threads a grain that `write_lists` is to be launched with."""
    return LIST_LANES * build.sphere_count if build.cooperative else 1


@functools.cache
def neighbour_kernels(build: Build) -> SimpleNamespace:
    """The end of a rebuild, after the search: `write_lists` and `finish`."""
    precision = build.precision
    real, vec4 = precision.real, precision.vec4
    types = device_structs(precision)
    Model, Grains, Neighbours, Cells = types.Model, types.Grains, types.Neighbours, types.Cells
    World = types.World
    pack = packing(precision)
    contacts = contact_functions(build)
    spheres_each = wp.constant(build.sphere_count)
    bits = wp.constant(partner_bits(build.sphere_count))
    mask = wp.constant(max_partners(build.sphere_count) - 1)
    memory_each = wp.constant(memory_size(build.mechanisms, build.forms))
    lanes = wp.constant(LIST_LANES)
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
        model: Model, grains: Grains, stale: wp.array(dtype=int), cells: Cells, neighbours: Neighbours,
        flags: wp.array(dtype=int),
    ):  # fmt: skip
        """A sphere's part of its grain's new list, shared out to some lanes.

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

    @wp.func
    def sort(array: wp.array(dtype=int), first: int, count: int):
        """Sorts some numbers, which are few, in place."""
        for k in range(1, count):
            value = array[first + k]
            place = int(k)
            while place > 0 and array[first + place - 1] > value:
                array[first + place] = array[first + place - 1]
                place -= 1
            array[first + place] = value

    @wp.func
    def stays(
        model: Model, world: World, grains: Grains, neighbours: Neighbours, w: int, g: int, entry: int
    ) -> bool:
        """Tell that neither partner of an entry was searched, and that they are near: a grain or a wall."""
        partner = entry & mask
        if partner >= model.grain_count * spheres_each:
            return True
        if neighbours.near.moves[w * model.grain_count + partner // spheres_each] != 0:
            return False
        return contacts.nears(model, world, grains, w, g, entry, world.skin + world.reach, grains.step[w])

    @wp.func
    def put(neighbours: Neighbours, slot: int, entry: int, old: int):
        """Writes an entry, with the history of an old slot where there is one."""
        history = vec4(real(0.0), real(0.0), real(0.0), real(-1.0))
        if old >= 0:
            history = pack.load_vec4(neighbours.history, old)
            for m in range(memory_each):
                neighbours.memory[slot * memory_each + m] = neighbours.memory[old * memory_each + m]
        neighbours.entry[slot] = entry
        pack.store_vec4(neighbours.history, slot, history)

    @wp.kernel(module=module)
    def merge_lists(
        model: Model, grains: Grains, stale: wp.array(dtype=int), cells: Cells, neighbours: Neighbours,
        flags: wp.array(dtype=int),
    ):  # fmt: skip
        """A grain's new list by one thread: what was found, and of the old list what stays.

        The list of a grain that has not moved, and is a new partner of none that has, stays as it is. It may
        have partners that have moved away, which do no harm: they go with the next change.
        """
        g = wp.tid()
        w = g // model.grain_count
        if stale[w] == 0 or cells.rank[g * spheres_each] < 0:
            return
        world = model.world[w]
        moves = stale[w] == ALL or neighbours.near.moves[g] != 0
        changes = bool(moves)
        for i in range(g * spheres_each, g * spheres_each + model.shape_sphere_count[model.shape[g]]):
            changes = changes or cells.found_count[i] > 0
            # empty for the next time; every sphere of the bucket writes the same
            cells.bucket_size[cells.bucket[i]] = 0
        if not changes:
            return
        grain_total = model.shape.shape[0]
        first = g * neighbours.capacity
        # a row of the second list, which a single thread has no other use for
        draft = (grain_total + w * model.grain_count) * neighbours.capacity
        old = int(first)
        old_end = first + neighbours.count[g]
        place = int(0)
        for s in range(model.shape_sphere_count[model.shape[g]]):
            i = g * spheres_each + s
            own = wp.min(cells.found_count[i], world.most_found)
            if cells.found_count[i] > world.most_found:
                wp.atomic_or(flags, w, NEIGHBOUR_OVERFLOW)
            found = i * cells.found_capacity
            sort(cells.found, found, own)
            end = found + own
            of_sphere = bool(True)
            while found < end or of_sphere:
                listed = int(NO_ENTRY)
                if old < old_end:
                    if neighbours.entry[old] >> bits == s:
                        listed = neighbours.entry[old]
                of_sphere = listed != NO_ENTRY
                fresh = int(NO_ENTRY)
                if found < end:
                    fresh = (s << bits) | cells.found[found]
                entry = wp.min(listed, fresh)
                if entry != NO_ENTRY:
                    if entry == fresh or (not moves and stays(model, world, grains, neighbours, w, g, entry)):
                        if place < world.most_listed:
                            put(neighbours, draft + place, entry, wp.where(entry == listed, old, -1))
                        place += 1
                    old += wp.where(entry == listed, 1, 0)
                    found += wp.where(entry == fresh, 1, 0)
        if place > world.most_listed:
            wp.atomic_or(flags, w, NEIGHBOUR_OVERFLOW)
        count = wp.min(place, world.most_listed)
        for k in range(count):
            put(neighbours, first + k, neighbours.entry[draft + k], draft + k)
        neighbours.count[g] = count
        if moves:
            neighbours.travel[g] = real(0.0)

    @wp.kernel(module=module)
    def finish(
        grains: Grains, cells: Cells, neighbours: Neighbours,
        stale: wp.array(dtype=int), any_stale: wp.array(dtype=int), rebuilds: wp.array(dtype=int),
    ):  # fmt: skip
        w = wp.tid()
        if stale[w] != 0:
            if wp.static(build.cooperative):
                neighbours.list[w] = 1 - neighbours.list[w]
            if stale[w] == ALL:
                neighbours.rebuilt[w] = grains.step[w]
            stale[w] = 0
            cells.cursor[w] = 0
            rebuilds[w] = rebuilds[w] + 1
        if w == 0:
            any_stale[0] = 0

    written = write_lists if build.cooperative else merge_lists
    return SimpleNamespace(write_lists=written, finish=finish, module=module)
