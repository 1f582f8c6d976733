"""Places for the grains of a rain, without overlap."""

import warp as wp

from dem_warp.kernels.lanes import lanes_with, sync_warp

CLEARANCE = 1.02
"""Least distance of spheres over the sum of their radii."""

TRIALS = 64
"""Places tried at one height; then the grain is delayed."""

MAX_DELAYS = 4000
"""Most delays in a rain; then it fails."""


@wp.func
def place_in(section: wp.vec3, u: float, v: float) -> wp.vec2:
    """Return a point of a cross-section, uniform for uniform `u` and `v` in 0 to 1."""
    if section[2] > 0.0:
        angle = 2.0 * wp.pi * u
        across = section[2] * wp.sqrt(v)
        return wp.vec2(across * wp.cos(angle), across * wp.sin(angle))
    return wp.vec2((2.0 * u - 1.0) * section[0], (2.0 * v - 1.0) * section[1])


@wp.func
def is_outside(section: wp.vec3, x: float, y: float, radius: float) -> bool:
    """Return True if a sphere passes the edge of a cross-section."""
    if section[2] > 0.0:
        return wp.sqrt(x * x + y * y) + radius > section[2]
    return wp.abs(x) + radius > section[0] or wp.abs(y) + radius > section[1]


@wp.func
def spread_spheres(
    g: int,
    center: wp.vec3,
    lane: int,
    lanes: int,
    sphere_count: int,
    shape_spheres: wp.array(dtype=wp.vec4),
    count: int,
    first: int,
    orientation: wp.quat,
    size: float,
    section: wp.vec3,
    spheres: wp.array(dtype=wp.vec4),
) -> bool:
    """Place a grain's spheres, a sphere per lane; return True if one of the lane's passes the edge."""
    outside = bool(False)
    for s in range(lane, count, lanes):
        local = shape_spheres[first + s] * size
        p = center + wp.quat_rotate(orientation, wp.vec3(local[0], local[1], local[2]))
        spheres[g * sphere_count + s] = wp.vec4(p[0], p[1], p[2], local[3])
        if is_outside(section, p[0], p[1], CLEARANCE * local[3]):
            outside = True
    return outside


@wp.func
def meet(
    g: int, count: int, h: int, others: int, sphere_count: int, spheres: wp.array(dtype=wp.vec4)
) -> bool:
    """Return True if two grains are nearer than the clearance."""
    for a in range(count):
        for b in range(others):
            sa = spheres[g * sphere_count + a]
            sb = spheres[h * sphere_count + b]
            d = wp.vec3(sa[0] - sb[0], sa[1] - sb[1], sa[2] - sb[2])
            if wp.length(d) < CLEARANCE * (sa[3] + sb[3]):
                return True
    return False


@wp.kernel(enable_backward=False, grid_stride=False)
def place_grains(
    lanes: int,
    # model
    first: wp.array(dtype=int),
    sphere_count: int,
    shape_spheres: wp.array(dtype=wp.vec4),
    shape_sphere_count: wp.array(dtype=int),
    reach: wp.array(dtype=float),
    section: wp.array(dtype=wp.vec3),
    spacing: wp.array(dtype=float),
    seed: wp.array(dtype=int),
    shape: wp.array(dtype=int),
    orientation: wp.array(dtype=wp.quat),
    size: wp.array(dtype=float),
    # state out
    position: wp.array(dtype=wp.vec3),
    spheres: wp.array(dtype=wp.vec4),
    delays: wp.array(dtype=int),
):
    """Place the grains of a world, which begin at `first`, in order of arrival; a warp per world on a GPU.

    A cross-section has its half sides along x and y, and its radius if it is round, otherwise 0 [m].
    """
    thread = wp.tid()
    w = thread // lanes
    lane = thread - w * lanes
    state = wp.rand_init(seed[w])
    late = int(0)
    for g in range(first[w], first[w + 1]):
        n = g - first[w]
        count = shape_sphere_count[shape[g]]
        placed = bool(False)
        while not placed and late < MAX_DELAYS:
            z = spacing[w] * float(n + late)
            for _trial in range(TRIALS):
                if not placed:
                    u = wp.randf(state)
                    place = place_in(section[w], u, wp.randf(state))
                    center = wp.vec3(place[0], place[1], z)
                    outside = spread_spheres(
                        g, center, lane, lanes, sphere_count, shape_spheres, count,
                        shape[g] * sphere_count, orientation[g], size[g], section[w], spheres,
                    )  # fmt: skip
                    placed = lanes_with(outside) == 0
                    sync_warp()
                    # an earlier grain per lane, from the last one down to those too low to touch
                    last = g - 1
                    while placed and last >= first[w] and z - position[last][2] < 2.0 * reach[w]:
                        h = last - lane
                        met = bool(False)
                        if h >= first[w] and z - position[h][2] < 2.0 * reach[w]:
                            if wp.length(center - position[h]) < CLEARANCE * reach[w] * 2.0:
                                met = meet(g, count, h, shape_sphere_count[shape[h]], sphere_count, spheres)
                        placed = lanes_with(met) == 0
                        last -= lanes
                    if placed:
                        position[g] = center
            if not placed:
                late += 1
    delays[w] = late
