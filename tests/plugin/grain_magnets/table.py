"""A scene that places its grains: each stands on a table by itself."""

from dataclasses import dataclass
from typing import Any, ClassVar

from dem_warp import Material, PlacedController, PlacedScene
from dem_warp.scenes.phases import Phase
from dem_warp.scenes.placed_scene import CopiesState, grid, of_copies
from dem_warp.scenes.scene import Decision
from dem_warp.walls import Plane

APART = 4.0
"""Distance of two grains over the largest bounding radius."""

LONG = 0.2
"""Time that they stand [s]."""


@dataclass(frozen=True)
class Table(PlacedScene):
    """A table."""

    wall_material: Material

    name: ClassVar[str] = "table"
    observables = of_copies({"mean_height": ("m", "mean height of the grains' centres")})
    top_speed = 0.1

    def feet(self, reach: float) -> Any:
        return grid(self.grain_count, APART * reach)

    def walls(self, reach: float) -> tuple[Any, ...]:
        return (Plane(),)

    def room(self, reach: float) -> tuple[float, float, float]:
        return APART * self.grain_count * reach, APART * self.grain_count * reach, -reach

    def controller(self, case: Any, setup: Any, chunk: int) -> "TableController":
        return TableController(case, setup, chunk, CopiesState("stand"))


class TableController(PlacedController[CopiesState]):
    """One phase: the grains stand for a moment."""

    def __init__(self, *of_world: Any) -> None:
        super().__init__(*of_world)
        self.phases = {"stand": Phase(self.stand, LONG)}

    def stand(self, view: Any) -> Decision:
        if view.time < LONG:
            return Decision()
        self.state.read(mean_height=view.positions[:, 2])
        self.state.enter("end", view)
        return Decision(done=True, failure=self.state.measure(view))
