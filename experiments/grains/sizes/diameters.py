"""Diameters of a grain of any shape, by instrument: sieve, Feret, volume-equivalent."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from itertools import product

import numpy as np

from dem_warp import ClumpShape

STARTS, BEST = 12, 6
"""Steps of each angle of the tried rotations, and the number of the best that are refined."""


def volume_diameter(shape: ClumpShape) -> float:
    """Return the diameter of the sphere of the same volume [m]."""
    return float(np.cbrt(6.0 * shape.volume / np.pi))


@lru_cache(maxsize=64)
def feret_diameter(shape: ClumpShape) -> float:
    """Return the largest Feret diameter: the largest distance between two points of the shape [m]."""
    apart = np.linalg.norm(shape.centers[:, None] - shape.centers[None], axis=2)
    return float((apart + shape.radii[:, None] + shape.radii[None]).max())


@lru_cache(maxsize=64)
def sieve_diameter(shape: ClumpShape) -> float:
    """Return the side of the smallest square opening that the shape passes in any orientation [m].

    It passes along a line if its shadow along that line is within the square. A long grain passes end on, and
    a flat one along the diagonal: the side is then below its width.
    """
    if shape.sphere_count == 1:
        return float(2.0 * shape.radii[0])
    # they take a third of a second to load, which most studies do not need
    from scipy.optimize import minimize
    from scipy.spatial.transform import Rotation

    def side(turn: np.ndarray) -> float:
        return float(_widths(shape, Rotation.from_euler("zyx", turn).as_matrix()[:2]).max())

    quarter, half = np.linspace(0.0, np.pi / 2, STARTS // 2, endpoint=False), np.linspace(0.0, np.pi, STARTS)
    starts = sorted(product(quarter, half, half), key=lambda turn: side(np.array(turn)))[:BEST]
    refined = [
        minimize(side, start, method="Nelder-Mead", options={"xatol": 1e-4, "fatol": 1e-7 * side(start)}).fun
        for start in map(np.array, starts)
    ]
    return float(min(refined))


def _widths(shape: ClumpShape, directions: np.ndarray) -> np.ndarray:
    """Return the widths of a shape along unit vectors (k, 3) [m]."""
    along = shape.centers @ directions.T
    radii = shape.radii[:, None]
    return (along + radii).max(axis=0) - (along - radii).min(axis=0)


DIAMETERS: Mapping[str, Callable[[ClumpShape], float]] = {
    "sieve": sieve_diameter,
    "feret": feret_diameter,
    "volume": volume_diameter,
}
"""Diameters by their names in studies."""
