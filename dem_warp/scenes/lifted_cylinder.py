"""The lifted-cylinder test: fill an open tube on a plate, level it off, lift it, wait for the heap."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.materials import Material
from dem_warp.model import GRAVITY, ContactCoefficients, WorldSetup
from dem_warp.parameters import LATER, Parameter
from dem_warp.scenes.phases import UNREST, Phase
from dem_warp.scenes.plates import check_lip, plate, rim
from dem_warp.scenes.poured_controller import PouredController
from dem_warp.scenes.poured_scene import FILL_OBSERVABLES, PouredScene
from dem_warp.scenes.rain import CrossSection
from dem_warp.scenes.scene import Decision, Observable, SceneState
from dem_warp.scenes.surfaces import bed_level
from dem_warp.view import WorldView
from dem_warp.walls import Cylinder, Motion, Wall

PLATE, TUBE, LIP = 0, 1, 2
GONE = 1.5
"""Rise of the tube over its height at which grains that rose with it are removed."""

FALLS = {"t75": 0.75, "t55": 0.55}
"""Parts of the fill height at which the falling surface is timed."""

ROLLED = 2.0
"""Distance from the axis, over the tube's radius, beyond which grains have rolled off the heap."""

CLOGGED = 0.02
"""Part of the grains rising with the tube above which it is clogged."""

NOTHING_LEFT = "no grain is left on the plate, so there is no heap: lower the tilt, or widen the plate"

LIFT_OBSERVABLES = {
    "time_to_rest": Observable("s", "time from the start of the lift until the heap rests"),
    "grains_lost": Observable("1", "grains that left the plate, or rose with the tube"),
    "wall_drag": Observable(
        "1",
        "vertical force of the grains on the tube over their weight, mean over every step from the start of "
        "the lift until t75, or until the tube is clear; a balance that holds the tube shows it",
    ),
    "centre_height": Observable(
        "m", "height of the heap's centre of mass above the plate; absent if every grain was lost"
    ),
    "rolled_fraction": Observable(
        "1",
        f"part of the mass in the tube that is lost or ends farther from its axis than {ROLLED:g} times its "
        "inner radius",
    ),
} | {
    name: Observable(
        "s",
        f"time from the start of the lift until the surface within the tube's cross-section has fallen to "
        f"{100 * part:g} % of fill_height, interpolated between looks; absent if it does not fall so far",
    )
    for name, part in FALLS.items()
}


