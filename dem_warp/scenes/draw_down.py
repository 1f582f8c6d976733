"""The draw-down test: a box runs out through a slot in its floor; slopes stay above, a heap forms below."""

import math
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
from dem_warp.scenes.surfaces import flank_angle, profile
from dem_warp.view import WorldView
from dem_warp.walls import Mesh, Plane, Wall

GATE = 2
OVER_SLOT = 0.25
"""Grains nearer to the middle than this part of the slot's width are above its middle."""

_FLANK = "of the least-squares line through the part that rises from 10 to 90 % of its height"


@dataclass(frozen=True)
class DrawDown(PouredScene):
    """A box is filled by a rain of grains; a slot across the middle of its floor opens at once.

    What stays in the box forms two slopes down to the slot. What falls forms a heap in the box below, which
    has the same width and depth. The slot is along y, so that the test may be cut to a thin slice.
    """

    width: Annotated[float, Parameter("m", above=0.0)]
    """Inner width of both boxes, across the slot, along x."""
    depth: Annotated[float, Parameter("m", above=0.0)]
    """Inner depth of both boxes, along the slot, along y."""
    fill_depth: Annotated[float, Parameter("m", above=0.0)]
    """Depth of the grains in the upper box."""
    slot: Annotated[float, Parameter("m", above=0.0)]
    """Width of the slot."""
    drop: Annotated[float, Parameter("m", above=0.0)]
    """Height of the floor of the upper box above that of the lower."""
    wall_material: Material
    """Material of both boxes."""

    name = "draw-down"
    wall_names = ("plate", "box", "gate")
    observables: ClassVar[Mapping[str, Observable]] = (
        FILL_OBSERVABLES
        | DISCHARGE_OBSERVABLES
        | {
            "shear_angle": Observable("deg", "mean of the two slopes above"),
            "shear_angle_left": Observable(
                "deg", f"slope above at -x, {_FLANK}; absent where it rises by less than two grains"
            ),
            "shear_angle_right": Observable("deg", "the same at +x"),
            "repose_angle": Observable("deg", "mean of the two flanks of the heap below"),
            "repose_angle_left": Observable("deg", f"flank of the heap at -x, {_FLANK}; absent likewise"),
            "repose_angle_right": Observable("deg", "the same at +x"),
            "mass_left_left": Observable("kg", "what of `mass_left` lies at -x"),
        }
    )

    part_names = (("base",), ("box",), ("box",))

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.slot >= self.width:
            raise ValueError(f"DrawDown.slot: must be below the width {self.width!r} [m], got {self.slot!r}")

    @property
    def floor(self) -> float:
        """Of the upper box [m]."""
        return self.drop

    @property
    def brim(self) -> float:
        """Height that the upper box is filled to [m]."""
        return self.drop + self.fill_depth

    @property
    def opening(self) -> float:
        """Width of the slot [m]."""
        return self.slot

    def volume_below(self, height: float) -> float:
        """Volume of the upper box up to a height [m3]."""
        return self.width * self.depth * (height - self.drop)

    def cross_section(self, reach: float) -> CrossSection:
        """Inside the boxes."""
        return CrossSection((self.width / 2, self.depth / 2))

    def walls(self, reach: float) -> tuple[Wall, ...]:
        """The lower floor; the sides, up to above the release, and with them the upper floor; the gate."""
        x, y, top, gap = self.width / 2, self.depth / 2, self.release(reach) + 2 * reach, self.slot / 2
        ring = [(-x, -y), (x, -y), (x, y), (-x, y)]
        sides = [
            [(*a, 0.0), (*b, 0.0), (*b, top), (*a, top)]
            for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)
        ]
        return (
            Plane(),
            Mesh.plates([*sides, self._shelf(-x, -gap), self._shelf(gap, x)]),
            Mesh.plates([self._shelf(-gap, gap)]),
        )

    def _shelf(self, start: float, end: float) -> list[tuple[float, float, float]]:
        """Corners of a plate of the upper floor between two x [m]."""
        y, z = self.depth / 2, self.drop
        return [(start, -y, z), (end, -y, z), (end, y, z), (start, y, z)]

    def room(self, reach: float) -> tuple[float, float, float]:
        """Both boxes."""
        return self.width / 2 + 2 * reach, self.depth / 2 + 2 * reach, -2 * reach

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "DrawDownController":
        """Controller of one case."""
        return DrawDownController(case, setup, chunk)


class DrawDownController(DischargeController):
    """Phases of one draw-down: fill, settle, open, discharge."""

    gate = GATE

    @property
    def gate_path(self) -> float:
        """To below the lower floor [m]."""
        return self.case.scene.drop + 2.0 * self.reach

    @property
    def expected_discharge(self) -> float:
        """After Beverloo's law for a slot, without the correction for the grains [s]."""
        box = self.case.scene
        return box.volume / (math.sqrt(GRAVITY) * box.depth * box.slot**1.5) + 0.3

    def came_out(self, view: WorldView) -> np.ndarray:
        """Below the upper floor."""
        return view.alive & (view.positions[:, 2] < self.case.scene.drop)

    def over_outlet(self, view: WorldView) -> np.ndarray:
        """Near the plane in the middle of the slot."""
        return np.abs(view.positions[:, 0]) < OVER_SLOT * self.case.scene.slot

    def why_clogged(self, view: WorldView) -> str:
        """The heap stopped the flow, or an arch did."""
        box, (x, _, z) = self.case.scene, view.positions.T
        under = self.came_out(view) & (np.abs(x) < box.slot / 2) & (z > box.drop - 2 * self.reach)
        if under.any():
            return "the heap has grown up to the slot: raise the drop, or lower the fill"
        return super().why_clogged(view)

    def measure(self, view: WorldView) -> dict[str, float]:
        """The slopes above and the heap below."""
        below = self.came_out(view)
        above = view.alive & ~below
        left = view.masses[above & (view.positions[:, 0] < 0)].sum()
        return (
            {"mass_left_left": float(left)}
            | self._angles("shear_angle", view.positions[above])
            | self._angles("repose_angle", view.positions[below])
        )

    def _angles(self, name: str, positions: np.ndarray) -> dict[str, float]:
        """Slopes of a bed to either side of the middle that can be seen, and their mean where both can."""
        if not len(positions):
            return {}
        reach = self.grain_reach
        x, z = profile(positions, reach)
        sides = {"left": x < 0, "right": x > 0}
        angles = {f"{name}_{side}": flank_angle(x[part], z[part], reach) for side, part in sides.items()}
        seen = {side: angle for side, angle in angles.items() if angle is not None}
        return seen | ({name: sum(seen.values()) / 2} if len(seen) == 2 else {})
