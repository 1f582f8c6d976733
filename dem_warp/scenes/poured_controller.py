"""Controllers of scenes that begin with a rain: filling, settling, and the measures of the fill."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np

from dem_warp.case import Case
from dem_warp.model import WorldSetup
from dem_warp.scenes.phases import UNREST, Phase, PhasedController
from dem_warp.scenes.poured_scene import PouredScene
from dem_warp.scenes.scene import Decision, StateT
from dem_warp.scenes.surfaces import bed_level
from dem_warp.view import WorldView
from dem_warp.walls import Motion

HEAPED = 4
"""Number of slow grains above the brim at which the container is full."""


class PouredController(PhasedController[StateT]):
    """Controller that fills the container and lets the grains settle; the later phases are the scene's."""

    FILL_MARGIN, SETTLE_LIMIT = 2.0, 3.0
    """Longest time of filling after the rain, and of settling [s]."""

    def __init__(self, case: Case[Any], setup: WorldSetup, chunk: int, state: StateT) -> None:
        super().__init__(case, setup, chunk, state)
        self.poured: PouredScene = case.scene
        self.reach = float(setup.bounding_radii.max())
        self.rain_end = float(setup.grains.release_steps.max() * setup.time_step)
        self.phases = {
            "fill": Phase(self._fill, self.rain_end + 0.1),
            "settle": Phase(self._settle, 0.2),
        }

    @abstractmethod
    def begin(self, view: WorldView, kept: np.ndarray) -> Mapping[int, Motion]:
        """Enter the scene's first own phase with the resting grains `kept`; return the walls' motions."""

    def _fill(self, view: WorldView) -> Decision:
        if view.time > self.rain_end + self.FILL_MARGIN:
            failure = f"the filling did not end within {self.FILL_MARGIN:g} s of the rain; {UNREST}"
            return Decision(done=True, failure=failure)
        awaited = view.alive & ~view.released
        if not (self.is_full(view) or (not awaited.any() and self.rests(view))):
            return Decision()
        self.state.enter("settle", view)
        if self.poured.is_counted:
            return Decision()
        return Decision(remove=np.flatnonzero(self.surplus(view) | awaited))

    def surplus(self, view: WorldView) -> np.ndarray:
        """Mark the grains to remove from a container filled to the brim, (n,) bool."""
        return view.alive & (view.positions[:, 2] > self.poured.brim)

    def level(self, view: WorldView, kept: np.ndarray) -> float:
        """Return the height of the surface of the bed of grains `kept` [m]."""
        half_sides = self.poured.cross_section(self.reach).half_sides
        return bed_level(view.positions[kept], half_sides, self.grain_reach)

    def is_full(self, view: WorldView) -> bool:
        """Return True if slow grains lie above the brim; a counted fill is never full."""
        if self.poured.is_counted or view.highest <= self.poured.brim:
            return False
        above = view.alive & view.released & (view.positions[:, 2] > self.poured.brim)
        slow = np.linalg.norm(view.velocities[above], axis=1) < 0.5 * self.poured.rain_speed
        return bool(np.count_nonzero(slow) >= HEAPED)

    def _settle(self, view: WorldView) -> Decision:
        if view.time - self.state.phase_start > self.SETTLE_LIMIT:
            failure = f"the grains poured did not come to rest within {self.SETTLE_LIMIT:g} s; {UNREST}"
            return Decision(done=True, failure=failure)
        if not self.rests(view):
            return Decision()
        above = self.surplus(view)
        if self.poured.is_counted:
            above[:] = False
        kept = view.alive & ~above
        self._measure_fill(view, kept)
        return Decision(remove=np.flatnonzero(above), move=self.begin(view, kept))

    def _measure_fill(self, view: WorldView, kept: np.ndarray) -> None:
        scene, level = self.poured, self.level(view, kept)
        volumes = self.setup.masses / self.setup.grains.densities
        self.state.observables |= {
            "grain_count": float(np.count_nonzero(kept)),
            "fill_height": level - scene.floor,
            "solid_fraction": float(volumes[kept[: len(volumes)]].sum()) / scene.volume_below(level),
        }
