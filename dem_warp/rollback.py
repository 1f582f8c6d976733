"""A copy of a batch's state, so that a world can repeat its last steps.

A grain may move farther than the neighbour lists allow, so that its contacts are found late. The world then
goes back to a state with valid lists and repeats the steps with more frequent checks.
"""

import warp as wp

from dem_warp.snapshot import state_arrays
from dem_warp.solver import Solver


class Rollback:
    """Copy of everything that steps change, on the device."""

    def __init__(self, solver: Solver) -> None:
        self._worlds = solver.layout.world_count
        self._state = [arrays[0] for arrays in state_arrays(solver).values()]
        self._state += [solver.neighbours.near.top, solver.fastest]
        self._kept = [wp.empty_like(array) for array in self._state]

    def keep(self) -> None:
        """Copy the present state of all worlds, between two calls of `Solver.advance`."""
        for kept, array in zip(self._kept, self._state, strict=True):
            wp.copy(kept, array)

    def restore(self, world: int) -> None:
        """Restore the copied state of one world."""
        for kept, array in zip(self._kept, self._state, strict=True):
            wp.copy(array.reshape((self._worlds, -1))[world], kept.reshape((self._worlds, -1))[world])
