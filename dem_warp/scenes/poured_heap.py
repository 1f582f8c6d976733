"""The poured heap: grains flow out of a funnel onto a plate, freely or at a rate, until the heap rests."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.model import ContactCoefficients, WorldSetup
from dem_warp.parameters import Parameter
from dem_warp.scenes.discharge import DISCHARGE_OBSERVABLES
from dem_warp.scenes.hopper import Hopper, HopperController
from dem_warp.scenes.lifted_cylinder import LIFT_OBSERVABLES
from dem_warp.scenes.plates import Plate, check_glued, check_lip, glued, plate, rim
from dem_warp.scenes.poured_scene import FILL_OBSERVABLES
from dem_warp.scenes.rain import CrossSection
from dem_warp.scenes.scene import Decision, Observable
from dem_warp.view import WorldView
from dem_warp.walls import Disc, Wall

GLUED = 3
LOOSEST = 0.45
"""Least expected solid fraction of the grains in a funnel."""

FLOW = ("discharge_time", "flow_rate", "flow_rate_se", "clogged")
"""Observables of a free flow, which a given rate has not."""

BARE = "no grain is left on the plate, so there is no heap: widen the plate, or lower drop"


@dataclass(frozen=True)
class PouredHeap(Hopper):
    """Heap below a funnel, which a rain of grains fills and which then runs out onto a plate.

    With a mass rate the grains fall from the outlet at that rate instead, at the speed of the rain. z = 0 is
    the plate, or the rim of its lip.
    """

    half_angle: Annotated[float, Parameter("rad", above=0.0, at_most=math.pi / 2)] = math.radians(30.0)
    """Angle of the funnel's cone, from the vertical. 90 degrees: a flat floor."""
    drop: Annotated[float, Parameter("m", above=0.0)] = 0.08
    """Height of the outlet above the plate."""
    mass: Annotated[float | None, Parameter("kg", above=0.0)] = None
    """Mass to pour. Default: the funnel filled to `fill_depth`."""
    mass_rate: Annotated[float | None, Parameter("kg/s", above=0.0)] = None
    """Mass that falls from the outlet per second. Default: free flow."""
    plate_diameter: Annotated[float | None, Parameter("m", above=0.0)] = None
    """Diameter of a round plate; grains that fall over its rim are lost. Default: infinite."""
    lip: Annotated[float, Parameter("m", at_least=0.0)] = 0.0
    """Height of a rim around the plate, which keeps a layer of grains; the heap is what is above it."""
    plate: Plate = "smooth"
    """smooth: a plate of the wall's material; grains: a layer of glued grains, bumps of their size."""

    name = "poured-heap"
    leaves_a_heap = True
    observables: ClassVar[Mapping[str, Observable]] = (
        FILL_OBSERVABLES
        | DISCHARGE_OBSERVABLES
        | {
            "centre_height": LIFT_OBSERVABLES["centre_height"],
            "mass_on_plate": Observable("kg", "mass of the grains that stay on the plate"),
            "grains_lost": Observable("1", "grains that left the plate"),
        }
    )
    part_names = (("funnel",), ("funnel",), ("funnel",), ("plate",), ("plate",))

    def __post_init__(self) -> None:
        super().__post_init__()
        check_lip("PouredHeap", self.lip, self.drop, self.plate_diameter, self.outlet)
        if self.mass is not None and self.grain_count is not None:
            raise ValueError(f"PouredHeap.mass: must be left out with grain_count, got {self.mass!r}")
        if self.mass_rate is not None and not self.is_counted:
            raise ValueError(f"PouredHeap.mass_rate: needs a mass or a grain_count, got {self.mass_rate!r}")
        if self.plate == "grains" and self.plate_diameter is None:
            raise ValueError("PouredHeap.plate: grains need a plate_diameter, got None")

    @property
    def wall_names(self) -> tuple[str, ...]:  # type: ignore[override]
        """Names of the walls in films."""
        names = (*Hopper.wall_names, "plate", "lip")
        return names if self.lip else names[:-1]

    @property
    def floor(self) -> float:
        return self.drop - self.lip

    @property
    def fall_height(self) -> float:
        return self.drop + self.fill_depth

    @property
    def is_counted(self) -> bool:
        return self.mass is not None or self.grain_count is not None

    def ordered(self, case: Case[Any]) -> int | None:
        if self.mass is None:
            return self.grain_count
        if self.mass_rate is None and self.mass > LOOSEST * case.grains.material.density * self.volume:
            rule = f"must fit into the funnel of {1e6 * self.volume:.4g} ml: raise fill_depth or diameter"
            raise ValueError(f"PouredHeap.mass: {rule}, got {self.mass!r}")
        return max(round(self.mass / _mean_mass(case)), 1)

    def grains_per_second(self, case: Case[Any]) -> float:
        if self.mass_rate is None:
            return super().grains_per_second(case)
        return self.mass_rate / _mean_mass(case)

    def cross_section(self, reach: float) -> CrossSection:
        width = self.diameter if self.mass_rate is None else self.outlet
        return CrossSection.circle(width / 2)

    def release(self, reach: float) -> float:
        """Return the height from which grains fall freely: the filling's, or the outlet's [m]."""
        return super().release(reach) if self.mass_rate is None else self.floor

    def rim(self, reach: float) -> float:
        """Return the height of the funnel's rim, over which no grain can bounce onto the plate [m]."""
        return self.brim + self.diameter / 2 + 3 * reach

    def walls(self, reach: float) -> tuple[Wall, ...]:
        """Return the funnel, its plug (out of the way with a mass rate), the plate and its lip."""
        *funnel, plug = super().walls(reach)
        if self.mass_rate is not None:
            plug = Disc((0.0, 0.0, -self.gate_path(reach)), (0.0, 0.0, 1.0), self.outlet / 2)
        below: Wall = plate(self.plate_diameter, 0.0 - self.lip)
        if self.plate == "grains":
            below = glued(self.plate_diameter or 0.0, 0.0 - self.lip, reach)
        return *funnel, plug, below, *rim(self.plate_diameter, self.lip)

    def check_parts(self, names: Sequence[str]) -> None:
        """Raise ValueError for an unknown part, or a plate of glued grains with a material."""
        super().check_parts(names)
        check_glued("PouredHeap", self.plate, names)

    def gate_path(self, reach: float) -> float:
        """Return the path of the plug until it is far below the plate [m]."""
        return self.drop + 6 * reach

    def contacts(self, case: Case[Any]) -> tuple[ContactCoefficients, ...]:
        """Return the contacts of grains with grains, with the walls and with glued grains."""
        grains, walls = super().contacts(case)
        return (grains, walls, grains) if self.plate == "grains" else (grains, walls)

    def contact_of(self, wall: int) -> int:
        return 2 if wall == GLUED and self.plate == "grains" else 1

    def room(self, reach: float) -> tuple[float, float, float]:
        half_width = max(self.diameter, self.plate_diameter or 0.0) / 2 + 2 * (self.drop + self.fill_depth)
        return half_width, half_width, -self.lip - 2 * reach

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "PouredHeapController":
        return PouredHeapController(case, setup, chunk)


