"""One candidate of a grain: does it touch, and what does it do.

The candidates of a grain are numbered through: first the entries of its neighbour list, then, wall by wall, its spheres
against the walls that it is near. Their order depends on the world alone, and the sum over them is taken in this order.
"""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.kernels.packing import packing
from dem_warp.kernels.walls import wall_functions
from dem_warp.laws.hertz_mindlin import contact_force
from dem_warp.laws.rolling import rolling_torque
from dem_warp.types import SPHERE_BITS, SPHERE_MASK, Precision, device_structs


@functools.cache
def contact_functions(precision: Precision) -> SimpleNamespace:
    """`near_walls`, `candidate_count`, `touches` and `contact` in one precision."""
    real, vec3, vec4 = precision.real, precision.vec3, precision.vec4
    types = device_structs(precision)
    Model, World, Grains, Neighbours = types.Model, types.World, types.Grains, types.Neighbours  # noqa: N806
    Sphere = precision.sphere  # noqa: N806
    pack = packing(precision)
    walls = wall_functions(precision)

    @wp.func
    def near_walls(model: Model, w: int, position: wp.vec3d, reach: real, step: int, time_step: real) -> int:
        """Bit set of the walls that the grain may touch."""
        near = int(0)
        for i in range(model.wall_count):
            if walls.is_near(model.wall[w * model.wall_count + i], position, reach, step, time_step):
                near = near | (1 << i)
        return near

    @wp.func
    def near_count(model: Model, near: int) -> int:
        count = int(0)
        for i in range(model.wall_count):
            count += (near >> i) & 1
        return count

    @wp.func
    def nth_wall(model: Model, near: int, n: int) -> int:
        found = int(0)
        left = int(n)
        for i in range(model.wall_count):
            if (near >> i) & 1 == 1:
                if left == 0:
                    found = i
                left -= 1
        return found

    @wp.func
    def touches(
        model: Model, world: World, grains: Grains, hood: Neighbours, w: int, g: int, c: int, count: int, first: int,
        near: int, step: int,
    ) -> bool:  # fmt: skip
        """Whether candidate `c` of grain `g` overlaps it; `count` entries of its list begin at `first`."""
        if c < count:
            entry = hood.entry[first + c]
            a = pack.load_sphere(grains.spheres, g * model.sphere_count + (entry >> SPHERE_BITS))
            b = pack.load_sphere(grains.spheres, w * model.grain_count * model.sphere_count + (entry & SPHERE_MASK))
            d = pack.difference(a, b, world)
            reach = pack.last(a) + pack.last(b)
            return wp.dot(d, d) < reach * reach
        i = nth_wall(model, near, (c - count) // model.sphere_count)
        s = (c - count) % model.sphere_count
        if s >= model.shape_sphere_count[model.shape[g]]:
            return False
        a = pack.load_sphere(grains.spheres, g * model.sphere_count + s)
        overlap, _normal = walls.wall_overlap(
            model.wall[w * model.wall_count + i], pack.place(a, world), pack.last(a), step, world.time_step
        )
        return overlap > real(0.0)

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
        model: Model, world: World, grains: Grains, hood: Neighbours, w: int, g: int, c: int, count: int, first: int,
        near: int, step: int,
    ):  # fmt: skip
        """Force [N], torque [N m] and rolling torque [N m] of touching candidate `c` on grain `g`; moves its history on."""
        slot = first + c
        pair = w * model.pair_count
        own = int(0)
        i = int(0)
        if c < count:
            own = hood.entry[slot] >> SPHERE_BITS
        else:
            own = (c - count) % model.sphere_count
            i = w * model.wall_count + nth_wall(model, near, (c - count) // model.sphere_count)
            slot = hood.first_wall + (g * model.wall_count + i - w * model.wall_count) * model.sphere_count + own
            pair += model.wall[i].pair
        a = pack.load_sphere(grains.spheres, g * model.sphere_count + own)
        radius = pack.last(a)
        effective_radius = pack.last(a)
        mass = pack.load_vec4(grains.velocity, g)[3]
        normal = vec3()
        overlap = real(0.0)
        partner_velocity = vec3()
        if c < count:
            partner = hood.entry[slot] & SPHERE_MASK
            b = pack.load_sphere(grains.spheres, w * model.grain_count * model.sphere_count + partner)
            d = pack.difference(a, b, world)
            distance = wp.length(d)
            normal = d / distance
            rb = pack.last(b)
            overlap = radius + rb - distance
            j = w * model.grain_count + partner // model.sphere_count
            to_contact = normal * (rb - real(0.5) * overlap)
            partner_velocity = surface_velocity(grains, j, lever_of(grains, world, j, b, to_contact))
            mb = pack.load_vec4(grains.velocity, j)[3]
            mass = mass * mb / (mass + mb)
            effective_radius = radius * rb / (radius + rb)
        else:
            wall = model.wall[i]
            overlap, normal = walls.wall_overlap(wall, pack.place(a, world), radius, step, world.time_step)
            partner_velocity = walls.wall_velocity(wall, step)
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

    return SimpleNamespace(near_walls=near_walls, near_count=near_count, touches=touches, contact=contact)
