"""One entry of a grain's neighbour list: does it touch, and what does it do.

An entry names one of the grain's spheres and a partner: a sphere of another grain or, numbered after, a wall.
"""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.kernels.packing import packing
from dem_warp.kernels.walls import wall_functions
from dem_warp.laws.hertz_mindlin import contact_force
from dem_warp.laws.rolling import rolling_torque
from dem_warp.types import SPHERE_BITS, SPHERE_MASK, Build, device_structs


@functools.cache
def contact_functions(build: Build) -> SimpleNamespace:
    """`touches` and `contact` of one build."""
    precision = build.precision
    real, vec3, vec4 = precision.real, precision.vec3, precision.vec4
    Sphere = precision.sphere
    types = device_structs(precision)
    Model, World, Grains, Neighbours = types.Model, types.World, types.Grains, types.Neighbours
    pack = packing(precision)
    walls = wall_functions(precision)
    spheres_each = wp.constant(build.sphere_count)
    walls_each = wp.constant(build.wall_count)

    @wp.func
    def touches(model: Model, world: World, grains: Grains, w: int, g: int, entry: int, step: int) -> bool:
        """Whether the two partners of an entry overlap."""
        partner = entry & SPHERE_MASK
        wall_base = model.grain_count * spheres_each
        a = pack.load_sphere(grains.spheres, g * spheres_each + (entry >> SPHERE_BITS))
        if partner >= wall_base:
            wall = model.wall[w * walls_each + partner - wall_base]
            return walls.overlaps(wall, pack.place(a, world), pack.last(a), step, world.time_step)
        b = pack.load_sphere(grains.spheres, w * wall_base + partner)
        d = pack.difference(a, b, world)
        reach = pack.last(a) + pack.last(b)
        return wp.dot(d, d) < reach * reach

    @wp.func
    def surface_velocity(grains: Grains, g: int, lever: vec3) -> vec3:
        v = pack.load_vec4(grains.velocity, g)
        omega = pack.load_vec4(grains.spin, g)
        return vec3(v[0], v[1], v[2]) + wp.cross(vec3(omega[0], omega[1], omega[2]), lever)

    @wp.func
    def lever_of(grains: Grains, world: World, g: int, sphere: Sphere, to_contact: vec3) -> vec3:
        """From a grain's centre to a contact, which lies `to_contact` from the centre of its sphere."""
        return pack.difference(sphere, pack.load_sphere(grains.center, g), world) + to_contact

    @wp.func
    def remembered(history: vec4, step: int) -> vec3:
        """Tangential displacement of a contact that was touching in the step before, else none."""
        if pack.stamped_step(history) == step:
            return vec3(history[0], history[1], history[2])
        return vec3(real(0.0), real(0.0), real(0.0))

    @wp.func
    def contact(
        model: Model, world: World, grains: Grains, hood: Neighbours, w: int, g: int, slot: int, step: int
    ):
        """Force [N], torque and rolling torque [N m] of the touching entry in `slot`; updates its history."""
        entry = hood.entry[slot]
        partner = entry & SPHERE_MASK
        wall_base = model.grain_count * spheres_each
        a = pack.load_sphere(grains.spheres, g * spheres_each + (entry >> SPHERE_BITS))
        radius = pack.last(a)
        effective_radius = pack.last(a)
        mass = pack.load_vec4(grains.velocity, g)[3]
        normal = vec3()
        overlap = real(0.0)
        partner_velocity = vec3()
        pair = w * model.pair_count
        if partner < wall_base:
            b = pack.load_sphere(grains.spheres, w * wall_base + partner)
            d = pack.difference(a, b, world)
            distance = wp.length(d)
            normal = d / distance
            rb = pack.last(b)
            overlap = radius + rb - distance
            effective_radius = radius * rb / (radius + rb)
            j = w * model.grain_count + partner // spheres_each
            to_contact = normal * (rb - real(0.5) * overlap)
            partner_velocity = surface_velocity(grains, j, lever_of(grains, world, j, b, to_contact))
            mb = pack.load_vec4(grains.velocity, j)[3]
            mass = mass * mb / (mass + mb)
        else:
            wall = model.wall[w * walls_each + partner - wall_base]
            overlap, normal = walls.overlap_and_normal(
                wall, pack.place(a, world), radius, step, world.time_step
            )
            partner_velocity = walls.wall_velocity(wall, step)
            pair += wall.pair
        lever = lever_of(grains, world, g, a, normal * (real(0.5) * overlap - radius))
        params = model.contact[pair]
        force, displacement, normal_force = contact_force(
            params,
            normal,
            overlap,
            effective_radius,
            mass,
            surface_velocity(grains, g, lever) - partner_velocity,
            remembered(pack.load_vec4(hood.history, slot), step),
            world.time_step,
        )
        pack.store_vec4(hood.history, slot, pack.stamp(displacement, step + 1))
        return force, wp.cross(lever, force), rolling_torque(params.rolling_friction, normal_force, lever)

    return SimpleNamespace(touches=touches, contact=contact)
