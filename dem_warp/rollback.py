"""The state of a batch a stretch ago, so that a world can take its last steps again.

A grain may come farther than the neighbour lists allow for, and its contacts be seen late. What a world does
then follows from its lists; so it goes back to where they still held, and looks at them more often.
"""

import warp as wp

from dem_warp.snapshot import state_arrays
from dem_warp.solver import Solver


class Rollback:
    """A copy of all that the steps of a batch change, on its device."""

    def __init__(self, solver: Solver) -> None:
        self._worlds = solver.layout.world_count
        self._state = [arrays[0] for arrays in state_arrays(solver).values()]
        self._state += [solver.neighbours.near.top, solver.fastest]
        self._kept = [wp.empty_like(array) for array in self._state]

    def keep(self) -> None:
        """Remember the present state of all worlds, between two calls of `Solver.advance`."""
        for kept, array in zip(self._kept, self._state, strict=True):
            wp.copy(kept, array)

    def restore(self, world: int) -> None:
        """Bring a world back to where it was when it was last kept; no other world changes."""
        for kept, array in zip(self._kept, self._state, strict=True):
            wp.copy(array.reshape((self._worlds, -1))[world], kept.reshape((self._worlds, -1))[world])
