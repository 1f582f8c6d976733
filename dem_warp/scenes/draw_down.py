"""The draw-down test: a box empties through a slot in its floor; slopes stay above, a heap forms below."""

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
"""Half width of the middle of the slot over its width."""

_FLANK = "least-squares line from 10 to 90 % of its height"


@dataclass(frozen=True)
class DrawDown(PouredScene):
    """Discharge of a box, filled by a rain of grains, through a slot across the middle of its floor.

    The grains that stay form two slopes down to the slot. The fallen grains form a heap in the box below, of
    the same width and depth. The slot is along y, so that the test may be a thin slice.
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
                "deg", f"slope above at -x, {_FLANK}; absent if it rises by less than two grains"
            ),
            "shear_angle_right": Observable("deg", "slope above at +x, in the same way"),
            "repose_angle": Observable("deg", "mean of the two flanks of the heap below"),
            "repose_angle_left": Observable(
                "deg", f"flank of the heap at -x, {_FLANK}; absent if it rises by less than two grains"
            ),
            "repose_angle_right": Observable("deg", "flank of the heap at +x, in the same way"),
            "mass_left_left": Observable("kg", "part of `mass_left` at -x"),
        }
    )

    part_names = (("base",), ("box",), ("box",))

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.slot >= self.width:
            raise ValueError(f"DrawDown.slot: must be below the width {self.width!r} [m], got {self.slot!r}")

    @property
    def floor(self) -> float:
        return self.drop

    @property
    def brim(self) -> float:
        return self.drop + self.fill_depth

    @property
    def opening(self) -> float:
        return self.slot

    def volume_below(self, height: float) -> float:
        return self.width * self.depth * (height - self.drop)

    def cross_section(self, reach: float) -> CrossSection:
        return CrossSection((self.width / 2, self.depth / 2))

    def walls(self, reach: float) -> tuple[Wall, ...]:
        """Return the lower floor; the sides, up to above the release, with the upper floor; the gate."""
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
        """Return the corners of a plate of the upper floor between two x [m]."""
        y, z = self.depth / 2, self.drop
        return [(start, -y, z), (end, -y, z), (end, y, z), (start, y, z)]

    def room(self, reach: float) -> tuple[float, float, float]:
        return self.width / 2 + 2 * reach, self.depth / 2 + 2 * reach, -2 * reach

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "DrawDownController":
        return DrawDownController(case, setup, chunk)


class DrawDownController(DischargeController):
    """Controller of a draw-down."""

    gate = GATE

    @property
    def gate_path(self) -> float:
        return self.case.scene.drop + 2.0 * self.reach

    @property
    def expected_discharge(self) -> float:
        """Duration by Beverloo's law for a slot, for grains of size 0 [s]."""
        box = self.case.scene
        return box.volume / (math.sqrt(GRAVITY) * box.depth * box.slot**1.5) + 0.3

    def came_out(self, view: WorldView) -> np.ndarray:
        return view.alive & (view.positions[:, 2] < self.case.scene.drop)

    def over_outlet(self, view: WorldView) -> np.ndarray:
        return np.abs(view.positions[:, 0]) < OVER_SLOT * self.case.scene.slot

    def why_clogged(self, view: WorldView) -> str:
        """Return the reason of the failure: the heap stopped the flow, or an arch did."""
        box, (x, _, z) = self.case.scene, view.positions.T
        under = self.came_out(view) & (np.abs(x) < box.slot / 2) & (z > box.drop - 2 * self.reach)
        if under.any():
            return "the heap has reached the slot: raise drop, or lower fill_depth"
        return super().why_clogged(view)

    def measure(self, view: WorldView) -> dict[str, float]:
        below = self.came_out(view)
        above = view.alive & ~below
        left = view.masses[above & (view.positions[:, 0] < 0)].sum()
        return (
            {"mass_left_left": float(left)}
            | self._angles("shear_angle", view.positions[above])
            | self._angles("repose_angle", view.positions[below])
        )

    def _angles(self, name: str, positions: np.ndarray) -> dict[str, float]:
        """Return the measurable slopes of a bed on both sides of the middle, and their mean if both are."""
        if not len(positions):
            return {}
        reach = self.grain_reach
        x, z = profile(positions, reach)
        sides = {"left": x < 0, "right": x > 0}
        angles = {f"{name}_{side}": flank_angle(x[part], z[part], reach) for side, part in sides.items()}
        seen = {side: angle for side, angle in angles.items() if angle is not None}
        return seen | ({name: sum(seen.values()) / 2} if len(seen) == 2 else {})
