"""Places of the walls in each step, and a sphere's contact with one: overlap, normal, wall velocity."""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.kernels.triangles import triangle_functions
from dem_warp.types import FRAMES, Build, device_structs
from dem_warp.walls import CYLINDER, MESH, PLANE

TINY = 1.0e-12  # [m] least distance from an axis or a surface for a direction
TURN = wp.constant(wp.float64(2.0 * wp.pi))  # rad


@functools.cache
def wall_functions(build: Build) -> SimpleNamespace:
    """Return `wall_of`, `frame_of`, `touches`, `nears`, `meet` and `path` of one build.

    The walls have numbers from 0, the triangles of their meshes the numbers after. Geometry is in float64, as
    an overlap is 1e-3 to 1e-6 of the distances.
    """
    real, vec3 = build.precision.real, build.precision.vec3
    types = device_structs(build.precision)
    Model, World, Wall, Frame = types.Model, types.World, types.Wall, types.Frame
    Contact = types.Contact
    triangles = triangle_functions(build.precision)
    walls_each = wp.constant(build.wall_count)
    has_mesh = build.has_mesh

    @wp.func
    def rounded(v: wp.vec3d) -> vec3:
        return vec3(real(v[0]), real(v[1]), real(v[2]))

    @wp.func
    def root(x: wp.float64) -> wp.float64:
        """Return the square root; in mixed precision a float32 root and a Newton step, exact to 1e-14."""
        if wp.static(build.precision.is_fixed_point):
            guess = wp.max(wp.sqrt(float(x)), float(TINY))
            rest = x - wp.float64(guess) * wp.float64(guess)
            return wp.float64(guess) + rest * wp.float64(0.5 / guess)
        return wp.sqrt(x)

    @wp.func
    def frame_of(model: Model, wall: int, step: int) -> Frame:
        """Return the frame of a wall in a step, from the last `place_walls`."""
        return model.frame[wall * FRAMES + step % FRAMES]

    @wp.func
    def from_profile(wall: Wall, axis: wp.vec3d, r: wp.vec3d):
        """Return the vector to `r` from the nearest point of the surface swept by a profile, and its length.

        On the axis all points of a ring are equally near: the vector is then along the axis.
        """
        along = wp.dot(r, axis)
        across = r - axis * along
        off_axis = wp.length(across)
        widening = wall.upper_radius - wall.radius
        part = (off_axis - wall.radius) * widening + along * wall.length
        part = wp.clamp(
            part / (widening * widening + wall.length * wall.length), wp.float64(0.0), wp.float64(1.0)
        )
        aside = off_axis - (wall.radius + part * widening)
        beyond = along - part * wall.length
        outward = across / wp.max(off_axis, wp.float64(TINY))
        return outward * aside + axis * beyond, wp.sqrt(aside * aside + beyond * beyond)

    @wp.func
    def overlaps(wall: Wall, frame: Frame, position: wp.vec3d, radius: real) -> bool:
        """Return True if a sphere touches the wall; away from a cylinder's rims without a root."""
        r = position - frame.origin
        reach = wp.float64(radius)
        along = wp.dot(r, frame.axis)
        if wall.kind == PLANE:
            return along < reach
        if wall.kind == CYLINDER and along >= wp.float64(0.0) and along <= wall.length:
            across2 = wp.dot(r, r) - along * along
            inner = wall.radius - reach
            outer = wall.radius + reach
            return (inner < wp.float64(0.0) or across2 > inner * inner) and across2 < outer * outer
        _d, distance = from_profile(wall, frame.axis, r)
        return distance < reach

    @wp.func
    def wall_of(model: Model, w: int, number: int) -> int:
        """Return the wall of a partner, a wall or a triangle."""
        wall = w * walls_each + number
        if wp.static(has_mesh):
            if number >= walls_each:
                for k in range(walls_each):
                    facets = model.facets[w * walls_each + k]
                    if number >= facets.number and number < facets.number + facets.count:
                        wall = w * walls_each + k
        return wall

    @wp.func
    def joined(model: Model, w: int, number: int, other: int) -> bool:
        """Return True if a triangle shares a corner with another partner."""
        facets = model.facets[wall_of(model, w, number)]
        return triangles.joined(model, facets.first + number - facets.number, other - facets.number)

    @wp.func
    def to_mesh(frame: Frame, position: wp.vec3d) -> wp.vec3d:
        """Return a position in a mesh's own frame."""
        return wp.quat_rotate_inv(frame.rotation, position - frame.origin)

    @wp.func
    def touches(model: Model, w: int, number: int, position: wp.vec3d, radius: real, step: int) -> bool:
        """Return True if a sphere touches a wall or a triangle."""
        wall = wall_of(model, w, number)
        frame = frame_of(model, wall, step)
        if wp.static(has_mesh):
            if number >= walls_each:
                facets = model.facets[wall]
                q = to_mesh(frame, position)
                return triangles.touches(model, facets.first, number - facets.number, q, wp.float64(radius))
            if model.wall[wall].kind == MESH:
                return False
        return overlaps(model.wall[wall], frame, position, radius)

    @wp.func
    def nears(model: Model, w: int, number: int, position: wp.vec3d, reach: real, step: int) -> bool:
        """Return True if a wall or a triangle has a point within `reach` [m] of a position."""
        if wp.static(has_mesh):
            if number >= walls_each:
                wall = wall_of(model, w, number)
                facets = model.facets[wall]
                t = model.triangle[facets.first + number - facets.number]
                d = triangles.from_triangle(t, to_mesh(frame_of(model, wall, step), position))
                return wp.dot(d, d) < wp.float64(reach) * wp.float64(reach)
        return touches(model, w, number, position, reach, step)

    @wp.func
    def triangle_overlap(
        model: Model, wall: int, number: int, frame: Frame, position: wp.vec3d, radius: real
    ):
        facets = model.facets[wall]
        t = model.triangle[facets.first + number - facets.number]
        d = wp.quat_rotate(frame.rotation, triangles.from_triangle(t, to_mesh(frame, position)))
        distance = wp.length(d)
        return real(wp.float64(radius) - distance), rounded(d) / real(wp.max(distance, wp.float64(TINY)))

    @wp.func
    def overlap_and_normal(wall: Wall, axis: wp.vec3d, r: wp.vec3d, radius: real):
        along = wp.dot(r, axis)
        distance = along
        normal = rounded(axis)
        if wall.kind == CYLINDER and along >= wp.float64(0.0) and along <= wall.length:
            across = r - axis * along
            off_axis = wp.max(root(wp.dot(across, across)), wp.float64(TINY))
            distance = wp.abs(off_axis - wall.radius)
            outward = rounded(across) / real(off_axis)
            normal = wp.where(off_axis > wall.radius, outward, -outward)
        elif wall.kind != PLANE:
            d, length = from_profile(wall, axis, r)
            distance = length
            normal = rounded(d) / real(wp.max(length, wp.float64(TINY)))
        return real(wp.float64(radius) - distance), normal

    @wp.func
    def meet(
        model: Model, contact: Contact, wall: int, number: int, position: wp.vec3d, radius: real, step: int
    ) -> Contact:
        """Set the geometry of a contact with a wall or a triangle of it, and the opposite of its motion."""
        frame = frame_of(model, wall, step)
        r = position - frame.origin
        overlap, normal = overlap_and_normal(model.wall[wall], frame.axis, r, radius)
        if wp.static(has_mesh):
            if number >= walls_each:
                overlap, normal = triangle_overlap(model, wall, number, frame, position, radius)
        contact.overlap = overlap
        contact.normal = normal
        contact.radius = radius
        arm = rounded(r) + normal * (real(0.5) * overlap - radius)
        contact.rolled = -wp.cross(frame.spin, arm)
        contact.velocity = -(frame.velocity + wp.cross(frame.spin, arm))
        contact.spin = -frame.spin
        return contact

    @wp.func
    def path(wall: Wall, frame: Frame, world: World, time: wp.float64) -> wp.float64:
        """Return the longest path in a time of any point of the wall that grains may touch [m].

        A spin about its own axis does not move a surface of revolution.
        """
        sway = wall.spin
        if wall.kind != MESH:
            sway -= frame.axis * wp.dot(wall.spin, frame.axis)
        reach = wp.min(wall.reach, wp.length(frame.origin - world.origin) + wp.length(world.half_extent))
        amplitude = wp.length(wall.amplitude)
        swing = wp.min(wp.float64(2.0), TURN * wall.frequency * time) * amplitude
        return (wp.length(wall.velocity) + wp.length(sway) * reach) * time + swing

    return SimpleNamespace(
        wall_of=wall_of,
        frame_of=frame_of,
        to_mesh=to_mesh,
        joined=joined,
        touches=touches,
        nears=nears,
        meet=meet,
        path=path,
    )


