"""Sum of a grain's contacts, in the order of its candidates, on one thread or by a warp of the GPU.

A single thread walks through the candidates and evaluates those that touch. A GPU warp would leave most of its lanes idle
that way, as about one candidate in four touches. So the warp first searches, each grain by its own few lanes, and queues
what touches; then all lanes evaluate the queue, 32 contacts at once; then the grains' lanes add up, component by component,
in the order of the candidates. Both ways, and any number of lanes, give the same float sum.
"""

import functools

import warp as wp

from dem_warp.kernels.contacts import contact_functions
from dem_warp.types import Precision, device_structs

WARP = 32
BLOCK = 128
MIN_LANES = 2
COMPONENTS = 7  # force, torque, rolling torque
QUEUE = WARP * WARP // MIN_LANES  # a round of 32 candidates of every grain of the warp, all touching
SUMS = COMPONENTS * WARP // MIN_LANES

SHARED = """
#if defined(__CUDA_ARCH__)
    __shared__ {kind} memory[{size}];
    {kind}& cell = memory[(threadIdx.x >> 5) * {part} + index];
    if (write) cell = value;
    return cell;
#else
    return value;
#endif
"""


def _shared(kind: str, per_warp: int) -> str:
    return SHARED.format(kind=kind, size=per_warp * BLOCK // WARP, part=per_warp)


@wp.func_native(_shared("int", QUEUE))
def queue(index: int, value: int, write: bool) -> int: ...


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return (int)__ballot_sync(0xffffffffu, value);
#else
    return value;
#endif
""")
def ballot(value: bool) -> int: ...


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return __popc((unsigned)bits);
#else
    return __builtin_popcount((unsigned)bits);
#endif
""")
def bit_count(bits: int) -> int: ...


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    __syncwarp();
#endif
""")
def sync_warp(): ...


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    int lane = threadIdx.x & 31;
    for (int o = lanes; o < 32; o <<= 1) {
        int before = __shfl_up_sync(0xffffffffu, count, o);
        if (lane >= o) count += before;
    }
#endif
    return count;
""")
def sum_before_and_own(count: int, lanes: int) -> int: ...


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return __shfl_sync(0xffffffffu, value, lane);
#else
    return value;
#endif
""")
def from_lane(value: int, lane: int) -> int: ...


@wp.func_native("return (int)(~0u >> (32 - count));")
def low_bits(count: int) -> int: ...


@wp.func_native("return (int)((1u << bit) - 1u);")
def bits_below(bit: int) -> int: ...


@functools.cache
def serial_sum(precision: Precision):
    """Function that sums a grain's contacts on one thread."""
    real, vec3 = precision.real, precision.vec3
    types = device_structs(precision)
    Model, World, Grains, Neighbours = types.Model, types.World, types.Grains, types.Neighbours  # noqa: N806
    contacts = contact_functions(precision)

    @wp.func
    def sum_contacts(
        model: Model, world: World, grains: Grains, hood: Neighbours, w: int, g: int, count: int, first: int,
        near: int, step: int, thread: int, lane: int, lanes: int,
    ):  # fmt: skip
        force = vec3()
        torque = vec3()
        rolling = real(0.0)
        for c in range(count + contacts.near_count(model, near) * model.sphere_count):
            if contacts.touches(model, world, grains, hood, w, g, c, count, first, near, step):
                f, t, r = contacts.contact(model, world, grains, hood, w, g, c, count, first, near, step)
                force += f
                torque += t
                rolling += r
        return force, torque, rolling

    return sum_contacts


