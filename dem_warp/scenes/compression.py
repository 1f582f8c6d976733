"""Compression in a die, after poured and tapped density: a piston moves down and back at constant speed."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.materials import Material
from dem_warp.model import GRAVITY, WorldSetup
from dem_warp.parameters import Parameter
from dem_warp.population import GrainPopulation
from dem_warp.scenes.lids import LidController, LidScene, LidState
from dem_warp.scenes.phases import UNREST, Phase
from dem_warp.scenes.poured_scene import FILL_OBSERVABLES
from dem_warp.scenes.press_curve import LOADED, PRESS_OBSERVABLES, SEATING, crossing, strains_of
from dem_warp.scenes.rain import CrossSection
from dem_warp.scenes.scene import Decision, Observable
from dem_warp.view import WorldView
from dem_warp.walls import Cylinder, Disc, Motion, Plane, Wall

BASE, DIE, PISTON = 0, 1, 2
HELD = 0.98
"""Least part of a stress that grains carry while the piston stands, for it to turn back."""

DEEPEST = 0.5
"""Strain at which a piston fails that has not met its stress."""

STEADY_TAPS, STEADY = 20, 1e-3
"""Taps within which the height of the bed changes by less than this part, so that tapping ends."""

TAP_RISE = 0.05
"""Speed at which a tap lifts the die [m/s]."""

USUAL_TAP = 0.15
"""Time until grains rest after a tap [s]."""

FINENESS = 5e-4
"""Largest strain between two looks."""


@dataclass(frozen=True)
class Compression(LidScene):
    """Grains in a round die are tapped, and compressed by a piston that turns back at a stress."""

    diameter: Annotated[float, Parameter("m", above=0.0)]
    """Inner diameter of the die."""
    fill_depth: Annotated[float, Parameter("m", above=0.0)]
    """Depth of the grains in the die."""
    wall_material: Material
    """Material of the die, its base and the piston."""
    stress: Annotated[float, Parameter("Pa", above=0.0)]
    """Mean stress under the piston at which it turns back last."""
    loads: Annotated[int, Parameter("1", at_least=1, at_most=10)] = 1
    """Number of loads. The piston turns back at each, and each has twice the stress of the one before."""
    speed: Annotated[float, Parameter("m/s", above=0.0)] = 0.005
    """Speed of the piston."""
    taps: Annotated[int, Parameter("1", at_least=0)] = 0
    """Most taps before the piston comes; they end once 20 of them change the density by less than 0.1 %."""
    tap_height: Annotated[float, Parameter("m", above=0.0)] = 0.003
    """Height from which the die drops in a tap; the next tap comes when the grains rest."""

    name = "compression"
    wall_names = ("base", "die", "piston")
    part_names = (("base",), ("die",), ("piston",))
    weighed = (BASE, DIE, PISTON)
    presser, first_load = "piston", LOADED[0]
    observables: ClassVar[Mapping[str, Observable]] = FILL_OBSERVABLES | PRESS_OBSERVABLES

    @property
    def area(self) -> float:
        """Area of the piston [m2]."""
        return math.pi / 4 * self.diameter**2

    def volume_below(self, height: float) -> float:
        return self.area * height

    def cross_section(self, reach: float) -> CrossSection:
        return CrossSection.circle(self.diameter / 2)

    def walls(self, reach: float) -> tuple[Wall, ...]:
        bottom, up, top = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), self.rest_place(reach)
        radius = self.diameter / 2
        return Plane(bottom, up), Cylinder(bottom, radius, top), Disc((0.0, 0.0, top), up, radius)

    def room(self, reach: float) -> tuple[float, float, float]:
        half_width = self.diameter / 2 + 2 * reach
        return half_width, half_width, -2 * reach

    def doubts(self, grains: GrainPopulation, material: Material) -> tuple[str, ...]:
        """Describe a piston that is fast, and grains that are soft for the stress, or softer than stated."""
        scale = grains.material.shear_modulus / material.shear_modulus
        scaled = f"the grains are {scale:.3g} times softer than stated, and so are stresses and moduli"
        return (*super().doubts(grains, material), *(scaled,) * (scale > 1.0))

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "PressController":
        return PressController(case, setup, chunk)


@dataclass
class PressState(LidState):
    """State of a compression."""

    levels: list[float] = field(default_factory=list)
    """Height of the bed's surface before the taps and after each [m]."""
    tapped_at: float = 0.0
    """Time at which the present tap began [s]."""
    is_dropped: bool = False
    """True once the present tap has dropped the die."""
    tare: float = 0.0
    """Load on the base before the piston comes [N]."""
    turns: int = 0
    """Loads that are over."""
    seat: float = 0.0
    """Height of the piston when it took its seat [m]; 0 before."""
    turned: int = 0
    """Points of the curve until the piston turned back."""
    curve: list[list[float]] = field(default_factory=list)
    """Mean stress [Pa] and mean height of the piston [m] between the looks of the present load."""


