"""The container against the grain: in a narrow one the walls decide, not the contacts."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from dem_warp import ClumpShape, ShapeMixture

LEAST_WIDTH, ADVISED_WIDTH = 2.0, 4.0
"""Widths of a container in lengths of its longest grain: below the first, grains do not pass one another;
below the second, they bridge and the walls shape the heap."""


@lru_cache(maxsize=64)
def longest(shape: ClumpShape) -> float:
    """Length of a shape [m]: the largest distance between two points of it."""
    apart = np.linalg.norm(shape.centers[:, None] - shape.centers[None], axis=2)
    return float((apart + shape.radii[:, None] + shape.radii[None]).max())


def widths(diameter: float, shape: ClumpShape | ShapeMixture, size: float) -> float:
    """Width of a container [m] in lengths of the longest grain of a mean size."""
    shapes = shape.shapes if isinstance(shape, ShapeMixture) else (shape,)
    return diameter / (size * max(longest(each) for each in shapes))


def narrowness(diameter: float | None, shape: ClumpShape | ShapeMixture, size: float) -> str:
    """Say that a container is narrow, or nothing; ValueError where grains cannot pass one another."""
    if diameter is None:
        return ""
    found = widths(diameter, shape, size)
    width = f"its diameter of {1e3 * diameter:.4g} mm is {found:.2g} lengths of the longest grain"
    if found < LEAST_WIDTH:
        raise ValueError(f"must be at least {LEAST_WIDTH:g} grains wide, better {ADVISED_WIDTH:g}: {width}")
    return (
        f"the container is narrow, below {ADVISED_WIDTH:g} grains: {width}" if found < ADVISED_WIDTH else ""
    )