@functools.cache
def cooperative_sum(precision: Precision):
    """Function that sums the contacts of a warp's grains; every lane of the warp must call it."""
    real, vec3 = precision.real, precision.vec3
    types = device_structs(precision)
    Model, World, Grains, Neighbours = types.Model, types.World, types.Grains, types.Neighbours  # noqa: N806
    contacts = contact_functions(precision)
    kind = "float" if precision.is_fixed_point else "double"

    @wp.func_native(_shared(kind, COMPONENTS * WARP))
    def result(index: int, value: real, write: bool) -> real: ...

    @wp.func_native(_shared(kind, SUMS))
    def total(index: int, value: real, write: bool) -> real: ...

    @wp.func
    def write_result(lane: int, f: vec3, t: vec3, r: real):
        for i in range(3):
            result(i * WARP + lane, f[i], True)
            result((i + 3) * WARP + lane, t[i], True)
        result(6 * WARP + lane, r, True)

    @wp.func
    def add_results(group: int, lane: int, lanes: int, begin: int, end: int):
        """Adds results `begin` to `end` to the group's sums, one component a lane, in order."""
        for i in range(lane, COMPONENTS, lanes):
            value = total(group * COMPONENTS + i, real(0.0), False)
            for k in range(begin, end):
                value += result(i * WARP + k, real(0.0), False)
            total(group * COMPONENTS + i, value, True)

    @wp.func
    def touching_bits(
        model: Model, world: World, grains: Grains, hood: Neighbours, w: int, g: int, count: int, first: int,
        near: int, step: int, begin: int, candidates: int, group: int, lane: int, lanes: int,
    ) -> int:  # fmt: skip
        """Which of the grain's 32 candidates from `begin` on touch, known to each of its lanes."""
        bits = int(0)
        for offset in range(0, WARP, lanes):
            c = begin + offset + lane
            touching = bool(False)
            if c < candidates:
                touching = contacts.touches(model, world, grains, hood, w, g, c, count, first, near, step)
            bits = bits | (((ballot(touching) >> (group * lanes)) & low_bits(lanes)) << offset)
        return bits

    @wp.func
    def sum_contacts(
        model: Model, world: World, grains: Grains, hood: Neighbours, w: int, g: int, count: int, first: int,
        near: int, step: int, thread: int, lane: int, lanes: int,
    ):  # fmt: skip
        """`count` and `near` are 0 for a lane whose grain takes no part; w, g, count, first, near are those of its grain."""
        groups = WARP // lanes
        group = thread // lanes
        candidates = count + contacts.near_count(model, near) * model.sphere_count
        for i in range(lane, COMPONENTS, lanes):
            total(group * COMPONENTS + i, real(0.0), True)
        begin = int(0)
        while ballot(begin < candidates) != 0:
            bits = touching_bits(
                model, world, grains, hood, w, g, count, first, near, step, begin, candidates, group, lane, lanes
            )
            own = bit_count(bits)
            end = sum_before_and_own(own, lanes)
            start = end - own
            queued = from_lane(end, WARP - 1)
            for b in range(lane, WARP, lanes):
                if (bits >> b) & 1 == 1:
                    queue(start + bit_count(bits & (bits_below(b))), (group << 16) | (begin + b), True)
            sync_warp()
            for batch in range(0, queued, WARP):
                item = int(0)
                if batch + thread < queued:
                    item = queue(batch + thread, 0, False)
                source = (item >> 16) * lanes
                gi = from_lane(g, source)
                wi = from_lane(w, source)
                count_i = from_lane(count, source)
                first_i = from_lane(first, source)
                near_i = from_lane(near, source)
                step_i = from_lane(step, source)
                if batch + thread < queued:
                    f, t, r = contacts.contact(
                        model, model.world[wi], grains, hood, wi, gi, item & 0xFFFF, count_i, first_i, near_i, step_i
                    )
                    write_result(thread, f, t, r)
                sync_warp()
                add_results(
                    group, lane, lanes, wp.max(start, batch) - batch, wp.min(end, batch + WARP) - batch
                )
                sync_warp()
            begin += WARP
        sync_warp()
        row = group * COMPONENTS
        force = vec3(
            total(row, real(0.0), False), total(row + 1, real(0.0), False), total(row + 2, real(0.0), False)
        )
        torque = vec3(
            total(row + 3, real(0.0), False), total(row + 4, real(0.0), False), total(row + 5, real(0.0), False)
        )
        return force, torque, total(row + 6, real(0.0), False)

    return sum_contacts
