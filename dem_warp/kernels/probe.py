"""Forces and places of a world's contacts between two steps."""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.entries import max_partners, partner_bits
from dem_warp.kernels.contacts import contact_functions
from dem_warp.kernels.packing import packing
from dem_warp.kernels.walls import wall_functions
from dem_warp.types import Build, device_structs


@functools.cache
def probe_kernels(build: Build) -> SimpleNamespace:
    precision = build.precision
    real, vec3 = precision.real, precision.vec3
    types = device_structs(precision)
    Model, World, Grains, Neighbours = types.Model, types.World, types.Grains, types.Neighbours
    Contact = types.Contact
    pack = packing(precision, build.is_periodic)
    contacts = contact_functions(build)
    walls = wall_functions(build.without_forces)
    spheres_each = wp.constant(build.sphere_count)
    bits = wp.constant(partner_bits(build.sphere_count))
    mask = wp.constant(max_partners(build.sphere_count) - 1)
    module = wp.get_module(f"dem_warp_probe_{build.name}")
    wp.set_module_options(
        {"fast_math": build.cooperative and precision.is_fixed_point, "enable_backward": False}, module
    )

    @wp.func
    def meeting_point(model: Model, world: World, grains: Grains, w: int, g: int, entry: int, step: int):
        """Return point [m] and unit normal, from the partner to the grain, of an entry with a contact."""
        partner = entry & mask
        wall_base = model.grain_count * spheres_each
        a = pack.load_sphere(grains.spheres, g * spheres_each + (entry >> bits))
        radius = pack.last(a)
        place = pack.place(a, world)
        normal = vec3()
        overlap = real(0.0)
        if partner < wall_base:
            b = pack.load_sphere(grains.spheres, w * wall_base + partner)
            d = pack.difference(a, b, world)
            normal = wp.normalize(d)
            overlap = radius + pack.last(b) - wp.length(d)
        else:
            number = partner - wall_base
            c = walls.meet(model, Contact(), walls.wall_of(model, w, number), number, place, radius, step)
            normal = c.normal
            overlap = c.overlap
        lever = normal * (real(0.5) * overlap - radius)
        return place + wp.vec3d(wp.float64(lever[0]), wp.float64(lever[1]), wp.float64(lever[2])), normal

    @wp.kernel(module=module)
    def measure(
        w: int,
        # model
        model: Model,
        # state in
        grains: Grains,
        alive: wp.array(dtype=int),
        # state in and out
        neighbours: Neighbours,
        # out, one an entry of the world's lists
        forces: wp.array(dtype=vec3),
        points: wp.array(dtype=wp.vec3d),
        normals: wp.array(dtype=vec3),
    ):
        """Compute the contact forces of a world as in the next step, which advances the histories too."""
        place = wp.tid()
        g = w * model.grain_count + place
        if alive[g] <= 0:
            return
        world = model.world[w]
        step = grains.step[w]
        is_free = step >= model.release_step[g]
        for k in range(neighbours.count[g]):
            slot = g * neighbours.capacity + k
            entry = neighbours.entry[slot]
            neighbours.near.item[slot] = wp.vec2i(entry, slot)
            if is_free or contacts.is_free(model, neighbours, w, slot, step):
                force, _torque, _rolling = contacts.contact(
                    model, world, grains, neighbours, w, g, slot, step
                )
                if wp.length_sq(force) > real(0.0):
                    point, normal = meeting_point(model, world, grains, w, g, entry, step)
                    out = place * neighbours.capacity + k
                    forces[out] = force
                    points[out] = point
                    normals[out] = normal

    return SimpleNamespace(measure=measure, module=module)
