"""Grains that rain into a tube: places without overlap, found one grain after another on the device.

The rain is laid out in the frame that falls with it, grain i at height i times speed over rate, and each
grain is tried at random places of the tube's cross-section until it overlaps no grain before it. In the
laboratory the whole rain comes down at one speed; a grain is released to gravity when it crosses the release
plane, so grains never overlap before that.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dem_warp.clumps import ClumpShape

CLEARANCE = 1.02
"""Spheres are kept apart by this factor of the sum of their radii."""

TRIALS = 64
"""Places tried at one height; then the grain comes a little later."""

MAX_DELAYS = 4000


@dataclass(frozen=True, eq=False)
class Rain:
    """A rain in its own frame.

    Attributes
    ----------
    positions : (n, 3) array
        [m], the lowest grain near z = 0.
    orientations : (n, 4) array
        Quaternions x y z w.
    sizes : (n,) array
    """

    positions: np.ndarray
    orientations: np.ndarray
    sizes: np.ndarray


@wp.kernel(enable_backward=False)
def _place(
    grain_count: int,
    sphere_count: int,
    shape: wp.array(dtype=wp.vec4),
    reach: float,
    radius: wp.array(dtype=float),
    spacing: wp.array(dtype=float),
    seed: wp.array(dtype=int),
    orientation: wp.array(dtype=wp.quat),
    size: wp.array(dtype=float),
    position: wp.array(dtype=wp.vec3),
    spheres: wp.array(dtype=wp.vec4),
    delays: wp.array(dtype=int),
):
    """One thread a world: places its grains in order of arrival."""
    w = wp.tid()
    state = wp.rand_init(seed[w])
    late = int(0)
    for n in range(grain_count):
        g = w * grain_count + n
        placed = bool(False)
        while not placed and late < MAX_DELAYS:
            z = spacing[w] * float(n + late)
            for _trial in range(TRIALS):
                if not placed:
                    angle = 2.0 * wp.pi * wp.randf(state)
                    across = radius[w] * wp.sqrt(wp.randf(state))
                    center = wp.vec3(across * wp.cos(angle), across * wp.sin(angle), z)
                    free = bool(True)
                    for s in range(sphere_count):
                        local = shape[s] * size[g]
                        offset = wp.quat_rotate(orientation[g], wp.vec3(local[0], local[1], local[2]))
                        p = center + offset
                        spheres[g * sphere_count + s] = wp.vec4(p[0], p[1], p[2], local[3])
                        if wp.sqrt(p[0] * p[0] + p[1] * p[1]) + CLEARANCE * local[3] > radius[w]:
                            free = False
                    other = n - 1
                    while free and other >= 0 and z - position[w * grain_count + other][2] < 2.0 * reach:
                        h = w * grain_count + other
                        apart = wp.length(center - position[h])
                        if apart < CLEARANCE * reach * 2.0:
                            for a in range(sphere_count):
                                for b in range(sphere_count):
                                    sa = spheres[g * sphere_count + a]
                                    sb = spheres[h * sphere_count + b]
                                    d = wp.vec3(sa[0] - sb[0], sa[1] - sb[1], sa[2] - sb[2])
                                    if wp.length(d) < CLEARANCE * (sa[3] + sb[3]):
                                        free = False
                        other -= 1
                    if free:
                        position[g] = center
                        placed = True
            if not placed:
                late += 1
    delays[w] = late


def place_rain(
    shape: ClumpShape,
    sizes: Sequence[np.ndarray],
    seeds: Sequence[int],
    radii: Sequence[float],
    spacings: Sequence[float],
    device: Any,
) -> list[Rain]:
    """Rains of several worlds, which share a shape and a number of grains.

    Parameters
    ----------
    shape : ClumpShape
    sizes : sequence of (n,) arrays
        Sizes of the grains in order of arrival.
    seeds : sequence of int
    radii : sequence of float
        Inner radius of each tube [m].
    spacings : sequence of float
        Mean height between two grains, speed over rate [m].

    Raises
    ------
    ValueError
        If a tube is too narrow, or its rain too dense, for the grains.
    """
    worlds, count = len(sizes), len(sizes[0])
    orientations = [_random_orientations(count, seed) for seed in seeds]
    local = np.column_stack([shape.centers, shape.radii]).astype(np.float32)
    with wp.ScopedDevice(device):
        position = wp.zeros(worlds * count, dtype=wp.vec3)
        delays = wp.zeros(worlds, dtype=int)
        inputs = [
            count,
            shape.sphere_count,
            wp.array(local, dtype=wp.vec4),
            float(shape.bounding_radius * max(row.max() for row in sizes)),
            wp.array(np.asarray(radii, dtype=np.float32), dtype=float),
            wp.array(np.asarray(spacings, dtype=np.float32), dtype=float),
            wp.array(np.asarray([seed & 0x7FFFFFFF for seed in seeds], dtype=np.int32), dtype=int),
            wp.array(np.concatenate(orientations).astype(np.float32), dtype=wp.quat),
            wp.array(np.concatenate(sizes).astype(np.float32), dtype=float),
            position,
            wp.zeros(worlds * count * shape.sphere_count, dtype=wp.vec4),
            delays,
        ]
        wp.launch(_place, worlds, inputs=inputs, block_dim=32)
        placed = position.numpy().astype(float).reshape(worlds, count, 3)
        late = delays.numpy()
    for w in np.flatnonzero(late >= MAX_DELAYS):
        raise ValueError(
            f"the rain finds no free place: grains of {2e3 * shape.bounding_radius:.2f} mm in a tube of "
            f"{2e3 * radii[w]:.2f} mm; lower rain_rate, raise rain_speed or widen the tube"
        )
    return [Rain(placed[w], orientations[w], np.asarray(sizes[w])) for w in range(worlds)]


def _random_orientations(count: int, seed: int) -> np.ndarray:
    """Uniformly distributed unit quaternions, (count, 4)."""
    q = np.random.default_rng([seed, 1]).normal(size=(count, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)
