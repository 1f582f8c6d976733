"""The surface of a bed of grains, in columns of a grain's size: its level, its profile and its slope."""

import math

import numpy as np

TOP_OF_GRAIN = 0.5
"""Height of the surface above the highest centres, over a grain's bounding radius."""

FLANK = (0.1, 0.9)
"""Parts of a flank's height between which it is fitted, to leave out its foot and a flat top."""

LEAST_RISE = 4.0
"""Least height of a flank, over a grain's bounding radius."""

LEAST_POINTS = 3
"""Least number of points for a line."""


def column_tops(places: np.ndarray, heights: np.ndarray, side: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the highest centre of each occupied square column.

    The `columns` (k, 2) begin at i and j times `side` [m], in order of first appearance; the `tops` (k,) are
    the largest `heights` [m] of the centres at `places` (n, 2) [m] in them.
    """
    cells = np.floor(places / side).astype(int)
    i, j = (cells - cells.min(axis=0)).T
    owner, number = i * (j.max() + 1) + j, np.arange(len(cells))
    tops = np.full(owner.max() + 1, -np.inf)
    np.maximum.at(tops, owner, heights)
    first = np.full(len(tops), len(cells))
    np.minimum.at(first, owner, number)
    seen = number[first[owner] == number]
    return cells[seen], tops[owner[seen]]


def bed_level(positions: np.ndarray, half_sides: tuple[float, float], reach: float) -> float:
    """Return the height of a bed's surface in a container [m]; 0 without grains.

    It is the mean over columns of the highest centre, plus half a bounding radius (`reach` [m]) of a grain.
    Columns are counted from a corner of the container, of `half_sides` [m] along x and y.
    """
    if not len(positions):
        return 0.0
    _, tops = column_tops(positions[:, :2] + np.array(half_sides), positions[:, 2], 2 * reach)
    return float(np.mean(tops) + TOP_OF_GRAIN * reach)


def profile(positions: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the surface of a bed that is uniform along y: middles of columns, ascending, and heights [m].

    The heights are the highest centres, averaged along y; `reach` is the bounding radius of a grain [m].
    """
    side = 2 * reach
    columns, tops = column_tops(positions[:, :2], positions[:, 2], side)
    across, owner = np.unique(columns[:, 0], return_inverse=True)
    heights = np.bincount(owner, weights=tops) / np.bincount(owner)
    return (across + 0.5) * side, heights


def slope(x: np.ndarray, z: np.ndarray) -> float | None:
    """Return the gradient dz/dx of the least-squares line; None for fewer than LEAST_POINTS."""
    if len(x) < LEAST_POINTS:
        return None
    offset = x - x.mean()
    return float(offset @ z / (offset @ offset))


def flank_angle(x: np.ndarray, z: np.ndarray, reach: float) -> float | None:
    """Return the inclination of a flank [deg], or None if it is too low or too short.

    It is the slope of the least-squares line from the first to the last point within FLANK of the height. All
    points between count: a choice by height alone would make the line flatter. The profile goes from one end
    of the flank to the other, x ascending [m]; `reach` is the bounding radius of a grain [m].
    """
    if not len(z) or np.ptp(z) < LEAST_RISE * reach:
        return None
    low, high = z.min() + np.ptp(z) * np.array(FLANK)
    within = np.flatnonzero((z >= low) & (z <= high))
    flank = slice(within.min(initial=len(z)), within.max(initial=-1) + 1)
    gradient = slope(x[flank], z[flank])
    return None if gradient is None else math.degrees(math.atan(abs(gradient)))
