"""Base of scenes of a filled box that is opened or tilted, and whose grains then come to rest."""

from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, Any

from dem_warp.case import Case
from dem_warp.materials import Material
from dem_warp.model import WorldSetup
from dem_warp.parameters import Parameter
from dem_warp.scenes.phases import UNREST, Phase
from dem_warp.scenes.poured_controller import PouredController
from dem_warp.scenes.poured_scene import PouredScene
from dem_warp.scenes.rain import CrossSection
from dem_warp.scenes.scene import Decision, SceneState
from dem_warp.view import WorldView

RELEASE_LIMIT = 6.0
"""Longest time beyond the expected one until released grains rest [s]."""

Corner = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class FilledScene(PouredScene):
    """A container with a floor at z = 0, filled to a depth by a rain of grains from a height."""

    pour_height: Annotated[float | None, Parameter("m", above=0.0)] = None
    """Height above the floor from which the grains fall. Default: just above the filling."""

    floor = 0.0

    @property
    def fall_height(self) -> float:
        return max(self.brim, self.pour_height or 0.0)

    def release(self, reach: float) -> float:
        """Return the height from which grains fall freely, above the filling [m]."""
        return self.fall_height + reach


@dataclass(frozen=True)
class BoxScene(FilledScene):
    """A box, filled by a rain of grains."""

    width: Annotated[float, Parameter("m", above=0.0)]
    """Inner width of the box, along x."""
    depth: Annotated[float, Parameter("m", above=0.0)]
    """Inner depth of the box, along y."""
    fill_depth: Annotated[float, Parameter("m", above=0.0)]
    """Depth of the grains in the box."""
    wall_material: Material
    """Material of all walls."""

    @property
    def brim(self) -> float:
        return self.fill_depth

    def volume_below(self, height: float) -> float:
        return self.width * self.depth * height

    def cross_section(self, reach: float) -> CrossSection:
        return CrossSection((self.width / 2, self.depth / 2))


def box_plates(ends: tuple[float, float], y: float, top: float) -> list[list[Corner]]:
    """Return floor, back, both sides and front of a box between two x, two y and z = 0 and top [m]."""
    low, high = ends
    ring = [(low, -y), (low, y), (high, y), (high, -y)]
    floor = [(*corner, 0.0) for corner in ring]
    back, left, front, right = (
        [(*a, 0.0), (*b, 0.0), (*b, top), (*a, top)] for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)
    )
    return [floor, back, left, right, front]


class ReleaseController(PouredController[SceneState]):
    """Controller of a box whose grains are released, and measured once they rest."""

    def __init__(
        self, case: Case[Any], setup: WorldSetup, chunk: int, released: str, expected: float
    ) -> None:
        super().__init__(case, setup, chunk, self.first_state())
        self.released, self.limit = released, expected + RELEASE_LIMIT
        self.phases[released] = Phase(self._look_on, expected)

    def first_state(self) -> SceneState:
        """Return the state at the start."""
        return SceneState("fill")

    @abstractmethod
    def is_free(self, view: WorldView) -> bool:
        """Return True if the walls leave the grains alone."""

    @abstractmethod
    def measure(self, view: WorldView) -> dict[str, float]:
        """Return the scene's own observables of grains at rest."""

    def _look_on(self, view: WorldView) -> Decision:
        state, late = self.state, view.time - self.state.phase_start > self.limit
        at_rest = self.is_free(view) and self.rests(view)
        if not (at_rest or late):
            return Decision()
        state.observables |= self.measure(view) | {
            "simulated_time": view.time,
            "grains_lost": state.observables["grain_count"] - float(view.alive.sum()),
        }
        state.enter("rest", view)
        failure = f"the grains did not rest within {self.limit:.1f} s; {UNREST}"
        return Decision(done=True, failure="" if at_rest else failure)
