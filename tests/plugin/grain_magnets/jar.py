"""A scene: a jar is filled."""

from dataclasses import dataclass
from math import pi
from typing import Annotated, Any, ClassVar

from dem_warp import Material, Parameter, PouredController, PouredScene
from dem_warp.scenes.phases import Phase
from dem_warp.scenes.rain import CrossSection
from dem_warp.scenes.scene import Decision, SceneState
from dem_warp.walls import Cylinder, Disc


@dataclass(frozen=True)
class Jar(PouredScene):
    """A round jar."""

    diameter: Annotated[float, Parameter("m", above=0.0)]
    """Inner diameter."""
    height: Annotated[float, Parameter("m", above=0.0)]
    """Height of its brim."""
    wall_material: Material

    name: ClassVar[str] = "jar"
    floor = 0.0

    @property
    def brim(self) -> float:
        return self.height

    def volume_below(self, height: float) -> float:
        return pi / 4.0 * self.diameter**2 * height

    def cross_section(self, reach: float) -> CrossSection:
        return CrossSection.circle(self.diameter / 2.0)

    def walls(self, reach: float) -> tuple[Any, ...]:
        bottom, up = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
        side = Cylinder(bottom, self.diameter / 2.0, self.release(reach) + 2.0 * reach)
        return side, Disc(bottom, up, self.diameter / 2.0)

    def room(self, reach: float) -> tuple[float, float, float]:
        return self.diameter / 2.0 + 2.0 * reach, self.diameter / 2.0 + 2.0 * reach, -2.0 * reach

    def controller(self, case: Any, setup: Any, chunk: int) -> "JarController":
        return JarController(case, setup, chunk, SceneState("fill"))


class JarController(PouredController[SceneState]):
    """Phases of one jar: fill, settle, stand."""

    def begin(self, view: Any, kept: Any) -> dict[int, Any]:
        self.state.enter("stand", view)
        return {}

    def look(self, view: Any) -> Decision:
        self.phases["stand"] = Phase(lambda view: Decision(done=True), 0.0)
        return super().look(view)
