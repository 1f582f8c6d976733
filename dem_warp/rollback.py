"""The state of a batch a stretch ago, so that a world can take its last steps again.

A grain may come farther than the neighbour lists allow for, and its contacts be seen late. What a world does
then follows from its lists; so it goes back to where they still held, and looks at them more often.
"""

import warp as wp

from dem_warp.snapshot import LISTS, state_arrays
from dem_warp.solver import Solver


class Rollback:
    """A copy of all that the steps of a batch change, on its device."""

    def __init__(self, solver: Solver) -> None:
        self._worlds, self._grains = solver.layout.world_count, solver.layout.grain_total
        held = {
            "neighbours.list": solver.neighbours.list,
            "near.top": solver.neighbours.near.top,
            "world.fastest": solver.fastest,
        }
        self._state = {name: arrays[0] for name, arrays in state_arrays(solver).items()} | held
        self._kept = {name: wp.empty_like(array) for name, array in self._state.items()}

    def keep(self) -> None:
        """Remember the present state of all worlds, between two calls of `Solver.advance`."""
        for name, array in self._state.items():
            wp.copy(self._kept[name], array)

    def restore(self, world: int) -> None:
        """Bring a world back to where it was when it was last kept; no other world changes."""
        for name, array in self._state.items():
            lists = (
                LISTS if name.startswith("neighbours.") and array.size % (LISTS * self._grains) == 0 else 1
            )
            kept, present = (each.reshape((lists, self._worlds, -1)) for each in (self._kept[name], array))
            for number in range(lists):
                wp.copy(present[number, world], kept[number, world])
