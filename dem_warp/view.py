"""View of a world, as its scene has it between two chunks of steps."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class WorldView:
    """View of one world that a scene has between two chunks; arrays are by grain slot."""

    step: int
    """Steps done."""
    time: float
    """[s]."""
    alive: np.ndarray
    released: np.ndarray
    """Grains that move freely."""
    positions: np.ndarray
    velocities: np.ndarray
    """[m], [m/s], shape (n, 3)."""
    masses: np.ndarray
    """[kg], shape (n,)."""
    impulse: float
    """Impulse that the grains have given to the weighed wall since the first step [N s]; see
    `Solver.impulses`."""
    rms_speed: float
    fastest: float
    """Root mean square, and largest, speed of the living grains [m/s]; 0 where none lives."""
    highest: float
    """Height of the highest centre of a living grain [m]; minus infinity where none lives."""


def overviews(
    positions: np.ndarray, velocities: np.ndarray, alive: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`WorldView.rms_speed`, `fastest` and `highest` of many worlds at once.

    Parameters
    ----------
    positions, velocities : (worlds, n, 3 or more) arrays
        [m], [m/s]; what stands behind their three components is not looked at.
    alive : (worlds, n) bool array

    Returns
    -------
    rms_speeds, fastest, highest : (worlds,) arrays
        [m/s], [m/s], [m]
    """
    x, y, z = (velocities[:, :, axis] for axis in range(3))
    squares = np.where(alive, x * x + y * y + z * z, 0.0)
    mean = squares.sum(axis=1) / np.maximum(np.count_nonzero(alive, axis=1), 1)
    highest = np.where(alive, positions[:, :, 2], -np.inf).max(axis=1)
    return np.sqrt(mean), np.sqrt(squares.max(axis=1)), highest
