"""Distance of a sphere from a wall: overlap, normal and the wall's velocity."""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.types import Precision, device_structs
from dem_warp.walls import CYLINDER

TINY = 1.0e-12  # m; nearer than this to an axis or a surface no direction is defined


@functools.cache
def wall_functions(precision: Precision) -> SimpleNamespace:
    """`displacement`, `is_near` and `wall_overlap` in one precision.

    Geometry is in float64: an overlap is 1e-3 to 1e-6 of the distances that it is the difference of.
    """
    real, vec3 = precision.real, precision.vec3
    Wall = device_structs(precision).Wall  # noqa: N806

    @wp.func
    def from_wall(wall: Wall, position: wp.vec3d, step: int, time_step: real) -> wp.vec3d:
        """Position relative to the wall's own point, which moves from `start_step` on."""
        steps = wp.max(step - wall.start_step, 0)
        return position - wall.point - wall.velocity * (wp.float64(steps) * wp.float64(time_step))

    @wp.func
    def from_cylinder(wall: Wall, r: wp.vec3d) -> wp.vec3d:
        """Vector from the nearest point of the cylinder's surface to `r` (relative to the centre of its lower rim)."""
        along = wp.dot(r, wall.axis)
        across = r - wall.axis * along
        distance = wp.max(wp.length(across), wp.float64(TINY))
        beyond = along - wp.clamp(along, wp.float64(0.0), wall.length)
        return across * ((distance - wall.radius) / distance) + wall.axis * beyond

    @wp.func
    def is_near(wall: Wall, position: wp.vec3d, reach: real, step: int, time_step: real) -> bool:
        """Whether a grain whose spheres lie within `reach` of its centre may touch the wall."""
        r = from_wall(wall, position, step, time_step)
        if wall.kind == CYLINDER:
            return wp.length(from_cylinder(wall, r)) < wp.float64(reach)
        return wp.dot(r, wall.axis) < wp.float64(reach)

    @wp.func
    def wall_overlap(wall: Wall, position: wp.vec3d, radius: real, step: int, time_step: real):
        """Overlap [m] (positive when touching) and unit normal from the wall to the sphere."""
        r = from_wall(wall, position, step, time_step)
        distance = wp.dot(r, wall.axis)
        normal = wall.axis
        if wall.kind == CYLINDER:
            d = from_cylinder(wall, r)
            distance = wp.max(wp.length(d), wp.float64(TINY))
            normal = d / distance
        return real(wp.float64(radius) - distance), vec3(real(normal[0]), real(normal[1]), real(normal[2]))

    @wp.func
    def wall_velocity(wall: Wall, step: int) -> vec3:
        moving = real(0.0)
        if step >= wall.start_step:
            moving = real(1.0)
        return vec3(real(wall.velocity[0]), real(wall.velocity[1]), real(wall.velocity[2])) * moving

    return SimpleNamespace(is_near=is_near, wall_overlap=wall_overlap, wall_velocity=wall_velocity)