def _mean_mass(case: Case[Any]) -> float:
    """Return the mean mass of a grain [kg]."""
    grains = case.grains
    cube = grains.size_mean * (grains.size_mean**2 + 3 * grains.size_sd**2)
    return float(grains.material.density * grains.mean(lambda shape: shape.volume) * cube)


class PouredHeapController(HopperController):
    """Controller of a poured heap: fill, settle, open, flow until all grains rest."""

    FILL_MARGIN = 6.0

    @property
    def gate_path(self) -> float:
        return float(self.case.scene.gate_path(self.reach))

    def came_out(self, view: WorldView) -> np.ndarray:
        """Mark the grains below the outlet; slots beyond those of this world, in a batch, are none."""
        own = np.arange(len(view.alive)) < self.setup.grains.count
        return own & super().came_out(view)

    def _measure_fill(self, view: WorldView, kept: np.ndarray) -> None:
        if self.case.scene.mass_rate is None:
            super()._measure_fill(view, kept)
        self.state.observables["grain_count"] = float(np.count_nonzero(kept))

    def _discharge(self, view: WorldView) -> Decision:
        """Let the grains flow; what stays in the funnel is taken away at the end."""
        decision = super()._discharge(view)
        if not decision.done:
            return decision
        in_funnel = np.flatnonzero(view.alive & ~self.came_out(view))
        failure = decision.failure or ("" if self._on_plate(view).any() else BARE)
        if self.case.scene.mass_rate is not None:
            for name in FLOW:
                self.state.observables.pop(name, None)
        return replace(decision, remove=in_funnel, failure=failure)

    def _on_plate(self, view: WorldView) -> np.ndarray:
        return view.alive & self.came_out(view)

    def why_clogged(self, view: WorldView) -> str:
        """Return the reason of the failure: the heap stopped the flow, or an arch did."""
        below = view.positions[self._on_plate(view) & self.over_outlet(view), 2]
        if below.max(initial=-np.inf) > self.case.scene.floor - 2 * self.reach:
            return "the heap has reached the outlet: raise drop, or pour less"
        return super().why_clogged(view)

    def measure(self, view: WorldView) -> dict[str, float]:
        scene, heap = self.case.scene, self._on_plate(view)
        masses = view.masses[heap].astype(float)
        lost = np.count_nonzero(~view.alive & self.came_out(view))
        seen = {"mass_on_plate": float(masses.sum()), "grains_lost": float(lost)}
        if len(masses):
            seen["centre_height"] = float(masses @ view.positions[heap, 2] / masses.sum()) + scene.lip
        return seen