class PressController(LidController[PressState]):
    """Controller of a compression: fill, settle, tap, approach, and for each load press, hold and release."""

    def __init__(self, case: Case[Compression], setup: WorldSetup, chunk: int) -> None:
        self.scene = scene = case.scene
        self.LOOK = min(self.LOOK, FINENESS * scene.fill_depth / scene.speed)
        super().__init__(case, setup, chunk, PressState("fill"))
        look, reach = self.period * setup.time_step, float(setup.bounding_radii.max())
        self.rise = scene.tap_height / TAP_RISE
        self.fall = math.sqrt(2 * scene.tap_height / GRAVITY)
        stroke = scene.squeeze(case.grain_material) * scene.fill_depth / scene.speed
        tap = {"tap": Phase(self._tap, scene.taps * (self.rise + self.fall + USUAL_TAP))}
        self.phases |= (tap if scene.taps else {}) | {
            "approach": Phase(self._approach, 3 * reach / scene.rain_speed + look),
            "press": Phase(self._press, scene.loads * 1.5 * stroke + reach / scene.speed, scene.loads),
            "hold": Phase(self._hold, 2 * scene.loads * look, scene.loads),
            "release": Phase(self._release, scene.loads * stroke, scene.loads),
        }

    def begin(self, view: WorldView, kept: np.ndarray) -> Mapping[int, Motion]:
        """Weigh the bed; begin to tap, or lower the piston to it."""
        self.state.mass = float(view.masses[kept].astype(float).sum())
        self.state.observables["filled_mass"] = self.state.mass
        self.state.levels = [self.level(view, kept)]
        if not self.scene.taps:
            return self.lower(view, kept)
        self.state.enter("tap", view)
        return self._lift(view)

    def _lift(self, view: WorldView) -> Mapping[int, Motion]:
        self.state.tapped_at, self.state.is_dropped, self.state.slow_since = view.time, False, None
        return dict.fromkeys((BASE, DIE), Motion(velocity=(0.0, 0.0, TAP_RISE), duration=self.rise))

    def _tap(self, view: WorldView) -> Decision:
        """Drop the lifted die ahead of its grains, which then fall freely onto its base."""
        state, elapsed = self.state, view.time - self.state.tapped_at
        if not state.is_dropped:
            if elapsed < self.rise:
                return Decision()
            state.is_dropped, state.tapped_at = True, view.time
            ahead = 0.25 * self.fall
            drop = Motion(velocity=(0.0, 0.0, -self.scene.tap_height / ahead), duration=ahead)
            return Decision(move=dict.fromkeys((BASE, DIE), drop))
        if elapsed > self.SETTLE_LIMIT:
            failure = f"the grains did not come to rest within {self.SETTLE_LIMIT:g} s of a tap; {UNREST}"
            return Decision(done=True, failure=failure)
        if elapsed < 2 * self.fall or not self.rests(view):
            return Decision()
        state.levels.append(self.level(view, view.alive))
        if len(state.levels) <= self.scene.taps and not _is_steady(state.levels):
            return Decision(move=self._lift(view))
        state.observables |= {
            "tapped_density": state.mass / self.scene.volume_below(state.levels[-1]),
            "hausner_ratio": state.levels[0] / state.levels[-1],
        }
        return Decision(move=self.lower(view, view.alive))

    def _read(self, view: WorldView) -> tuple[float, float]:
        """Return the mean loads on base and piston since the last look [N]; take the point of the curve."""
        state, stops = self.state, self.state.stops - self.state.looked
        pushed, passed = self.forces(view)
        base, piston = float(pushed[BASE, 2]), float(pushed[PISTON, 2])
        moving = float(np.clip(stops, 0.0, passed))
        middle = state.place + state.velocity * moving * (1 - moving / (2 * passed))
        state.place += state.velocity * moving
        state.curve.append([piston / self.scene.area, middle])
        return -base, piston

    def _approach(self, view: WorldView) -> Decision:
        self.state.tare, _ = self._read(view)
        if view.time < self.state.stops:
            return Decision()
        return self._load(view)

    def _load(self, view: WorldView) -> Decision:
        self.state.enter("press", view)
        self.state.curve = []
        return Decision(move=self.move(view, -self.scene.speed))

    @property
    def wanted(self) -> float:
        """Stress of the present load [Pa]."""
        return float(self.scene.stress / 2 ** (self.scene.loads - 1 - self.state.turns))

    def _press(self, view: WorldView) -> Decision:
        """Go down; stop where the stress, by its last slope, is that of the load."""
        self._read(view)
        state, wanted = self.state, self.wanted
        (before, above), (stress, middle) = (state.curve * 2)[-2:]
        if not state.seat and stress > SEATING * self.scene.stress:
            state.seat = crossing(SEATING * self.scene.stress, state.curve, 1)
        if state.place < (1 - DEEPEST) * state.levels[-1]:
            rule = f"the piston went down by {DEEPEST:.0%} of the bed, to a stress of {stress:.3g} Pa"
            return Decision(
                done=True, failure=f"{rule}: lower the stress, or raise the modulus of the grains"
            )
        if stress <= max(before, SEATING * self.scene.stress) or len(state.curve) < 2:
            return Decision()
        path = (wanted - stress) * (above - middle) / (stress - before) - (middle - state.place)
        if path > self.scene.speed * self.period * self.setup.time_step:
            return Decision()
        state.enter("hold", view)
        return Decision(move=self.move(view, -self.scene.speed, max(path / self.scene.speed, 1e-9)))

    def _hold(self, view: WorldView) -> Decision:
        """Turn back where the grains carry the load while the piston stands."""
        base, load = self._read(view)
        state = self.state
        if state.stops > view.time - 0.999 * self.period * self.setup.time_step:
            return Decision()
        if load < HELD * self.wanted * self.scene.area:
            state.enter("press", view)
            return Decision(move=self.move(view, -self.scene.speed))
        state.turned = len(state.curve)
        state.observables["base_share"] = (base - state.tare) / load
        state.enter("release", view)
        return Decision(move=self.move(view, self.scene.speed))

    def _release(self, view: WorldView) -> Decision:
        _, load = self._read(view)
        state = self.state
        if load > SEATING * self.scene.stress * self.scene.area:
            return Decision()
        state.turns += 1
        if state.turns < self.scene.loads:
            return self._load(view)
        state.observables |= self.measure() | {"simulated_time": view.time}
        state.enter("rest", view)
        return Decision(done=True)

    def measure(self) -> dict[str, float]:
        """Return the observables of the last load."""
        state = self.state
        largest, lowest = state.curve[state.turned - 1]
        strains = strains_of(state.curve, self.scene.stress, state.turned - 1, state.seat)
        before, peak, after = strains[len(LOADED) - 2 : len(LOADED) + 1].tolist()
        unloading = state.curve[state.turned - 1 :]
        left = 1 - crossing(SEATING * self.scene.stress, unloading, -1) / state.seat
        upper = largest - 0.5 * self.scene.stress
        return {
            "pressed_density": state.mass / self.scene.volume_below(lowest),
            "modulus": upper / (peak - before),
            "unloading_modulus": upper / (peak - after),
            "rebound": (peak - left) / peak,
        } | {f"strain_{number}": float(strain) for number, strain in enumerate(strains, 1)}


def _is_steady(levels: list[float]) -> bool:
    """Return True if the last taps hardly changed the height of the bed."""
    return len(levels) > STEADY_TAPS and abs(levels[-1] / levels[-1 - STEADY_TAPS] - 1) < STEADY