@dataclass(frozen=True)
class LiftedCylinder(PouredScene):
    """An open tube is filled by a rain of grains and lifted at constant speed along its axis.

    A tilt turns plate and tube together: z is the axis of the tube, and gravity is turned about y. z = 0 is
    the plate, or the rim of its lip.
    """

    diameter: Annotated[float, Parameter("m", above=0.0)]
    """Inner diameter of the tube."""
    height: Annotated[float, Parameter("m", above=0.0)]
    """Height of the tube, which is filled to the rim."""
    wall_material: Material
    """Material of the tube and the plate."""
    lift_speed: Annotated[float, Parameter("m/s", above=0.0)] = 0.05
    """Speed of the tube."""
    duration: Annotated[float | None, Parameter("s", above=0.0)] = None
    """Simulated time at which the test ends. Default: at rest."""
    plate_diameter: Annotated[float | None, Parameter("m", above=0.0)] = None
    """Diameter of a round plate, a pedestal where it is the tube's; grains that fall over its rim are lost.
    Default: infinite."""
    tilt: Annotated[float, Parameter("rad", at_least=0.0, below=math.pi / 2)] = 0.0
    """Tilt of plate and tube together from the beginning, downwards to +x."""
    plate_friction: Annotated[float | None, Parameter("1", at_least=0.0)] = None
    """Static friction on the plate. Default: that of the tube."""
    plate_friction_excess: Annotated[float, Parameter("1", at_least=0.0)] = 0.0
    """Static friction on the plate beyond the tube's; not used with plate_friction."""
    vibration_amplitude: Annotated[float, Parameter("m", at_least=0.0)] = 0.0
    """Amplitude of the plate's vibration along the axis of the tube, while the tube's drive runs."""
    vibration_frequency: Annotated[float, Parameter("Hz", above=0.0)] = 50.0
    """Frequency of the plate's vibration."""
    vibration_hold: Annotated[float, Parameter("s", at_least=0.0)] = 0.5
    """Time that the drive runs on after the tube has risen by its height, rounded up to a whole vibration."""
    lip: Annotated[float, Parameter("m", at_least=0.0)] = field(default=0.0, metadata=LATER)
    """Height of a rim around the plate, which keeps a layer of grains; the heap is what is above it."""

    name = "lifted-cylinder"
    leaves_a_heap = True
    observables: ClassVar[Mapping[str, Observable]] = FILL_OBSERVABLES | LIFT_OBSERVABLES
    part_names = (("plate",), ("tube",), ("plate",))
    densest_fill = 0.58
    weighed = (TUBE,)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.plate_diameter is not None and not self.diameter <= self.plate_diameter:
            rule = f"must be at least the tube's {self.diameter!r} [m]"
            raise ValueError(f"LiftedCylinder.plate_diameter: {rule}, got {self.plate_diameter!r}")
        check_lip("LiftedCylinder", self.lip, self.height, self.plate_diameter, self.diameter)

    @property
    def wall_names(self) -> tuple[str, ...]:
        """Names of the walls in films."""
        return ("plate", "tube", "lip") if self.lip else ("plate", "tube")

    @property
    def floor(self) -> float:
        return 0.0 - self.lip

    @property
    def gravity(self) -> tuple[float, float, float]:
        """Gravity in the frame of plate and tube [m/s2]."""
        return GRAVITY * math.sin(self.tilt), 0.0, -GRAVITY * math.cos(self.tilt)

    @property
    def lift_time(self) -> float:
        """Time in which the tube rises by its height [s]."""
        return self.height / self.lift_speed

    @property
    def vibration_time(self) -> float:
        """Time from the start of the lift to the end of the plate's last whole vibration [s]."""
        if self.vibration_amplitude == 0:
            return 0.0
        vibrations = (self.lift_time + self.vibration_hold) * self.vibration_frequency
        return math.ceil(vibrations) / self.vibration_frequency

    @property
    def lift(self) -> dict[int, Motion]:
        """Motions of the walls during the lift."""
        motions = {TUBE: Motion(velocity=(0.0, 0.0, self.lift_speed))}
        if self.vibration_amplitude > 0:
            shake = Motion(
                amplitude=(0.0, 0.0, self.vibration_amplitude),
                frequency=self.vibration_frequency,
                duration=self.vibration_time,
            )
            motions |= dict.fromkeys(self.shaken, shake)
        return motions

    @property
    def shaken(self) -> tuple[int, ...]:
        """Walls that a vibration moves."""
        return (PLATE, LIP) if self.lip else (PLATE,)

    @property
    def brim(self) -> float:
        return self.height - self.lip

    @property
    def fall_height(self) -> float:
        return self.height

    def volume_below(self, height: float) -> float:
        return np.pi / 4 * self.diameter**2 * (height - self.floor)

    def cross_section(self, reach: float) -> CrossSection:
        return CrossSection.circle(self.diameter / 2)

    def walls(self, reach: float) -> tuple[Wall, ...]:
        tube = Cylinder((0.0, 0.0, self.floor), self.diameter / 2, self.height)
        return plate(self.plate_diameter, self.floor), tube, *rim(self.plate_diameter, self.lip)

    def contacts(self, case: Case[Any]) -> tuple[ContactCoefficients, ...]:
        """Return the contacts of grains with grains, with the tube and with the plate."""
        grains, tube = super().contacts(case)
        friction = self.plate_friction
        if friction is None:
            friction = tube.static_friction + self.plate_friction_excess
        return grains, tube, replace(tube, static_friction=friction)

    def contact_of(self, wall: int) -> int:
        return 1 if wall == TUBE else 2

    def check_parts(self, names: Sequence[str]) -> None:
        """Raise ValueError for an unknown part, or a plate with two frictions."""
        super().check_parts(names)
        if "plate" in names and (self.plate_friction is not None or self.plate_friction_excess):
            name = "plate_friction_excess" if self.plate_friction is None else "plate_friction"
            rule = "must be left out if the plate has its own material"
            raise ValueError(f"LiftedCylinder.{name}: {rule}, got {getattr(self, name)!r}")

    def room(self, reach: float) -> tuple[float, float, float]:
        half_width = 4.0 * self.diameter + 2.0 * self.height
        return half_width, half_width, self.floor - 2 * reach

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "LiftController":
        return LiftController(case, setup, chunk)


@dataclass
class LiftState(SceneState):
    """State of a lifted cylinder."""

    mass: float = 0.0
    """Mass of the grains that filled the tube [kg]."""
    surface: list[float] = field(default_factory=list)
    """Time since the start of the lift [s] and level of the surface [m] at the last look."""
    first_impulse: float = 0.0
    """Impulse of the grains on the tube, along its axis, at the start of the lift [N s]."""
    last_impulse: list[float] = field(default_factory=list)
    """Time since the start of the lift [s] and that impulse at the last look."""


