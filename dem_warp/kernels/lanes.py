"""Exchange between the lanes of a GPU warp; on a CPU each lane is a warp of its own."""

import functools
from typing import Any

import warp as wp

WARP = 32
"""Lanes of a warp."""

ALL_LANES = wp.constant(-1)
"""Result of `lanes_with` if the value is True in all lanes of a GPU warp."""

BLOCK = 128
"""Threads of a block, with shared memory."""

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

PREFETCH = """
#if defined(__CUDA_ARCH__)
    asm volatile("prefetch.global.L1 [%0];" :: "l"(a.data + i));
#endif
"""


def shared(kind: str, per_warp: int) -> str:
    """Return the code of a function (index, value, write) on `per_warp` cells of a warp's shared memory."""
    return SHARED.format(kind=kind, size=per_warp * BLOCK // WARP, part=per_warp)


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return (int)__ballot_sync(0xffffffffu, value);
#else
    return (int)value;
#endif
""")
def lanes_with(value: bool) -> int: ...


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
    for (int o = 16; o > 0; o >>= 1) value = max(value, __shfl_xor_sync(0xffffffffu, value, o));
#endif
    return value;
""")
def largest_of_warp(value: float) -> float: ...


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
    int2 t = reinterpret_cast<const int2*>(a.data)[i];
    return wp::vec_t<2, wp::int32>(t.x, t.y);
#else
    return a.data[i];
#endif
""")
def load_pair(a: wp.array(dtype=wp.vec2i), i: int) -> wp.vec2i: ...


@functools.cache
def prefetcher(kind: Any) -> Any:
    """Return a function (array of `kind`, index) that prefetches an element."""

    @wp.func_native(PREFETCH)
    def prefetch(a: wp.array(dtype=kind), i: int): ...

    return prefetch
