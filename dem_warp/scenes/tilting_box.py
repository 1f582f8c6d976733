"""The tilting box: a filled box is tilted until its grains slide, and held until they rest."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.model import GRAVITY, WorldSetup
from dem_warp.parameters import Parameter
from dem_warp.scenes.boxes import BoxScene, ReleaseController, box_plates
from dem_warp.scenes.drum_surface import SURFACE
from dem_warp.scenes.phases import Phase
from dem_warp.scenes.poured_scene import FILL_OBSERVABLES
from dem_warp.scenes.scene import Decision, Observable, SceneState
from dem_warp.scenes.surfaces import profile, slope
from dem_warp.view import WorldView
from dem_warp.walls import Mesh, Motion, Wall

FLOOR, SIDES = 0, 1
STARTED = 0.03
"""Speed of the centre of mass along the floor with which the grains slide, over that of a fall by half a
grain's size, sqrt(g d)."""

STEEPEST = math.radians(80.0)
"""Angle at which a box that keeps its grains fails [rad]."""

USUAL = math.radians(35.0)
"""Angle at which grains are expected to slide [rad]."""


@dataclass(frozen=True)
class TiltingBox(BoxScene):
    """A box, filled by a rain of grains, is tilted about the middle of its floor, downwards to +x."""

    rotation_rate: Annotated[float, Parameter("1/s", above=0.0)] = 3.0 / 360.0
    """Revolutions of the box per second; 3 degrees per second are 0.5 per minute."""

    name = "tilting-box"
    wall_names = ("floor", "sides")
    observables: ClassVar[Mapping[str, Observable]] = FILL_OBSERVABLES | {
        "start_angle": Observable(
            "deg",
            "angle of the box when the centre of mass of its grains first moves down its floor at 3 % of "
            "sqrt(g d), with the size d of a grain",
        ),
        "stop_angle": Observable(
            "deg",
            "slope of the surface once all grains rest in the box, which was held as they slid: the "
            "least-squares line through its middle 80 %; absent with fewer than three columns of grains",
        ),
        "grains_lost": Observable("1", "grains that fell out of the box"),
    }
    part_names = (("floor",), ("sides",))

    @property
    def spin(self) -> float:
        """Angular velocity [rad/s]."""
        return 2 * math.pi * self.rotation_rate

    def walls(self, reach: float) -> tuple[Wall, ...]:
        top = self.release(reach) + 2 * reach
        floor, *sides = box_plates((-self.width / 2, self.width / 2), self.depth / 2, top)
        return Mesh.plates([floor]), Mesh.plates(sides)

    def room(self, reach: float) -> tuple[float, float, float]:
        """Return room for the box at every angle."""
        far = math.hypot(self.width / 2, self.release(reach)) + 4 * reach
        return far, self.depth / 2 + 2 * reach, -self.width / 2 - 2 * reach

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "TiltController":
        return TiltController(case, setup, chunk)


@dataclass
class TiltState(SceneState):
    """State of a tilting box."""

    tilted_at: float = 0.0
    """Time at which the tilt began [s]."""


class TiltController(ReleaseController):
    """Controller of a tilting box: fill, settle, tilt, slide."""

    state: TiltState

    def __init__(self, case: Case[TiltingBox], setup: WorldSetup, chunk: int) -> None:
        super().__init__(case, setup, chunk, "slide", 0.5)
        self.phases["tilt"] = Phase(self._tilt, USUAL / case.scene.spin)
        self.started = STARTED * math.sqrt(GRAVITY * 2 * self.grain_reach)

    def first_state(self) -> TiltState:
        return TiltState("fill")

    def begin(self, view: WorldView, kept: np.ndarray) -> Mapping[int, Motion]:
        """Begin to tilt the box."""
        self.state.tilted_at = view.time
        self.state.enter("tilt", view)
        return dict.fromkeys((FLOOR, SIDES), Motion(spin=(0.0, self.case.scene.spin, 0.0)))

    def _tilt(self, view: WorldView) -> Decision:
        angle = self.case.scene.spin * (view.time - self.state.tilted_at)
        if self._speed(view, angle) < self.started:
            failure = f"the grains stayed in place up to {math.degrees(STEEPEST):g} degrees"
            return Decision(done=True, failure=failure) if angle > STEEPEST else Decision()
        self.state.observables["start_angle"] = math.degrees(angle)
        self.state.enter(self.released, view)
        return Decision(move=dict.fromkeys((FLOOR, SIDES), Motion()))

    def _speed(self, view: WorldView, angle: float) -> float:
        """Return the speed of the centre of mass along the floor of the turning box [m/s]."""
        masses = view.masses[view.alive].astype(float)
        positions, velocities = (in_box(one[view.alive], angle) for one in (view.positions, view.velocities))
        return float(masses @ (velocities[:, 0] - self.case.scene.spin * positions[:, 2]) / masses.sum())

    def is_free(self, view: WorldView) -> bool:
        return True

    def measure(self, view: WorldView) -> dict[str, float]:
        degrees = self.state.observables["start_angle"]
        bed = in_box(view.positions[view.alive], math.radians(degrees))
        x, z = profile(bed, self.grain_reach)
        middle = np.abs(x) < SURFACE * self.case.scene.width / 2
        gradient = slope(x[middle], z[middle])
        return {} if gradient is None else {"stop_angle": degrees - math.degrees(math.atan(gradient))}


def in_box(positions: np.ndarray, angle: float) -> np.ndarray:
    """Return places in the frame of a box that is tilted by an angle [rad], downwards to +x, (n, 3)."""
    x, y, z = positions.T
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.column_stack([x * cosine - z * sine, y, x * sine + z * cosine])