class LiftController(PouredController[LiftState]):
    """Controller of a lifted cylinder: fill, settle, lift."""

    LIFT_MARGIN = 6.0
    """Longest time after the tube has risen by its height [s]."""

    def __init__(self, case: Case[LiftedCylinder], setup: WorldSetup, chunk: int) -> None:
        super().__init__(case, setup, chunk, LiftState("fill"))
        self.scene = case.scene
        lift = max(0.5 * self.scene.diameter / self.scene.lift_speed, self.scene.vibration_time)
        self.phases["lift"] = Phase(self._lift, lift + 0.3)

    def begin(self, view: WorldView, kept: np.ndarray) -> Mapping[int, Motion]:
        self.state.mass = float(view.masses[kept].astype(float).sum())
        self.state.surface = [0.0, self.state.observables["fill_height"]]
        self.state.first_impulse = pushed = float(view.impulses[0, 2])
        self.state.last_impulse = [0.0, pushed]
        self.state.enter("lift", view)
        return self.scene.lift

    def _lift(self, view: WorldView) -> Decision:
        decision = self._lifted(view)
        if not self._vibration_ends(view):
            return decision
        return replace(decision, move=dict.fromkeys(self.scene.shaken, Motion()))

    def _vibration_ends(self, view: WorldView) -> bool:
        """Return True if the vibration of the plate has ended since the last look."""
        before = (view.step - self.period) * self.setup.time_step
        end = self.state.phase_start + self.scene.vibration_time
        return self.state.phase_start <= before < end <= view.time

    def _lifted(self, view: WorldView) -> Decision:
        elapsed = view.time - self.state.phase_start
        rise = self.scene.floor + self.scene.lift_speed * elapsed
        top = view.highest + self.reach
        self._time_fall(view, elapsed)
        self._weigh_tube(view, elapsed, rise > top)
        if self.scene.duration is not None and view.time < self.scene.duration:
            return Decision()
        calm = elapsed >= self.scene.vibration_time and rise > top
        over = self.scene.duration is not None or (calm and self.rests(view))
        if over:
            self._finish(view, elapsed)
            return Decision(done=True, failure="" if view.alive.any() else NOTHING_LEFT)
        if rise > GONE * self.scene.height and view.highest > rise:
            riding = view.alive & (view.positions[:, 2] > rise)
            count = np.count_nonzero(riding)
            if count > CLOGGED * self.state.observables["grain_count"]:
                return Decision(done=True, failure=f"the tube is clogged: {count} grains rose with it")
            return Decision(remove=np.flatnonzero(riding))
        if elapsed > max(self.scene.lift_time, self.scene.vibration_time) + self.LIFT_MARGIN:
            failure = f"the heap did not come to rest within {elapsed:.1f} s after the lift began; {UNREST}"
            return Decision(done=True, failure=failure)
        return Decision()

    def _time_fall(self, view: WorldView, elapsed: float) -> None:
        """Record the times at which the surface has fallen to FALLS of its first height."""
        seen = self.state.observables
        awaited = {name: part * seen["fill_height"] for name, part in FALLS.items() if name not in seen}
        if not awaited:
            return
        radius, (before, above) = self.scene.diameter / 2, self.state.surface
        inside = view.alive & (np.hypot(view.positions[:, 0], view.positions[:, 1]) < radius)
        level = bed_level(view.positions[inside], (radius, radius), self.grain_reach) - self.scene.floor
        for name, awaited_level in awaited.items():
            if level <= awaited_level:
                seen[name] = before + (above - awaited_level) / (above - level) * (elapsed - before)
        self.state.surface = [elapsed, level]

    def _weigh_tube(self, view: WorldView, elapsed: float, ends: bool) -> None:
        """Record the mean load of the tube until t75, or until it is clear."""
        seen, (before, carried) = self.state.observables, self.state.last_impulse
        pushed = float(view.impulses[0, 2])
        if "wall_drag" in seen:
            return
        if ends or "t75" in seen:
            end = seen.get("t75", elapsed)
            mean = (np.interp(end, [before, elapsed], [carried, pushed]) - self.state.first_impulse) / end
            seen["wall_drag"] = float(mean / (self.state.mass * self.scene.gravity[2]))
        self.state.last_impulse = [elapsed, pushed]

    def _finish(self, view: WorldView, elapsed: float) -> None:
        state = self.state
        rested = elapsed if state.slow_since is None else state.slow_since - state.phase_start
        state.observables |= {
            "time_to_rest": float(rested),
            "simulated_time": view.time,
            "grains_lost": state.observables["grain_count"] - float(np.count_nonzero(view.alive)),
        }
        self._weigh_tube(view, elapsed, True)
        self._weigh_heap(view)
        state.enter("rest", view)

    def _weigh_heap(self, view: WorldView) -> None:
        """Measure the distribution of the heap's mass."""
        masses, positions = view.masses[view.alive].astype(float), view.positions[view.alive]
        near = np.hypot(positions[:, 0], positions[:, 1]) <= ROLLED * self.scene.diameter / 2
        self.state.observables["rolled_fraction"] = 1.0 - float(masses[near].sum()) / self.state.mass
        if len(masses):
            center = float(masses @ positions[:, 2] / masses.sum())
            self.state.observables["centre_height"] = center - self.scene.floor
