"""The flat-bottomed hopper: fill a round bin, open the hole in its floor, weigh what runs out."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.materials import Material
from dem_warp.model import GRAVITY, WorldSetup
from dem_warp.parameters import Parameter
from dem_warp.scenes.discharge import DISCHARGE_OBSERVABLES, DischargeController
from dem_warp.scenes.poured_scene import FILL_OBSERVABLES, PouredScene
from dem_warp.scenes.rain import CrossSection
from dem_warp.scenes.scene import Observable
from dem_warp.view import WorldView
from dem_warp.walls import Cylinder, Disc, Wall

PLUG = 2
DEPTH = 6.0
"""Grains leave the world this many of their bounding radii below the outlet, where they fall freely."""

OVER_OUTLET = 0.25
"""Grains nearer to the axis than this part of the outlet's diameter are above its middle."""


@dataclass(frozen=True)
class Hopper(PouredScene):
    """A flat-bottomed round bin is filled by a rain of grains; a round hole in its floor opens at once."""

    diameter: Annotated[float, Parameter("m", above=0.0)]
    """Inner diameter of the bin."""
    fill_depth: Annotated[float, Parameter("m", above=0.0)]
    """Height that it is filled to."""
    outlet: Annotated[float, Parameter("m", above=0.0)]
    """Diameter of the hole."""
    wall_material: Material
    """Material of the bin, its floor and its plug."""

    name = "hopper"
    wall_names = ("bin", "floor", "plug")
    observables: ClassVar[Mapping[str, Observable]] = FILL_OBSERVABLES | DISCHARGE_OBSERVABLES
    part_names = (("bin",), ("floor",), ("floor",))
    floor = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.outlet >= self.diameter:
            raise ValueError(
                f"Hopper.outlet: must be below the diameter {self.diameter!r} [m], got {self.outlet!r}"
            )

    @property
    def brim(self) -> float:
        """Height that it is filled to [m]."""
        return self.fill_depth

    @property
    def opening(self) -> float:
        """Diameter of the outlet [m]."""
        return self.outlet

    def volume_below(self, height: float) -> float:
        """Volume of the bin up to a height [m3]."""
        return np.pi / 4 * self.diameter**2 * height

    def cross_section(self, reach: float) -> CrossSection:
        """Inside the bin."""
        return CrossSection.circle(self.diameter / 2)

    def walls(self, reach: float) -> tuple[Wall, ...]:
        """The bin up to above where grains are released, its floor, and the plug in it."""
        bottom, up = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
        return (
            Cylinder(bottom, self.diameter / 2, self.release(reach) + 2 * reach),
            Disc(bottom, up, self.diameter / 2, self.outlet / 2),
            Disc(bottom, up, self.outlet / 2),
        )

    def room(self, reach: float) -> tuple[float, float, float]:
        """The bin, and a little below its outlet."""
        half_width = self.diameter / 2 + 2 * reach
        return half_width, half_width, -DEPTH * reach

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "HopperController":
        """Controller of one case."""
        return HopperController(case, setup, chunk)


class HopperController(DischargeController):
    """Phases of one hopper: fill, settle, open, discharge."""

    gate = PLUG

    @property
    def gate_path(self) -> float:
        """To below where grains leave the world [m]."""
        return (DEPTH + 2.0) * self.reach

    @property
    def expected_discharge(self) -> float:
        """After Beverloo, Leniger and van de Velde (1961), without their correction for the grains [s]."""
        hopper = self.case.scene
        return hopper.volume / (0.5 * np.sqrt(GRAVITY) * hopper.outlet**2.5)

    def came_out(self, view: WorldView) -> np.ndarray:
        """Below the floor, where a grain that left the world has its last place."""
        return view.positions[:, 2] < 0.0

    def over_outlet(self, view: WorldView) -> np.ndarray:
        """Near the axis."""
        from_axis = np.hypot(view.positions[:, 0], view.positions[:, 1])
        return from_axis < OVER_OUTLET * self.case.scene.outlet
