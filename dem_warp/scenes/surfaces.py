"""The surface of a bed of grains, seen in columns of a grain's size: its level, its profile and its slope."""

import math

import numpy as np

TOP_OF_GRAIN = 0.5
"""The surface lies this part of a grain's bounding radius above the highest centres."""

FLANK = (0.1, 0.9)
"""A flank is fitted where it rises between these parts of its height, clear of its foot and of a flat top."""

LEAST_RISE = 4.0
"""A flank that rises by less than this many bounding radii of a grain is none."""

LEAST_POINTS = 3
"""Points of a profile that a line is fitted to, at the least."""


def column_tops(places: np.ndarray, heights: np.ndarray, side: float) -> tuple[np.ndarray, np.ndarray]:
    """Highest centre of each square column that holds one.

    Parameters
    ----------
    places : (n, 2) array
        Horizontal places of the centres [m].
    heights : (n,) array
        Their heights [m].
    side : float
        Of a column [m].

    Returns
    -------
    columns : (k, 2) int array
        Column [i, j] holds the places from i and j times `side` on, in order of first appearance.
    tops : (k,) array
        [m]
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
    """Height of a bed's surface in a container [m]; 0 without grains.

    It is the mean, over columns of a grain's size, of the highest centre, plus half a grain.

    Parameters
    ----------
    positions : (n, 3) array
        Grain centres [m].
    half_sides : 2 floats
        Of the container, along x and y [m]: its columns are counted from a corner.
    reach : float
        Bounding radius of a grain [m].
    """
    if not len(positions):
        return 0.0
    _, tops = column_tops(positions[:, :2] + np.array(half_sides), positions[:, 2], 2 * reach)
    return float(np.mean(tops) + TOP_OF_GRAIN * reach)


def profile(positions: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Surface of a bed that is the same all along y: the highest centres over x, averaged along y.

    Parameters
    ----------
    positions : (n, 3) array
        Grain centres [m].
    reach : float
        Bounding radius of a grain [m].

    Returns
    -------
    x, z : (k,) arrays
        Middles of the columns, in ascending order, and heights [m].
    """
    side = 2 * reach
    columns, tops = column_tops(positions[:, :2], positions[:, 2], side)
    across, owner = np.unique(columns[:, 0], return_inverse=True)
    heights = np.bincount(owner, weights=tops) / np.bincount(owner)
    return (across + 0.5) * side, heights


def slope(x: np.ndarray, z: np.ndarray) -> float | None:
    """Gradient dz/dx of the least-squares line through a profile; None for fewer than LEAST_POINTS."""
    if len(x) < LEAST_POINTS:
        return None
    offset = x - x.mean()
    return float(offset @ z / (offset @ offset))


def flank_angle(x: np.ndarray, z: np.ndarray, reach: float) -> float | None:
    """Inclination of a flank [deg], None where it is too low or too short to be seen.

    It is that of the least-squares line from the first to the last point within FLANK of the height. All
    points in between count: a choice by height alone would favour those that make the line flatter.

    Parameters
    ----------
    x, z : (n,) arrays
        A profile that rises, or falls, from one end to the other, x ascending [m].
    reach : float
        Bounding radius of a grain [m].
    """
    if not len(z) or np.ptp(z) < LEAST_RISE * reach:
        return None
    low, high = z.min() + np.ptp(z) * np.array(FLANK)
    within = np.flatnonzero((z >= low) & (z <= high))
    flank = slice(within.min(initial=len(z)), within.max(initial=-1) + 1)
    gradient = slope(x[flank], z[flank])
    return None if gradient is None else math.degrees(math.atan(abs(gradient)))
