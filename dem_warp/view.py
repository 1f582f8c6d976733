"""State of a world for its scene, between two chunks of steps."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class WorldView:
    """State of one world for its scene; arrays are by grain slot."""

    step: int
    """Number of steps done."""
    time: float
    """Time [s]."""
    alive: np.ndarray
    released: np.ndarray
    """Grains that are in the world, and that move freely."""
    positions: np.ndarray
    velocities: np.ndarray
    """Positions [m] and velocities [m/s], shape (n, 3)."""
    masses: np.ndarray
    """Masses [kg], shape (n,)."""
    impulses: np.ndarray
    """Impulses of the grains on the weighed walls since the first step [N s], shape (weighed walls, 3)."""
    rms_speed: float
    fastest: float
    """Root mean square and largest speed of the grains in the world [m/s]; 0 without grains."""
    highest: float
    """Height of the highest centre of a grain in the world [m]; minus infinity without grains."""
    rise: float = 0.0
    """Path of the free wall along z since the start of its motion [m]."""


def overviews(
    positions: np.ndarray, velocities: np.ndarray, alive: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return `WorldView.rms_speed`, `fastest` and `highest` of many worlds, (worlds,) each.

    `positions` [m] and `velocities` [m/s] are (worlds, n, 3 or more), `alive` is (worlds, n).
    """
    x, y, z = (velocities[:, :, axis] for axis in range(3))
    squares = np.where(alive, x * x + y * y + z * z, 0.0)
    mean = squares.sum(axis=1) / np.maximum(np.count_nonzero(alive, axis=1), 1)
    highest = np.where(alive, positions[:, :, 2], -np.inf).max(axis=1)
    return np.sqrt(mean), np.sqrt(squares.max(axis=1)), highest
