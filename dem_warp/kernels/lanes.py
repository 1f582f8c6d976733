"""What the lanes of a GPU warp tell one another; on a CPU each is a warp of its own lane."""

import warp as wp

WARP = 32
"""Lanes of a warp."""

BLOCK = 128
"""Threads of a block, that share memory."""

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


def shared(kind: str, per_warp: int) -> str:
    """Code of a function (index, value, write) on the `per_warp` cells of shared memory of a warp."""
    return SHARED.format(kind=kind, size=per_warp * BLOCK // WARP, part=per_warp)


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return __any_sync(0xffffffffu, value);
#else
    return value;
#endif
""")
def any_lane(value: bool) -> bool: ...


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
    return __ffs(bits) - 1;
#else
    return __builtin_ffs(bits) - 1;
#endif
""")
def lowest_bit(bits: int) -> int: ...


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    __syncwarp();
#endif
""")
def sync_warp(): ...


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    int lane = threadIdx.x & 31;
    for (int o = 1; o < 32; o <<= 1) {
        int before = __shfl_up_sync(0xffffffffu, value, o);
        if (lane >= o) value += before;
    }
#endif
    return value;
""")
def running_sum(value: int) -> int: ...


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return __shfl_sync(0xffffffffu, value, lane);
#else
    return value;
#endif
""")
def from_lane(value: int, lane: int) -> int: ...


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    int4 t = reinterpret_cast<const int4*>(a.data + i)[0];
    return wp::vec_t<4, wp::int32>(t.x, t.y, t.z, t.w);
#else
    return wp::vec_t<4, wp::int32>(a.data[i], a.data[i + 1], a.data[i + 2], a.data[i + 3]);
#endif
""")
def load_quad(a: wp.array(dtype=int), i: int) -> wp.vec4i: ...