@functools.cache
def wall_kernels(build: Build) -> SimpleNamespace:
    """Return `place_walls`, which computes the frames of walls in the next steps, and `carry`."""
    precision = build.precision
    real, vec3 = precision.real, precision.vec3
    types = device_structs(precision)
    Model, Wall, Frame, Grains = types.Model, types.Wall, types.Frame, types.Grains
    World, Neighbours = types.World, types.Neighbours
    walls_each = wp.constant(build.wall_count)
    module = wp.get_module(f"dem_warp_walls_{build.name}")
    wp.set_module_options({"enable_backward": False}, module)

    @wp.func
    def moved(wall: Wall, time: wp.float64) -> Frame:
        """Return the frame of a wall at a time [s] since the start of its motion."""
        past = wp.min(time, wall.duration)
        rate = wp.length(wall.spin)
        turn = wp.quat_from_axis_angle(wp.normalize(wall.spin), rate * past)
        circular = TURN * wall.frequency
        frame = Frame()
        frame.origin = wall.point + wall.velocity * past + wall.amplitude * wp.sin(circular * past)
        frame.rotation = wp.mul(turn, wall.orientation)
        frame.axis = wp.quat_rotate(frame.rotation, wall.axis)
        if time < wall.duration:
            velocity = wall.velocity + wall.amplitude * (circular * wp.cos(circular * past))
            frame.velocity = vec3(real(velocity[0]), real(velocity[1]), real(velocity[2]))
            frame.spin = vec3(real(wall.spin[0]), real(wall.spin[1]), real(wall.spin[2]))
        return frame

    @wp.func
    def placed(wall: Wall, world: World, neighbours: Neighbours, w: int, step: int) -> Frame:
        """Return the frame of a wall in a step: in closed form, but for the rise of a free one so far."""
        frame = moved(wall, wp.float64(step - wall.start_step) * wp.float64(world.time_step))
        if wp.static(build.is_periodic):
            # it looks the same anywhere along x and y
            frame.origin = wp.vec3d(wall.point[0], wall.point[1], frame.origin[2])
        if wp.static(build.has_free_wall):
            if wall.mass > wp.float64(0.0):
                lift = neighbours.lift[w]
                frame.origin += wp.vec3d(wp.float64(0.0), wp.float64(0.0), lift[0])
                frame.velocity += vec3(real(0.0), real(0.0), real(lift[1]))
        return frame

    @wp.kernel(module=module)
    def place_walls(ahead: int, model: Model, grains: Grains, neighbours: Neighbours):
        """Set the frames of every wall in the present step and the `ahead` next."""
        i = wp.tid()
        index = i // (ahead + 1)
        w = index // walls_each
        wall = model.wall[index]
        step = grains.step[w] + i % (ahead + 1)
        model.frame[index * FRAMES + step % FRAMES] = placed(wall, model.world[w], neighbours, w, step)

    @wp.kernel(module=module)
    def carry(model: Model, idle: wp.array(dtype=int), grains: Grains, neighbours: Neighbours):
        """Move the free wall of each world by the forces of a step, and set its frame in the next."""
        w = wp.tid()
        if idle[w] != 0:
            return
        world = model.world[w]
        time_step = wp.float64(world.time_step)
        for i in range(walls_each):
            index = w * walls_each + i
            wall = model.wall[index]
            if wall.mass > wp.float64(0.0):
                lift = neighbours.lift[w]
                force = wall.force + wp.float64(neighbours.borne[w]) / wp.float64(world.force_rate)
                speed = lift[1] + force / wall.mass * time_step
                path = lift[2] + wp.abs(speed) * time_step
                neighbours.lift[w] = wp.vec4d(lift[0] + speed * time_step, speed, path, lift[3])
                step = grains.step[w]
                model.frame[index * FRAMES + step % FRAMES] = placed(wall, world, neighbours, w, step)
        neighbours.borne[w] = wp.int64(0)

    return SimpleNamespace(place_walls=place_walls, carry=carry, module=module)
