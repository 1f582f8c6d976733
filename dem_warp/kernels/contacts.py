"""One entry of a grain's neighbour list: its distance and its contact force.

An entry has one of the grain's spheres and a partner: a sphere of another grain or, with higher numbers, a
wall or a triangle.
"""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.entries import max_partners, partner_bits
from dem_warp.kernels.lanes import load_pair
from dem_warp.kernels.packing import packing
from dem_warp.kernels.walls import wall_functions
from dem_warp.laws.contact_law import acts_apart, contact_law, memory_size
from dem_warp.types import Build, Counts, device_structs


@functools.cache
def contact_functions(build: Build) -> SimpleNamespace:
    """Return `nears`, `is_free` and `contact` of one build."""
    precision = build.precision
    real, vec3, vec4 = precision.real, precision.vec3, precision.vec4
    Sphere = precision.sphere
    types = device_structs(precision)
    Model, World, Grains, Neighbours = types.Model, types.World, types.Grains, types.Neighbours
    Contact = types.Contact
    pack = packing(precision, build.is_periodic)
    law = contact_law(build.mechanisms, build.forms)
    is_apart = acts_apart(build.mechanisms)
    turning = build.forms.partner_turning
    memory_each = wp.constant(memory_size(build.mechanisms, build.forms))
    # lanes of a warp without contact wait for the others anyway: all load at once, before distances are known
    is_speculative = build.cooperative and build.has_base_law and not build.has_mesh
    walls = wall_functions(build.without_forces)
    spheres_each = wp.constant(build.sphere_count)
    bits = wp.constant(partner_bits(build.sphere_count))
    mask = wp.constant(max_partners(build.sphere_count) - 1)
    walls_each = wp.constant(build.wall_count)

    @wp.func
    def nears(
        model: Model, world: World, grains: Grains, w: int, g: int, entry: int, margin: real, step: int
    ) -> bool:
        """Return True if the distance of an entry's two partners is below a margin [m]."""
        partner = entry & mask
        wall_base = model.grain_count * spheres_each
        a = pack.load_sphere(grains.spheres, g * spheres_each + (entry >> bits))
        reach = pack.last(a) + margin
        if partner >= wall_base:
            return walls.nears(model, w, partner - wall_base, pack.place(a, world), reach, step)
        b = pack.load_sphere(grains.spheres, w * wall_base + partner)
        d = pack.difference(a, b, world)
        reach += pack.last(b)
        return wp.dot(d, d) < reach * reach

    @wp.func
    def is_free(model: Model, neighbours: Neighbours, w: int, item: int, step: int) -> bool:
        """Return True if the partner in an item of `near` is a grain that moves freely."""
        partner = load_pair(neighbours.near.item, item)[0] & mask
        j = partner // spheres_each
        return j < model.grain_count and step >= model.release_step[w * model.grain_count + j]

    @wp.func
    def spin_of(grains: Grains, g: int) -> vec3:
        omega = pack.load_vec4(grains.spin, g)
        return vec3(omega[0], omega[1], omega[2])

    @wp.func
    def surface_velocity(grains: Grains, g: int, lever: vec3) -> vec3:
        v = pack.load_vec4(grains.velocity, g)
        return vec3(v[0], v[1], v[2]) + wp.cross(spin_of(grains, g), lever)

    @wp.func
    def lever_of(grains: Grains, world: World, g: int, sphere: Sphere, to_contact: vec3) -> vec3:
        """Return the vector from a grain's centre to a contact at `to_contact` from its sphere's centre."""
        return pack.difference(sphere, pack.load_sphere(grains.center, g), world) + to_contact

    @wp.func
    def meet_sphere(
        grains: Grains, world: World, contact: Contact, j: int, a: Sphere, b: Sphere, d: vec3
    ) -> Contact:
        """Set the geometry of a contact with a sphere of grain `j`, and the motion of `j`."""
        distance = wp.length(d)
        ra = pack.last(a)
        rb = pack.last(b)
        contact.normal = d / distance
        contact.overlap = ra + rb - distance
        contact.radius = ra * rb / (ra + rb)
        to_contact = contact.normal * (rb - real(0.5) * contact.overlap)
        lever = lever_of(grains, world, j, b, to_contact)
        contact.velocity = -surface_velocity(grains, j, lever)
        if wp.static(turning == "own lever"):
            contact.rolled = -wp.cross(spin_of(grains, j), lever)
        contact.spin = -spin_of(grains, j)
        contact.partner_lever = lever
        mb = pack.load_vec4(grains.velocity, j)[3]
        contact.mobility = real(1.0) / (mb * wp.dot(lever, lever))
        contact.mass = contact.mass * mb / (contact.mass + mb)
        return contact

    @wp.func
    def add_motion(grains: Grains, contact: Contact, g: int) -> Contact:
        """Add the motion of the grain itself to that of its partner."""
        contact.velocity += surface_velocity(grains, g, contact.lever)
        contact.spin += spin_of(grains, g)
        if wp.static(turning == "own lever"):
            contact.rolled += wp.cross(spin_of(grains, g), contact.lever)
        if wp.static(turning == "alike"):
            contact.rolled = spin_of(grains, g)
        return contact

    @wp.func
    def torques(contact: Contact, torque: vec3):
        """Return the torque on the grain, and the opposite of that on its partner [N m], from the law's."""
        if wp.static(turning == "own lever"):
            return wp.cross(contact.lever, torque), wp.cross(contact.partner_lever, torque)
        if wp.static(turning == "alike"):
            return torque, -torque
        return torque, torque

    @wp.func
    def joined(model: Model, w: int, entry: int, other: int) -> bool:
        """Return True if a triangle, the partner of the first entry, shares a corner with the other."""
        wall_base = model.grain_count * spheres_each
        return walls.joined(model, w, (entry & mask) - wall_base, (other & mask) - wall_base)

    @wp.func
    def touches_triangle(
        model: Model, world: World, grains: Grains, w: int, g: int, entry: int, step: int
    ) -> bool:
        """Return True if the triangle of an entry has a contact with the entry's sphere."""
        a = pack.load_sphere(grains.spheres, g * spheres_each + (entry >> bits))
        reach = pack.last(a)
        if wp.static(is_apart):
            reach += world.reach
        number = (entry & mask) - model.grain_count * spheres_each
        return walls.touches(model, w, number, pack.place(a, world), reach, step)

    @wp.func
    def take_over(
        model: Model, world: World, grains: Grains, neighbours: Neighbours,
        w: int, g: int, slot: int, step: int,
    ):  # fmt: skip
        """Continue the history of a contact that has moved from one triangle of a mesh to the next.

        The sphere touched the other triangle in the step before, but not now. No thread writes to an entry
        without contact, so it may be read.
        """
        entry = neighbours.entry[slot]
        first = g * neighbours.capacity
        for k in range(first, first + neighbours.count[g]):
            other = neighbours.entry[k]
            if other >> bits == entry >> bits and joined(model, w, entry, other):
                if not touches_triangle(model, world, grains, w, g, other, step):
                    history = pack.load_vec4(neighbours.history, k)
                    if pack.stamped_step(history) == step:
                        pack.store_vec4(neighbours.history, slot, history)
                        for m in range(memory_each):
                            neighbours.memory[slot * memory_each + m] = neighbours.memory[k * memory_each + m]
                        return

    @wp.func
    def recall(
        model: Model, world: World, grains: Grains, neighbours: Neighbours,
        w: int, g: int, slot: int, step: int,
    ):  # fmt: skip
        """Return the tangential displacement [m] of a contact, and True if the contact is new."""
        if wp.static(build.has_mesh):
            first_triangle = model.grain_count * spheres_each + walls_each
            is_triangle = neighbours.entry[slot] & mask >= first_triangle
            if is_triangle and pack.stamped_step(pack.load_vec4(neighbours.history, slot)) != step:
                take_over(model, world, grains, neighbours, w, g, slot, step)
        history = pack.load_vec4(neighbours.history, slot)
        displacement = vec3(history[0], history[1], history[2])
        is_new = pack.stamped_step(history) != step
        if is_new:
            displacement = vec3()
        return displacement, is_new

    @wp.func
    def react(neighbours: Neighbours, g: int, force: vec3, torque: vec3, rolling: real):
        """Add the opposite of a force and torque, and a rolling torque, to a later grain."""
        f = pack.load_vec4(neighbours.reactions.force, g)
        t = pack.load_vec4(neighbours.reactions.torque, g)
        pack.store_vec4(neighbours.reactions.force, g, f + vec4(-force[0], -force[1], -force[2], rolling))
        pack.store_vec4(neighbours.reactions.torque, g, t - vec4(torque[0], torque[1], torque[2], real(0.0)))

    @wp.func
    def weigh(model: Model, world: World, neighbours: Neighbours, w: int, wall: int, g: int, force: vec3):
        """Add the opposite of a force to a grain's sum on a weighed wall.

        Integer counts have the same sum in any order; one sum for all grains would be slow.
        """
        number = model.wall[wall].weighed
        if number != 0:
            push = Counts(
                -wp.int64(wp.rint(force[0] * world.force_rate)),
                -wp.int64(wp.rint(force[1] * world.force_rate)),
                -wp.int64(wp.rint(force[2] * world.force_rate)),
            )
            wp.atomic_add(neighbours.pushed, g * neighbours.weighed + number - 1, push)
            if wp.static(build.has_free_wall):
                if model.wall[wall].mass > wp.float64(0.0):
                    wp.atomic_add(neighbours.borne, w, push[2])

    @wp.func
    def contact(
        model: Model, world: World, grains: Grains, neighbours: Neighbours,
        w: int, g: int, item: int, step: int,
    ):  # fmt: skip
        """Return force [N], torque and rolling torque [N m] of an item of `near`, 0 without contact.

        Update the history of the contact, the sum on a weighed wall and, on a CPU, the partner's reactions.
        """
        near = load_pair(neighbours.near.item, item)
        entry = near[0]
        slot = near[1]
        force = vec3()
        torque = vec3()
        rolling = real(0.0)
        partner = entry & mask
        wall_base = model.grain_count * spheres_each
        a = pack.load_sphere(grains.spheres, g * spheres_each + (entry >> bits))
        radius = pack.last(a)
        apart = real(0.0)
        if wp.static(is_apart):
            apart = world.reach
        pair = w * model.pair_count
        meets = bool(False)
        mass = pack.load_vec4(grains.velocity, g)[3]
        c = Contact()
        c.mass = mass
        c.time_step = world.time_step
        if partner < wall_base:
            b = pack.load_sphere(grains.spheres, w * wall_base + partner)
            d = pack.difference(a, b, world)
            reach = radius + pack.last(b) + apart
            meets = wp.dot(d, d) < reach * reach
            if wp.static(is_speculative) or meets:
                c = meet_sphere(grains, world, c, w * model.grain_count + partner // spheres_each, a, b, d)
        else:
            number = partner - wall_base
            wall = walls.wall_of(model, w, number)
            c = walls.meet(model, c, wall, number, pack.place(a, world), radius, step)
            pair += model.wall[wall].pair
            meets = c.overlap > -apart
            if wp.static(build.has_mesh):
                if number >= walls_each and meets:
                    meets = walls.touches(model, w, number, pack.place(a, world), radius + apart, step)
        if wp.static(is_speculative) or meets:
            c.lever = lever_of(grains, world, g, a, c.normal * (real(0.5) * c.overlap - radius))
            c.mobility += real(1.0) / (mass * wp.dot(c.lever, c.lever))
            c = add_motion(grains, c, g)
            displacement, is_new = recall(model, world, grains, neighbours, w, g, slot, step)
            c.is_new = is_new
            force, displacement, torque, rolling, partner_rolling = law(
                model.contact[pair], c, displacement, neighbours.memory, slot * memory_each
            )
            torque, opposite = torques(c, torque)
            if wp.static(not build.cooperative):
                if partner < wall_base:
                    j = w * model.grain_count + partner // spheres_each
                    react(neighbours, j, force, opposite + wp.cross(c.partner_lever, force), partner_rolling)
            torque += wp.cross(c.lever, force)
            if meets:
                pack.store_vec4(neighbours.history, slot, pack.stamp(displacement, step + 1))
                if partner >= wall_base:
                    weigh(model, world, neighbours, w, walls.wall_of(model, w, partner - wall_base), g, force)
        if wp.static(is_speculative) and not meets:
            force = vec3()
            torque = vec3()
            rolling = real(0.0)
        return force, torque, rolling

    return SimpleNamespace(nears=nears, is_free=is_free, contact=contact)
