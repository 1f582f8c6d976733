"""Packing of a sphere's position, and of a contact's step number, into four components.

In `mixed` precision a sphere is four 32-bit integers: three counts of the world's length unit and the bits of
its float32 radius, so that the difference of two positions is exact. In `double` it is four floats.
"""

import functools
from types import SimpleNamespace
from typing import Any

import warp as wp

from dem_warp.types import Precision, device_structs

LOAD_16 = """
#if defined(__CUDA_ARCH__)
    {kind}4 t = reinterpret_cast<const {kind}4*>(a.data)[i];
    return wp::vec_t<4, {real}>(t.x, t.y, t.z, t.w);
#else
    return a.data[i];
#endif
"""
STORE_16 = """
#if defined(__CUDA_ARCH__)
    reinterpret_cast<{kind}4*>(a.data)[i] = make_{kind}4(v[0], v[1], v[2], v[3]);
#else
    a.data[i] = v;
#endif
"""


def _memory_access(vector, kind: str, real: str) -> tuple:
    """Return load and store of a four-vector; Warp's types lack the alignment for 16 bytes at once."""
    load_code, store_code = "return a.data[i];", "a.data[i] = v;"
    if kind:
        load_code, store_code = LOAD_16.format(kind=kind, real=real), STORE_16.format(kind=kind)

    @wp.func_native(load_code)
    def load(a: wp.array(dtype=vector), i: int) -> vector: ...

    @wp.func_native(store_code)
    def store(a: wp.array(dtype=vector), i: int, v: vector): ...

    return load, store


def _fixed_point_spheres(precision: Precision) -> SimpleNamespace:
    sphere, vec3, vec4, real = precision.sphere, precision.vec3, precision.vec4, precision.real
    World = device_structs(precision).World

    @wp.func
    def pack(position: wp.vec3d, last: real, world: World) -> sphere:
        rate = wp.float64(1.0) / wp.float64(world.unit)
        d = (position - world.origin) * rate
        return sphere(int(wp.rint(d[0])), int(wp.rint(d[1])), int(wp.rint(d[2])), wp.cast(last, wp.int32))

    @wp.func
    def pack_offset(center: sphere, offset: vec3, last: real, world: World) -> sphere:
        # the unit is a power of two: its inverse is exact
        d = offset * (real(1.0) / world.unit)
        return sphere(
            center[0] + int(wp.rint(d[0])),
            center[1] + int(wp.rint(d[1])),
            center[2] + int(wp.rint(d[2])),
            wp.cast(last, wp.int32),
        )

    @wp.func
    def difference(a: sphere, b: sphere, world: World) -> vec3:
        return vec3(real(a[0] - b[0]), real(a[1] - b[1]), real(a[2] - b[2])) * world.unit

    @wp.func
    def last(a: sphere) -> real:
        return wp.cast(a[3], wp.float32)

    @wp.func
    def no_radius() -> int:
        return wp.cast(wp.NAN, wp.int32)

    @wp.func
    def stamp(displacement: vec3, step: int) -> vec4:
        return vec4(displacement[0], displacement[1], displacement[2], wp.cast(step, wp.float32))

    @wp.func
    def stamped_step(history: vec4) -> int:
        return wp.cast(history[3], wp.int32)

    return SimpleNamespace(
        pack=pack,
        pack_offset=pack_offset,
        difference=difference,
        last=last,
        no_radius=no_radius,
        stamp=stamp,
        stamped_step=stamped_step,
    )


def _float_spheres(precision: Precision) -> SimpleNamespace:
    sphere, vec3, vec4, real = precision.sphere, precision.vec3, precision.vec4, precision.real
    World = device_structs(precision).World

    @wp.func
    def pack(position: wp.vec3d, last: real, world: World) -> sphere:
        d = position - world.origin
        return sphere(d[0], d[1], d[2], last)

    @wp.func
    def pack_offset(center: sphere, offset: vec3, last: real, world: World) -> sphere:
        return sphere(center[0] + offset[0], center[1] + offset[1], center[2] + offset[2], last)

    @wp.func
    def difference(a: sphere, b: sphere, world: World) -> vec3:
        return vec3(a[0] - b[0], a[1] - b[1], a[2] - b[2])

    @wp.func
    def last(a: sphere) -> real:
        return a[3]

    @wp.func
    def no_radius() -> real:
        return real(wp.NAN)

    @wp.func
    def stamp(displacement: vec3, step: int) -> vec4:
        return vec4(displacement[0], displacement[1], displacement[2], real(step))

    @wp.func
    def stamped_step(history: vec4) -> int:
        return int(history[3])

    return SimpleNamespace(
        pack=pack,
        pack_offset=pack_offset,
        difference=difference,
        last=last,
        no_radius=no_radius,
        stamp=stamp,
        stamped_step=stamped_step,
    )


def _nearest_image(precision: Precision) -> Any:
    """Return the function of the difference of two spheres to the nearest image of the second."""
    sphere, vec3, real = precision.sphere, precision.vec3, precision.real
    World = device_structs(precision).World

    @wp.func
    def difference(a: sphere, b: sphere, world: World) -> vec3:
        d = a - b
        for axis in range(2):
            if d[axis] + d[axis] > world.period:
                d[axis] = d[axis] - world.period
            elif d[axis] + d[axis] < -world.period:
                d[axis] = d[axis] + world.period
        return vec3(real(d[0]), real(d[1]), real(d[2])) * world.unit

    return difference


@functools.cache
def packing(precision: Precision, is_periodic: bool = False) -> SimpleNamespace:
    """Return functions on packed spheres and histories in one precision, in worlds with or without a period.

    `last` is the radius of a sphere or the size factor of a centre; `difference` and `place` are in metres.
    """
    sphere, vec4 = precision.sphere, precision.vec4
    World = device_structs(precision).World
    functions = (_fixed_point_spheres if precision.is_fixed_point else _float_spheres)(precision)

    @wp.func
    def place(a: sphere, world: World) -> wp.vec3d:
        unit = wp.float64(world.unit)
        return world.origin + wp.vec3d(wp.float64(a[0]), wp.float64(a[1]), wp.float64(a[2])) * unit

    functions.place = place
    if is_periodic:
        functions.difference = _nearest_image(precision)
    short = precision.is_fixed_point
    functions.load_sphere, functions.store_sphere = _memory_access(
        sphere, "int" if short else "", "wp::int32"
    )
    functions.load_vec4, functions.store_vec4 = _memory_access(vec4, "float" if short else "", "wp::float32")
    return functions
