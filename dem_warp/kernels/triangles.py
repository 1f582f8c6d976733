"""Contacts of a sphere with a mesh of triangles: one at each nearest point of the surface.

If that point is on an edge or in a corner, the contact belongs to the nearest of the triangles that share it,
and to the first of equally near ones: all compute the same distances, bit for bit.
"""

import functools
from types import SimpleNamespace

import warp as wp

from dem_warp.types import Precision, device_structs

CORNERS = 0b111
CLOSE = 1.0e-5  # largest distance of a point on an edge or corner, over the sphere's radius


@functools.cache
def triangle_functions(precision: Precision) -> SimpleNamespace:
    """Return `from_triangle`, `touches` and `joined`; positions are in the frame of the mesh, in float64."""
    types = device_structs(precision)
    Model, Triangle = types.Model, types.Triangle

    @wp.func
    def from_segment(a: wp.vec3d, b: wp.vec3d, q: wp.vec3d) -> wp.vec3d:
        """Return the vector to `q` from the nearest point of a segment, exact at its ends."""
        side = b - a
        part = wp.dot(q - a, side) / wp.dot(side, side)
        if part >= wp.float64(1.0):
            return q - b
        return q - a - side * wp.max(part, wp.float64(0.0))

    @wp.func
    def shorter(d: wp.vec3d, e: wp.vec3d) -> wp.vec3d:
        return wp.where(wp.dot(e, e) < wp.dot(d, d), e, d)

    @wp.func
    def from_triangle(t: Triangle, q: wp.vec3d) -> wp.vec3d:
        """Return the vector to `q` from the nearest point of a triangle."""
        ab = t.b - t.a
        ac = t.c - t.a
        r = q - t.a
        side_ac = wp.dot(wp.cross(r, ac), t.normal)
        side_ab = wp.dot(wp.cross(ab, r), t.normal)
        inside = side_ac >= wp.float64(0.0) and side_ab >= wp.float64(0.0)
        if inside and side_ac + side_ab <= wp.dot(wp.cross(ab, ac), t.normal):
            return t.normal * wp.dot(r, t.normal)
        d = shorter(from_segment(t.a, t.b, q), from_segment(t.a, t.c, q))
        return shorter(d, from_segment(t.b, t.c, q))

    @wp.func
    def on_segment(a: wp.vec3d, b: wp.vec3d, p: wp.vec3d, near: wp.float64) -> bool:
        return wp.length(from_segment(a, b, p)) < near

    @wp.func
    def corners_around(t: Triangle, p: wp.vec3d, near: wp.float64) -> int:
        """Return the bits of the corners of the feature with a point: a corner, an edge or the face."""
        if wp.length(p - t.a) < near:
            return 1
        if wp.length(p - t.b) < near:
            return 2
        if wp.length(p - t.c) < near:
            return 4
        if on_segment(t.a, t.b, p, near):
            return 1 | 2
        if on_segment(t.a, t.c, p, near):
            return 1 | 4
        if on_segment(t.b, t.c, p, near):
            return 2 | 4
        return CORNERS

    @wp.func
    def touches(model: Model, first: int, index: int, q: wp.vec3d, radius: wp.float64) -> bool:
        """Return True if a sphere has a contact with triangle `index` of a mesh that begins at `first`."""
        t = model.triangle[first + index]
        d = from_triangle(t, q)
        distance2 = wp.dot(d, d)
        if not (distance2 < radius * radius):  # with NaN as radius there is no contact
            return False
        corners = corners_around(t, q - d, wp.float64(CLOSE) * radius)
        if corners == CORNERS:
            return True
        for k in range(t.first, t.first + t.count):
            other = model.adjacent[k]
            if corners & other == corners:
                neighbour = other >> 3
                e = from_triangle(model.triangle[first + neighbour], q)
                if wp.dot(e, e) < distance2 or (wp.dot(e, e) == distance2 and neighbour < index):
                    return False
        return True

    @wp.func
    def joined(model: Model, index: int, other: int) -> bool:
        """Return True if triangle `index` of the table shares a corner with number `other` of its mesh."""
        t = model.triangle[index]
        found = bool(False)
        for k in range(t.first, t.first + t.count):
            found = found or model.adjacent[k] >> 3 == other
        return found

    return SimpleNamespace(from_triangle=from_triangle, touches=touches, joined=joined)
