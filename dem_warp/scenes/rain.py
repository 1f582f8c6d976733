"""Grains that rain into a container: places without overlap, found one grain after another on the device.

In the frame that falls with the rain, grain i is at height i times speed over rate, at the first random place
of the cross-section without overlap. A grain is released to gravity when it crosses the release plane.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dem_warp.clumps import stack_spheres
from dem_warp.population import DrawnGrains


@dataclass(frozen=True)
class CrossSection:
    """Opening for a rain, centred on the z axis."""

    half_sides: tuple[float, float]
    """Half sides along x and y [m]."""
    is_round: bool = False
    """True for a circle, whose radius is both `half_sides`; False for a rectangle."""

    @classmethod
    def circle(cls, radius: float) -> "CrossSection":
        """Return the cross-section of a tube of a radius [m]."""
        return cls((radius, radius), True)

    def open_area(self, reach: float) -> float:
        """Return the area for the centres of grains of a bounding radius [m2], at least a tenth of all."""
        x, y = (max(half - reach, half / 3) for half in self.half_sides)
        return x * y * (np.pi if self.is_round else 4.0)


@dataclass(frozen=True, eq=False)
class Rain:
    """A rain in its own frame."""

    grains: DrawnGrains
    """Grains in order of arrival."""
    positions: np.ndarray
    """Positions [m], shape (n, 3), the lowest grain near z = 0."""
    orientations: np.ndarray
    """Quaternions x y z w, shape (n, 4)."""


def place_rain(
    grains: Sequence[DrawnGrains],
    seeds: Sequence[int],
    sections: Sequence[CrossSection],
    spacings: Sequence[float],
    device: Any,
) -> list[Rain]:
    """Return the rains of several independent worlds; raise ValueError if one has no room.

    Each world has its grains in order of arrival, a seed, the cross-section of its container, and a spacing:
    the mean height between two grains, speed over rate [m].
    """
    # reading a scene's parameters does not load Warp's kernels
    import warp as wp

    from dem_warp.kernels.lanes import WARP
    from dem_warp.kernels.rain import MAX_DELAYS, place_grains

    orientations = [random_orientations(drawn.count, seed) for drawn, seed in zip(grains, seeds, strict=True)]
    reaches = [float(drawn.bounding_radii.max()) for drawn in grains]
    first = np.cumsum([0, *(drawn.count for drawn in grains)])
    table = list(dict.fromkeys(clump for drawn in grains for clump in drawn.clumps))
    number = {clump: i for i, clump in enumerate(table)}
    shapes = [np.array([number[clump] for clump in drawn.clumps])[drawn.shapes] for drawn in grains]
    spheres = stack_spheres(table)
    with wp.ScopedDevice(device):
        position = wp.zeros(int(first[-1]), dtype=wp.vec3)
        delays = wp.zeros(len(grains), dtype=int)
        lanes = WARP if wp.get_device().is_cuda else 1
        inputs = [
            lanes,
            wp.array(first, dtype=int),
            spheres.shape[1],
            wp.array(spheres.reshape(-1, 4), dtype=wp.vec4),
            wp.array([clump.sphere_count for clump in table], dtype=int),
            wp.array(reaches, dtype=float),
            wp.array([(*s.half_sides, s.half_sides[0] * s.is_round) for s in sections], dtype=wp.vec3),
            wp.array(list(spacings), dtype=float),
            wp.array([seed & 0x7FFFFFFF for seed in seeds], dtype=int),
            wp.array(np.concatenate(shapes), dtype=int),
            wp.array(np.concatenate(orientations), dtype=wp.quat),
            wp.array(np.concatenate([drawn.sizes for drawn in grains]), dtype=float),
            position,
            wp.zeros(int(first[-1]) * spheres.shape[1], dtype=wp.vec4),
            delays,
        ]
        wp.launch(place_grains, len(grains) * lanes, inputs=inputs, block_dim=WARP)
        placed = np.split(position.numpy().astype(float), first[1:-1])
        crowded = np.flatnonzero(delays.numpy() >= MAX_DELAYS)
    if crowded.size:
        width = 2e3 * min(sections[crowded[0]].half_sides)
        raise ValueError(
            f"no free place for the rain: grains of {2e3 * reaches[crowded[0]]:.2f} mm in a container of "
            f"{width:.2f} mm; lower rain_rate, raise rain_speed or widen the container"
        )
    return [Rain(*world) for world in zip(grains, placed, orientations, strict=True)]


def random_orientations(count: int, seed: int) -> np.ndarray:
    """Draw uniformly distributed unit quaternions, (count, 4)."""
    q = np.random.default_rng([seed, 1]).normal(size=(count, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)
