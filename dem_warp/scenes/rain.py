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
from dem_warp.kernels.rain import MAX_DELAYS, place_grains


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
        wp.launch(place_grains, worlds, inputs=inputs, block_dim=32)
        placed = position.numpy().astype(float).reshape(worlds, count, 3)
        late = delays.numpy()
    crowded = np.flatnonzero(late >= MAX_DELAYS)
    if crowded.size:
        raise ValueError(
            f"the rain finds no free place: grains of {2e3 * shape.bounding_radius:.2f} mm in a tube of "
            f"{2e3 * radii[int(crowded[0])]:.2f} mm; lower rain_rate, raise rain_speed or widen the tube"
        )
    return [Rain(placed[w], orientations[w], np.asarray(sizes[w])) for w in range(worlds)]


def _random_orientations(count: int, seed: int) -> np.ndarray:
    """Uniformly distributed unit quaternions, (count, 4)."""
    q = np.random.default_rng([seed, 1]).normal(size=(count, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)
