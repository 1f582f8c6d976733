"""Grains that rain into a container: places without overlap, found one grain after another on the device.

The rain is laid out in the frame that falls with it, grain i at height i times speed over rate, and each
grain is tried at random places of the container's cross-section until it overlaps no grain before it. In the
laboratory the whole rain comes down at one speed; a grain is released to gravity when it crosses the release
plane, so grains never overlap before that.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dem_warp.clumps import stack_spheres
from dem_warp.population import DrawnGrains


@dataclass(frozen=True)
class CrossSection:
    """Opening that a rain falls through, about the z axis."""

    half_sides: tuple[float, float]
    """Along x and y [m]."""
    is_round: bool = False
    """A circle, with `half_sides` both its radius; otherwise a rectangle."""

    @classmethod
    def circle(cls, radius: float) -> "CrossSection":
        """Cross-section of a tube [m]."""
        return cls((radius, radius), True)


@dataclass(frozen=True, eq=False)
class Rain:
    """A rain in its own frame."""

    grains: DrawnGrains
    """In order of arrival."""
    positions: np.ndarray
    """[m], shape (n, 3), the lowest grain near z = 0."""
    orientations: np.ndarray
    """Quaternions x y z w, shape (n, 4)."""


def place_rain(
    grains: Sequence[DrawnGrains],
    seeds: Sequence[int],
    sections: Sequence[CrossSection],
    spacings: Sequence[float],
    device: Any,
) -> list[Rain]:
    """Rains of several worlds, none depending on another.

    Parameters
    ----------
    grains : sequence of DrawnGrains
        Of each world, in order of arrival.
    seeds : sequence of int
    sections : sequence of CrossSection
        Of each world's container.
    spacings : sequence of float
        Mean height between two grains, speed over rate [m].

    Raises
    ------
    ValueError
        If a container is too narrow, or its rain too dense, for the grains.
    """
    # a scene's parameters are read without a device
    import warp as wp

    from dem_warp.kernels.lanes import WARP
    from dem_warp.kernels.rain import MAX_DELAYS, place_grains

    orientations = [
        _random_orientations(drawn.count, seed) for drawn, seed in zip(grains, seeds, strict=True)
    ]
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
            wp.array([_row(section) for section in sections], dtype=wp.vec3),
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
            f"the rain finds no free place: grains of {2e3 * reaches[crowded[0]]:.2f} mm in a container of "
            f"{width:.2f} mm; lower rain_rate, raise rain_speed or widen the container"
        )
    return [Rain(*world) for world in zip(grains, placed, orientations, strict=True)]


def _row(section: CrossSection) -> tuple[float, float, float]:
    """As the kernel takes it."""
    return *section.half_sides, section.half_sides[0] if section.is_round else 0.0


def _random_orientations(count: int, seed: int) -> np.ndarray:
    """Uniformly distributed unit quaternions, (count, 4)."""
    q = np.random.default_rng([seed, 1]).normal(size=(count, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)
