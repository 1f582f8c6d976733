"""Neighbour lists: every sphere of another grain, and every wall, within the skin of a sphere.

On a GPU two grains list each other; on a CPU, which computes each pair once, the earlier one lists the other.
A list is sorted by the own sphere's number and then by the partner's (walls come last). So its order, and the
order of a grain's force sum, depends on the grains alone. Only worlds whose `stale` flag is set are rebuilt:
a new list is written as a draft, with the histories of the old one, and then copied into place.
"""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.entries import max_partners, partner_bits
from dem_warp.kernels.contacts import contact_functions
from dem_warp.kernels.lanes import WARP, bit_count, from_lane, lanes_with, running_sum, sync_warp
from dem_warp.kernels.packing import packing
from dem_warp.kernels.stale import ALL
from dem_warp.laws.contact_law import memory_size
from dem_warp.types import Build, WorldFlag, device_structs

NEIGHBOUR_OVERFLOW = wp.constant(int(WorldFlag.NEIGHBOUR_OVERFLOW))

NO_ENTRY = wp.constant(2**31 - 1)
"""Number above every entry."""


def list_threads(build: Build) -> int:
    """Return the threads per grain for `write_lists`."""
    return WARP if build.cooperative else 1


@functools.cache
def neighbour_kernels(build: Build) -> SimpleNamespace:
    """Return the kernels after the search: `write_lists` and `finish`."""
    precision = build.precision
    real, vec4 = precision.real, precision.vec4
    types = device_structs(precision)
    Model, Grains, Neighbours, Cells = types.Model, types.Grains, types.Neighbours, types.Cells
    World = types.World
    pack = packing(precision, build.is_periodic)
    contacts = contact_functions(build)
    spheres_each = wp.constant(build.sphere_count)
    bits = wp.constant(partner_bits(build.sphere_count))
    mask = wp.constant(max_partners(build.sphere_count) - 1)
    memory_each = wp.constant(memory_size(build.mechanisms, build.forms))
    module = wp.get_module(f"dem_warp_neighbours_{build.name}")
    wp.set_module_options({"enable_backward": False}, module)

    @wp.func
    def place_of(array: wp.array(dtype=int), first: int, count: int, value: int, guess: int) -> int:
        """Return the index of the first of `count` sorted numbers not below a value, from a guess."""
        place = wp.min(guess, count)
        while place > 0 and array[first + place - 1] >= value:
            place -= 1
        while place < count and array[first + place] < value:
            place += 1
        return place

    @wp.func
    def rank_of(array: wp.array(dtype=int), first: int, count: int, value: int) -> int:
        """Return how many of `count` numbers are below a value."""
        rank = int(0)
        for k in range(count):
            rank += wp.where(array[first + k] < value, 1, 0)
        return rank

    @wp.func
    def sort(array: wp.array(dtype=int), first: int, count: int):
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
        """Return True if an entry of the old list stays: its partner did not move and is near."""
        partner = entry & mask
        if partner >= model.grain_count * spheres_each:
            return True
        if neighbours.near.moves[w * model.grain_count + partner // spheres_each] != 0:
            return False
        return contacts.nears(model, world, grains, w, g, entry, world.skin + world.reach, grains.step[w])

    @wp.func
    def draft(neighbours: Neighbours, cells: Cells, place: int, entry: int, old: int):
        """Write an entry of a draft, with the history of an old slot if there is one."""
        history = vec4(real(0.0), real(0.0), real(0.0), real(-1.0))
        if old >= 0:
            history = pack.load_vec4(neighbours.history, old)
            for m in range(memory_each):
                cells.draft_memory[place * memory_each + m] = neighbours.memory[old * memory_each + m]
        cells.drafts[place] = entry
        pack.store_vec4(cells.draft_history, place, history)

    @wp.func
    def settle(neighbours: Neighbours, cells: Cells, slot: int, place: int):
        """Copy an entry of a draft into its list."""
        neighbours.entry[slot] = cells.drafts[place]
        pack.store_vec4(neighbours.history, slot, pack.load_vec4(cells.draft_history, place))
        for m in range(memory_each):
            neighbours.memory[slot * memory_each + m] = cells.draft_memory[place * memory_each + m]

    @wp.func
    def end_list(
        world: World, neighbours: Neighbours, flags: wp.array(dtype=int), w: int, g: int, length: int,
        moves: bool,
    ):  # fmt: skip
        """Set the length of a new list."""
        if length > world.list_limit:
            wp.atomic_or(flags, w, NEIGHBOUR_OVERFLOW)
        neighbours.count[g] = wp.min(length, world.list_limit)
        if moves:
            neighbours.travel[g] = real(0.0)

    @wp.func
    def found_of(world: World, cells: Cells, flags: wp.array(dtype=int), w: int, i: int) -> int:
        """Return the number of partners found of a sphere, and clear its bucket."""
        # every sphere of the bucket writes the same
        cells.bucket_size[cells.bucket[i]] = 0
        if cells.found_count[i] > world.found_limit:
            wp.atomic_or(flags, w, NEIGHBOUR_OVERFLOW)
        return wp.min(cells.found_count[i], world.found_limit)

    @wp.kernel(module=module)
    def merge_lists(
        model: Model, grains: Grains, stale: wp.array(dtype=int), cells: Cells, neighbours: Neighbours,
        flags: wp.array(dtype=int),
    ):  # fmt: skip
        """Merge the found partners with the entries that stay into a grain's new list, in one thread.

        The list of a grain that did not move, and has no new partner, stays. It may have partners that moved
        away, without harm; the next change removes them.
        """
        g = wp.tid()
        w = g // model.grain_count
        if stale[w] == 0 or cells.rank[g * spheres_each] < 0:
            return
        world = model.world[w]
        moves = stale[w] == ALL or neighbours.near.moves[g] != 0
        changes = bool(moves)
        for i in range(g * spheres_each, g * spheres_each + model.shape_sphere_count[model.shape[g]]):
            changes = found_of(world, cells, flags, w, i) > 0 or changes
        if not changes:
            return
        first = g * neighbours.capacity
        old = int(first)
        old_end = first + neighbours.count[g]
        place = int(0)
        for s in range(model.shape_sphere_count[model.shape[g]]):
            i = g * spheres_each + s
            own = wp.min(cells.found_count[i], world.found_limit)
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
                        if place < world.list_limit:
                            draft(neighbours, cells, place, entry, wp.where(entry == listed, old, -1))
                        place += 1
                    old += wp.where(entry == listed, 1, 0)
                    found += wp.where(entry == fresh, 1, 0)
        end_list(world, neighbours, flags, w, g, place, moves)
        for k in range(neighbours.count[g]):
            settle(neighbours, cells, first + k, k)

    @wp.func
    def count_found(world: World, cells: Cells, g: int, entry: int) -> int:
        """Return the number of found partners of a grain whose entries are below a given one."""
        s = entry >> bits
        less = int(0)
        for i in range(g * spheres_each, g * spheres_each + s):
            less += wp.min(cells.found_count[i], world.found_limit)
        i = g * spheres_each + s
        own = wp.min(cells.found_count[i], world.found_limit)
        return less + rank_of(cells.found, i * cells.found_capacity, own, entry & mask)

    @wp.func
    def kept_before(neighbours: Neighbours, slot: int, end: int, kept: int) -> int:
        """Return the number of entries that stay before a slot of a grain's old list."""
        if slot < end:
            return neighbours.near.item[slot][0]
        return kept

    @wp.kernel(module=module, grid_stride=False)
    def write_lists(
        model: Model, grains: Grains, stale: wp.array(dtype=int), cells: Cells, neighbours: Neighbours,
        flags: wp.array(dtype=int),
    ):  # fmt: skip
        """Write the same lists with a warp per grain: an entry's place is found by counting."""
        thread = wp.tid()
        g = thread // WARP
        lane = thread - g * WARP
        w = g // model.grain_count
        if stale[w] == 0 or cells.rank[g * spheres_each] < 0:
            return
        world = model.world[w]
        moves = stale[w] == ALL or neighbours.near.moves[g] != 0
        own = int(0)
        for s in range(lane, model.shape_sphere_count[model.shape[g]], WARP):
            own += found_of(world, cells, flags, w, g * spheres_each + s)
        found = from_lane(running_sum(own), WARP - 1)
        if not moves and found == 0:
            return
        first = g * neighbours.capacity
        old_count = neighbours.count[g]
        kept = int(0)
        if not moves:
            for k in range(lane, old_count + lane, WARP):
                entry = int(0)
                is_kept = bool(False)
                if k < old_count:
                    entry = neighbours.entry[first + k]
                    is_kept = stays(model, world, grains, neighbours, w, g, entry)
                kept_lanes = lanes_with(is_kept)
                place = kept + bit_count(kept_lanes & ((1 << lane) - 1))
                if k < old_count:
                    # the near entries are listed anew afterwards
                    neighbours.near.item[first + k] = wp.vec2i(place, 0)
                if is_kept:
                    place += count_found(world, cells, g, entry)
                    if place < world.list_limit:
                        draft(neighbours, cells, first + place, entry, first + k)
                kept += bit_count(kept_lanes)
        sync_warp()
        for k in range(lane, found, WARP):
            i = g * spheres_each
            rest = int(k)
            while rest >= wp.min(cells.found_count[i], world.found_limit):
                rest -= wp.min(cells.found_count[i], world.found_limit)
                i += 1
            entry = ((i - g * spheres_each) << bits) | cells.found[i * cells.found_capacity + rest]
            place = count_found(world, cells, g, entry)
            old = place_of(neighbours.entry, first, old_count, entry, place)
            if not moves:
                place += kept_before(neighbours, first + old, first + old_count, kept)
            slot = int(-1)
            if old < old_count:
                if neighbours.entry[first + old] == entry:
                    slot = first + old
            if place < world.list_limit:
                draft(neighbours, cells, first + place, entry, slot)
        sync_warp()
        length = kept + found
        for k in range(lane, wp.min(length, world.list_limit), WARP):
            settle(neighbours, cells, first + k, first + k)
        if lane == 0:
            end_list(world, neighbours, flags, w, g, length, moves)

    @wp.kernel(module=module)
    def finish(
        grains: Grains, cells: Cells, neighbours: Neighbours,
        stale: wp.array(dtype=int), any_stale: wp.array(dtype=int), rebuilds: wp.array(dtype=int),
    ):  # fmt: skip
        w = wp.tid()
        if stale[w] != 0:
            if stale[w] == ALL:
                neighbours.rebuilt[w] = grains.step[w]
            stale[w] = 0
            cells.cursor[w] = 0
            rebuilds[w] = rebuilds[w] + 1
        if w == 0:
            any_stale[0] = 0
            cells.seekers[0] = 0

    written = write_lists if build.cooperative else merge_lists
    return SimpleNamespace(write_lists=written, finish=finish, module=module)
