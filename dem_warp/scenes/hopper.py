"""The hopper: fill a round bin, open the hole in its floor or cone, weigh the discharged grains."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.materials import Material
from dem_warp.model import GRAVITY, WorldSetup
from dem_warp.parameters import LATER, Parameter
from dem_warp.scenes.discharge import DISCHARGE_OBSERVABLES, DischargeController
from dem_warp.scenes.poured_scene import FILL_OBSERVABLES, PouredScene
from dem_warp.scenes.rain import CrossSection
from dem_warp.scenes.scene import Observable
from dem_warp.view import WorldView
from dem_warp.walls import Cone, Cylinder, Disc, Wall

PLUG = 2
DEPTH = 6.0
"""Depth below the outlet where grains leave the world, over their bounding radius."""

OVER_OUTLET = 0.25
"""Radius of the middle of the outlet over its diameter."""


@dataclass(frozen=True)
class Hopper(PouredScene):
    """Discharge of a round bin, filled by a rain of grains, through a hole in its floor or its cone."""

    diameter: Annotated[float, Parameter("m", above=0.0)]
    """Inner diameter of the bin."""
    fill_depth: Annotated[float, Parameter("m", above=0.0)]
    """Height of the filling above the hole."""
    outlet: Annotated[float, Parameter("m", above=0.0)]
    """Diameter of the hole."""
    wall_material: Material
    """Material of the bin, its floor and its plug."""
    half_angle: Annotated[float, Parameter("rad", above=0.0, at_most=math.pi / 2)] = field(
        default=math.pi / 2, metadata=LATER
    )
    """Angle of the cone below the bin, from the vertical. 90 degrees: a flat floor."""

    name = "hopper"
    wall_names = ("bin", "floor", "plug")
    observables: ClassVar[Mapping[str, Observable]] = FILL_OBSERVABLES | DISCHARGE_OBSERVABLES
    part_names: ClassVar[tuple[tuple[str, ...], ...]] = (("bin",), ("floor",), ("floor",))

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.outlet >= self.diameter:
            rule = f"must be below the diameter {self.diameter!r} [m]"
            raise ValueError(f"{type(self).__name__}.outlet: {rule}, got {self.outlet!r}")
        if self.fill_depth <= self.cone_height:
            rule = f"must be above the cone's height {self.cone_height:.4g} [m]"
            raise ValueError(f"{type(self).__name__}.fill_depth: {rule}, got {self.fill_depth!r}")

    @property
    def cone_height(self) -> float:
        """Height of the cone below the bin [m]; 0 for a flat floor."""
        if self.half_angle == math.pi / 2:
            return 0.0
        return (self.diameter - self.outlet) / 2 / math.tan(self.half_angle)

    @property
    def floor(self) -> float:
        return 0.0

    @property
    def brim(self) -> float:
        return self.floor + self.fill_depth

    @property
    def opening(self) -> float:
        return self.outlet

    def volume_below(self, height: float) -> float:
        above = height - self.floor
        low = min(above, self.cone_height)
        wide = self.outlet + 2 * low * math.tan(self.half_angle)
        cone = np.pi / 12 * low * (self.outlet**2 + self.outlet * wide + wide**2)
        return np.pi / 4 * self.diameter**2 * (above - low) + cone

    def cross_section(self, reach: float) -> CrossSection:
        return CrossSection.circle(self.diameter / 2)

    def rim(self, reach: float) -> float:
        """Return the height of the bin's rim, above the release [m]."""
        return self.release(reach) + 2 * reach

    def walls(self, reach: float) -> tuple[Wall, ...]:
        """Return the bin up to above the release height, its floor or cone, and the plug in it."""
        bottom, up, shoulder = (0.0, 0.0, self.floor), (0.0, 0.0, 1.0), self.floor + self.cone_height
        wide, narrow = self.diameter / 2, self.outlet / 2
        floor = Cone(bottom, narrow, wide, self.cone_height) if self.cone_height else None
        return (
            Cylinder((0.0, 0.0, shoulder), wide, self.rim(reach) - shoulder),
            floor or Disc(bottom, up, wide, narrow),
            Disc(bottom, up, narrow),
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
        return view.positions[:, 2] < self.case.scene.floor

    def over_outlet(self, view: WorldView) -> np.ndarray:
        from_axis = np.hypot(view.positions[:, 0], view.positions[:, 1])
        return from_axis < OVER_OUTLET * self.case.scene.outlet
