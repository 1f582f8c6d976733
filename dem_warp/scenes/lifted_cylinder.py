"""The lifted-cylinder test: fill an open tube on a plate, strike it off, lift it, wait for the heap."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.materials import Material
from dem_warp.model import WorldSetup
from dem_warp.scenes.poured_controller import UNREST, Phase, PouredController
from dem_warp.scenes.poured_scene import FILL_OBSERVABLES, PouredScene
from dem_warp.scenes.rain import CrossSection
from dem_warp.scenes.scene import Course, Decision, Observable
from dem_warp.solver import WorldView
from dem_warp.walls import Cylinder, Disc, Motion, Plane, Wall

TUBE = 1
GONE = 1.5
"""Grains that have risen with the tube by this many times its height leave with it."""

CLOGGED = 0.02
"""Part of the grains from which on a tube that takes them along is clogged: no heap."""


@dataclass(frozen=True)
class LiftedCylinder(PouredScene):
    """An open tube is filled by a rain of grains and lifted at constant speed.

    Attributes
    ----------
    diameter, height : float
        Inner diameter and height of the tube [m]; it is filled to the rim.
    wall_material : Material
        Of the tube and the plate.
    lift_speed : float
        [m/s]
    duration : float, optional
        Ends the case at a fixed simulated time [s] instead of at rest.
    plate_diameter : float, optional
        Of a round plate, over whose rim grains fall and are lost [m]; by default the plate has no end.
    """

    diameter: float
    height: float
    wall_material: Material
    lift_speed: float = 0.05
    duration: float | None = None
    plate_diameter: float | None = None

    observables: ClassVar[Mapping[str, Observable]] = FILL_OBSERVABLES | {
        "time_to_rest": Observable("s", "from the start of the lift until the heap rests"),
        "grains_lost": Observable("1", "grains that left the plate, or rose with the tube"),
    }
    densest_fill = 0.58
    floor = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require_positive("diameter", "height", "lift_speed")
        if self.duration is not None and self.duration <= 0:
            raise ValueError(f"LiftedCylinder.duration: must be positive [s], got {self.duration!r}")
        if self.plate_diameter is not None and not self.diameter < self.plate_diameter < np.inf:
            raise ValueError(
                f"LiftedCylinder.plate_diameter: must be finite and above the tube's {self.diameter!r} [m], "
                f"got {self.plate_diameter!r}"
            )

    @property
    def plate(self) -> Plane | Disc:
        """What the tube stands on, at z = 0."""
        if self.plate_diameter is None:
            return Plane()
        return Disc((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), self.plate_diameter / 2)

    @property
    def brim(self) -> float:
        """Rim of the tube [m]."""
        return self.height

    def volume_below(self, height: float) -> float:
        """Volume of the tube up to a height [m3]."""
        return np.pi / 4 * self.diameter**2 * height

    def cross_section(self, reach: float) -> CrossSection:
        """Inside the tube."""
        return CrossSection.circle(self.diameter / 2)

    def walls(self, reach: float) -> tuple[Wall, ...]:
        """The plate and the tube."""
        return self.plate, Cylinder((0.0, 0.0, 0.0), self.diameter / 2, self.height)

    def room(self, reach: float) -> tuple[float, float, float]:
        """Wide enough for the flattest heap."""
        half_width = 4.0 * self.diameter + 2.0 * self.height
        return half_width, half_width, -2 * reach

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "LiftController":
        """Controller of one case."""
        return LiftController(case, setup, chunk)


class LiftController(PouredController[Course]):
    """Phases of one lifted cylinder: fill, settle, lift."""

    LIFT_MARGIN = 6.0
    """Time [s] allowed beyond the tube's own height."""

    def __init__(self, case: Case[LiftedCylinder], setup: WorldSetup, chunk: int) -> None:
        super().__init__(case, setup, chunk, Course("fill"))
        self.scene = case.scene
        lift = 0.5 * self.scene.diameter / self.scene.lift_speed
        self.phases["lift"] = Phase(self._lift, lift + 0.3)

    def begin(self, view: WorldView, kept: np.ndarray) -> Mapping[int, Motion]:
        """Lift the tube."""
        self.course.enter("lift", view)
        return {TUBE: Motion(velocity=(0.0, 0.0, self.scene.lift_speed))}

    def _lift(self, view: WorldView) -> Decision:
        elapsed = view.time - self.course.phase_start
        rise = self.scene.lift_speed * elapsed
        positions = view.positions[view.alive]
        top = positions[:, 2].max() + self.reach if len(positions) else 0.0
        if self.scene.duration is not None and view.time < self.scene.duration:
            return Decision()
        over = self.scene.duration is not None or (rise > top and self.rests(view))
        if over:
            self._finish(view, elapsed)
            return Decision(done=True)
        riding = view.alive & (view.positions[:, 2] > rise)
        if rise > GONE * self.scene.height and riding.any():
            count = np.count_nonzero(riding)
            if count > CLOGGED * self.course.observables["grain_count"]:
                return Decision(done=True, failure=f"the tube is clogged: {count} grains rose with it")
            return Decision(remove=np.flatnonzero(riding))
        if elapsed > self.scene.height / self.scene.lift_speed + self.LIFT_MARGIN:
            failure = f"the heap did not come to rest within {elapsed:.1f} s of the lift; {UNREST}"
            return Decision(done=True, failure=failure)
        return Decision()

    def _finish(self, view: WorldView, elapsed: float) -> None:
        course = self.course
        rested = elapsed if course.slow_since is None else course.slow_since - course.phase_start
        course.observables |= {
            "time_to_rest": float(rested),
            "simulated_time": view.time,
            "grains_lost": course.observables["grain_count"] - float(np.count_nonzero(view.alive)),
        }
        course.enter("rest", view)
