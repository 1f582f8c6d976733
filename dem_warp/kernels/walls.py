"""Distance of a sphere from a wall: overlap, normal and the wall's velocity."""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.types import Precision, device_structs
from dem_warp.walls import CYLINDER

TINY = 1.0e-12  # m; nearer than this to an axis or a surface no direction is defined


@functools.cache
def wall_functions(precision: Precision) -> SimpleNamespace:
    """`overlaps`, `overlap_and_normal` and `wall_velocity` in one precision.

    Geometry is in float64: an overlap is 1e-3 to 1e-6 of the distances that it is the difference of.
    """
    real, vec3 = precision.real, precision.vec3
    Wall = device_structs(precision).Wall

    @wp.func
    def from_wall(wall: Wall, position: wp.vec3d, step: int, time_step: real) -> wp.vec3d:
        """Position relative to the wall's own point, which moves from `start_step` on."""
        steps = wp.max(step - wall.start_step, 0)
        return position - wall.point - wall.velocity * (wp.float64(steps) * wp.float64(time_step))

    @wp.func
    def from_rim(wall: Wall, r: wp.vec3d, along: wp.float64):
        """Vector to `r`, beyond the rims of a cylinder, from the nearest point of a rim, and its length.

        On the axis every point of a rim is as near: the vector is what they have in common, along the axis.
        """
        across = r - wall.axis * along
        off_axis = wp.length(across)
        aside = off_axis - wall.radius
        beyond = along - wp.clamp(along, wp.float64(0.0), wall.length)
        outward = across / wp.max(off_axis, wp.float64(TINY))
        return outward * aside + wall.axis * beyond, wp.sqrt(aside * aside + beyond * beyond)

    @wp.func
    def overlaps(wall: Wall, position: wp.vec3d, radius: real, step: int, time_step: real) -> bool:
        """Whether a sphere touches the wall; away from a cylinder's rims without a root."""
        r = from_wall(wall, position, step, time_step)
        reach = wp.float64(radius)
        along = wp.dot(r, wall.axis)
        if wall.kind == CYLINDER:
            if along < wp.float64(0.0) or along > wall.length:
                _d, distance = from_rim(wall, r, along)
                return distance < reach
            across2 = wp.dot(r, r) - along * along
            inner = wall.radius - reach
            outer = wall.radius + reach
            return (inner < wp.float64(0.0) or across2 > inner * inner) and across2 < outer * outer
        return along < reach

    @wp.func
    def rounded(v: wp.vec3d) -> vec3:
        return vec3(real(v[0]), real(v[1]), real(v[2]))

    @wp.func
    def overlap_and_normal(wall: Wall, position: wp.vec3d, radius: real, step: int, time_step: real):
        """Overlap [m] (positive when touching) and unit normal from the wall to the sphere."""
        r = from_wall(wall, position, step, time_step)
        along = wp.dot(r, wall.axis)
        distance = along
        normal = rounded(wall.axis)
        if wall.kind == CYLINDER:
            if along < wp.float64(0.0) or along > wall.length:
                d, length = from_rim(wall, r, along)
                distance = length
                normal = rounded(d) / real(wp.max(length, wp.float64(TINY)))
            else:
                across = r - wall.axis * along
                off_axis = wp.max(wp.length(across), wp.float64(TINY))
                distance = wp.abs(off_axis - wall.radius)
                outward = rounded(across) / real(off_axis)
                normal = wp.where(off_axis > wall.radius, outward, -outward)
        return real(wp.float64(radius) - distance), normal

    @wp.func
    def wall_velocity(wall: Wall, step: int) -> vec3:
        moving = real(0.0)
        if step >= wall.start_step:
            moving = real(1.0)
        return rounded(wall.velocity) * moving

    return SimpleNamespace(
        overlaps=overlaps, overlap_and_normal=overlap_and_normal, wall_velocity=wall_velocity
    )
