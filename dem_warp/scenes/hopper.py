"""The flat-bottomed hopper: fill a round bin, open the hole in its floor, weigh the discharged grains."""

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
"""Depth below the outlet where grains leave the world, over their bounding radius."""

OVER_OUTLET = 0.25
"""Radius of the middle of the outlet over its diameter."""


@dataclass(frozen=True)
class Hopper(PouredScene):
    """Discharge of a flat-bottomed round bin, filled by a rain of grains, through a hole in its floor."""

    diameter: Annotated[float, Parameter("m", above=0.0)]
    """Inner diameter of the bin."""
    fill_depth: Annotated[float, Parameter("m", above=0.0)]
    """Height of the filling."""
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
            rule = f"must be below the diameter {self.diameter!r} [m]"
            raise ValueError(f"Hopper.outlet: {rule}, got {self.outlet!r}")

    @property
    def brim(self) -> float:
        return self.fill_depth

    @property
    def opening(self) -> float:
        return self.outlet

    def volume_below(self, height: float) -> float:
        return np.pi / 4 * self.diameter**2 * height

    def cross_section(self, reach: float) -> CrossSection:
        return CrossSection.circle(self.diameter / 2)

    def walls(self, reach: float) -> tuple[Wall, ...]:
        """Return the bin up to above the release height, its floor, and the plug in it."""
        bottom, up = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
        return (
            Cylinder(bottom, self.diameter / 2, self.release(reach) + 2 * reach),
            Disc(bottom, up, self.diameter / 2, self.outlet / 2),
            Disc(bottom, up, self.outlet / 2),
        )

    def room(self, reach: float) -> tuple[float, float, float]:
        half_width = self.diameter / 2 + 2 * reach
        return half_width, half_width, -DEPTH * reach

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "HopperController":
        return HopperController(case, setup, chunk)


class HopperController(DischargeController):
    """Controller of a hopper."""

    gate = PLUG

    @property
    def gate_path(self) -> float:
        return (DEPTH + 2.0) * self.reach

    @property
    def expected_discharge(self) -> float:
        """Duration by the law of Beverloo, Leniger and van de Velde (1961), for grains of size 0 [s]."""
        hopper = self.case.scene
        return hopper.volume / (0.5 * np.sqrt(GRAVITY) * hopper.outlet**2.5)

    def came_out(self, view: WorldView) -> np.ndarray:
        """Mark the grains below the floor, where a grain that left the world has its last place."""
        return view.positions[:, 2] < 0.0

    def over_outlet(self, view: WorldView) -> np.ndarray:
        from_axis = np.hypot(view.positions[:, 0], view.positions[:, 1])
        return from_axis < OVER_OUTLET * self.case.scene.outlet
