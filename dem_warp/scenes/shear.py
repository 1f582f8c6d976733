"""The shear test: pre-shear and four loads in one run, of a column of grains without side walls.

Its sides are periodic. Two half rings, the upper one pushed, were tried first: with 26 grains across, the
shear stress was half as large again and still rose, as grains between the rings catch on their edges.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from dem_warp.case import Case
from dem_warp.materials import Interaction, Material, WallPart
from dem_warp.model import GRAVITY, ContactCoefficients, WorldSetup
from dem_warp.parameters import Parameter
from dem_warp.population import GrainPopulation
from dem_warp.scenes.lids import LidController, LidScene, LidState, size_of
from dem_warp.scenes.phases import Phase
from dem_warp.scenes.poured_scene import FILL_OBSERVABLES
from dem_warp.scenes.rain import CrossSection
from dem_warp.scenes.scene import Decision, Observable
from dem_warp.scenes.shear_points import LOADS, SHEAR_OBSERVABLES, strengths, wall_friction
from dem_warp.view import WorldView
from dem_warp.walls import Disc, Motion, Plane, Wall

BASE, LID = range(2)

GRIP = (2.0, 1.0)
"""Static and rolling friction of rough plates: grains that touch them neither slide nor roll, as the shear
stress stays below the normal one. With 10 and 10, laws of rolling with springs are unstable."""

NARROWEST, LOWEST = 6.0, 4.0
"""Least width and depth of the column over the size of a grain; a shear band is some six grains deep."""

LID_MASS = 0.2
"""Mass of the lid over that of the grains; its weight is part of the load."""

FIRST, AGAIN, TRAVEL = 4.0, 2.0, 2.0
"""Travel of the first pre-shear, of the others and of each shear, over the size of a grain; the second half
of a pre-shear is steady."""

PEAK = 0.5
"""Travel over which the largest shear stress is a mean, over the size of a grain."""

USUAL_BACK, LONGEST_BACK = 0.3, 1.0
"""Usual and longest travel backwards, until the shear stress is 0, over the size of a grain."""

PAUSE = 0.2
"""Longest time for grains to rest under a new load [s]."""


@dataclass(frozen=True)
class Shear(LidScene):
    """Grains between a fixed base and a loaded lid that moves along x, in a square that repeats itself."""

    width: Annotated[float, Parameter("m", above=0.0)]
    """Side of the square; beyond it the column of grains repeats itself."""
    fill_depth: Annotated[float, Parameter("m", above=0.0)]
    """Depth of the grains."""
    wall_material: Material
    """Material of base and lid."""
    stress: Annotated[float, Parameter("Pa", above=0.0)]
    """Normal stress of the pre-shear, in the middle of the depth; the loads are 20, 40, 60 and 80 % of it."""
    speed: Annotated[float, Parameter("m/s", above=0.0)] = 0.01
    """Speed of the lid."""
    base: Literal["rough", "smooth"] = "rough"
    """rough: grains neither slide nor roll on it; smooth: it is a plate of the wall's material, as in a test
    of wall friction, and normal stresses are those on it. The lid is always rough."""

    name = "shear"
    wall_names = ("base", "lid")
    part_names = (("base",), ())
    weighed = (BASE, LID)
    free_wall = LID
    presser, first_load = "lid", 1.0
    observables: ClassVar[Mapping[str, Observable]] = FILL_OBSERVABLES | SHEAR_OBSERVABLES

    @property
    def area(self) -> float:
        """Area of the lid over one period [m2]."""
        return self.width**2

    @property
    def period(self) -> float:
        return self.width

    @property
    def is_smooth(self) -> bool:
        """True for a test of wall friction."""
        return self.base == "smooth"

    def volume_below(self, height: float) -> float:
        return self.area * height

    def cross_section(self, reach: float) -> CrossSection:
        return CrossSection((self.width / 2, self.width / 2))

    def walls(self, reach: float) -> tuple[Wall, ...]:
        up = (0.0, 0.0, 1.0)
        return Plane((0.0, 0.0, 0.0), up), Disc((0.0, 0.0, self.rest_place(reach)), up, self.width)

    def room(self, reach: float) -> tuple[float, float, float]:
        half_width = self.width / 2 + 2 * reach
        return half_width, half_width, -2 * reach

    def contacts(self, case: Case[Any]) -> tuple[ContactCoefficients, ...]:
        grip = Interaction(case.grain_wall.restitution, *GRIP)
        return *super().contacts(case), case.contact_with(WallPart("grip", self.wall_material, grip))

    def contact_of(self, wall: int) -> int:
        return 1 if wall == BASE and self.is_smooth else 2

    def check_parts(self, names: Sequence[str]) -> None:
        super().check_parts(names)
        if names and not self.is_smooth:
            raise ValueError(f"Shear.base: must be smooth if it has its own material, got {self.base!r}")

    def doubts(self, grains: GrainPopulation, material: Material) -> tuple[str, ...]:
        """Describe a lid that is fast, and grains that are soft; refuse a small column and a light load."""
        size = size_of(grains)
        for name, sizes in (("width", NARROWEST), ("fill_depth", LOWEST)):
            if getattr(self, name) < sizes * size:
                rule = f"must be at least {sizes * size:.3g} m, {sizes:g} grains"
                raise ValueError(f"Shear.{name}: {rule}, got {getattr(self, name)!r}")
        weight = self.above(material.density * self.densest_fill * GRAVITY * self.fill_depth) / LOADS[0]
        if self.stress <= weight:
            rule = f"must be above {weight:.3g} Pa, where the grains weigh more than the least load"
            raise ValueError(f"Shear.stress: {rule}, got {self.stress!r}")
        return super().doubts(grains, material)

    def above(self, weight: float) -> float:
        """Return the part of the grains' weight that is above the plane of shear."""
        return weight if self.is_smooth else weight / 2

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "ShearController":
        return ShearController(case, setup, chunk)


@dataclass
class ShearState(LidState):
    """State of a shear test."""

    load: int = 0
    """Loads begun."""
    travel: float = 0.0
    """Travel of the lid in this phase [m]."""
    curve: list[list[float]] = field(default_factory=list)
    """Travel [m], normal and shear stress [Pa], and height of the lid [m] at the looks of this phase."""
    steady: list[list[float]] = field(default_factory=list)
    """Those of the steady parts of all pre-shears."""
    points: list[list[float]] = field(default_factory=list)
    """Normal and shear stress at each load that is over [Pa]."""


class ShearController(LidController[ShearState]):
    """Controller of a shear test: fill, settle, approach, consolidate; then for each load its four phases."""

    def __init__(self, case: Case[Shear], setup: WorldSetup, chunk: int) -> None:
        super().__init__(case, setup, chunk, ShearState("fill"))
        self.scene, self.size, loads = case.scene, size_of(case.grains), len(LOADS)
        time = self.size / self.scene.speed
        rest = case.scene.rest_time + self.period * setup.time_step
        self.phases |= {
            "approach": Phase(self._approach, 3 * self.reach / self.scene.rain_speed),
            "consolidate": Phase(self._consolidate, rest),
            "pre-shear": Phase(self._pre_shear, (FIRST + AGAIN * (loads - 1)) * time, loads),
            "back off": Phase(self._back_off, USUAL_BACK * loads * time, loads),
            "unload": Phase(self._unload, rest * loads, loads),
            "shear": Phase(self._shear, TRAVEL * loads * time, loads),
        }

    def begin(self, view: WorldView, kept: np.ndarray) -> Mapping[int, Motion]:
        """Weigh the bed; begin to lower the lid."""
        self.state.mass = float(view.masses[kept].astype(float).sum())
        return self.lower(view, kept)

    def _approach(self, view: WorldView) -> Decision:
        state = self.state
        if view.time < state.stops:
            return Decision()
        state.place += state.velocity * (state.stops - state.phase_start)
        return self._enter("consolidate", view, 0.0)

    def _enter(self, phase: str, view: WorldView, velocity: float) -> Decision:
        """Begin a phase: the lid is free, bears its load and moves along x at a velocity [m/s]."""
        state, scene = self.state, self.scene
        part = LOADS[state.load - 1] if phase in ("unload", "shear") else 1.0
        weight = scene.above(state.mass * GRAVITY)
        state.place += view.rise
        state.velocity, state.travel, state.curve = velocity, 0.0, []
        state.enter(phase, view)
        self.mark(view)
        load = weight - part * scene.stress * scene.area
        return Decision(move={LID: Motion((velocity, 0.0, 0.0), mass=LID_MASS * state.mass, force=load)})

    def _read(self, view: WorldView) -> float:
        """Take a point of the curve; return the shear stress since the last look [Pa]."""
        state = self.state
        pushed, passed = self.forces(view)
        base, lid = pushed / self.scene.area
        state.travel += abs(state.velocity) * passed
        normal, shear = (-base[2], base[0]) if self.scene.is_smooth else ((lid - base) / 2)[[2, 0]] * [1, -1]
        state.curve.append([state.travel, float(normal), float(shear), state.place + view.rise])
        return float(shear)

    def _is_over(self, view: WorldView) -> bool:
        """Return True if grains rest under a new load, or have had time enough."""
        return self.rests(view) or view.time - self.state.phase_start > PAUSE

    def _consolidate(self, view: WorldView) -> Decision:
        return self._enter("pre-shear", view, self.scene.speed) if self._is_over(view) else Decision()

    def _pre_shear(self, view: WorldView) -> Decision:
        self._read(view)
        state, travel = self.state, (AGAIN if self.state.load else FIRST) * self.size
        if state.travel < travel:
            return Decision()
        state.steady += [point for point in state.curve if point[0] > travel / 2]
        return self._enter("back off", view, -self.scene.speed)

    def _back_off(self, view: WorldView) -> Decision:
        if self._read(view) > 0.0 and self.state.travel < LONGEST_BACK * self.size:
            return Decision()
        self.state.load += 1
        return self._enter("unload", view, 0.0)

    def _unload(self, view: WorldView) -> Decision:
        return self._enter("shear", view, self.scene.speed) if self._is_over(view) else Decision()

    def _shear(self, view: WorldView) -> Decision:
        self._read(view)
        state = self.state
        if state.travel < TRAVEL * self.size:
            return Decision()
        state.points.append(self._yield_point())
        if state.load < len(LOADS):
            return self._enter("pre-shear", view, self.scene.speed)
        state.observables |= self.measure() | {"simulated_time": view.time}
        state.enter("rest", view)
        return Decision(done=True)

    def _yield_point(self) -> list[float]:
        """Return normal and shear stress of the present load [Pa]: the largest ones, or steady ones."""
        curve = np.array(self.state.curve)
        if self.scene.is_smooth:
            return list(map(float, curve[curve[:, 0] > TRAVEL / 2 * self.size, 1:3].mean(axis=0)))
        each = max(round(PEAK * self.size / (self.state.travel / len(curve))), 1)
        sums = np.cumsum(np.insert(curve[:, 1:3], 0, 0.0, axis=0), axis=0)
        means = (sums[each:] - sums[:-each]) / each
        return list(map(float, means[np.argmax(means[:, 1])]))

    def measure(self) -> dict[str, float]:
        """Return the observables of all loads."""
        normal, shear, height = np.array(self.state.steady)[:, 1:].mean(axis=0).tolist()
        points = [(point[0], point[1]) for point in self.state.points]
        whole = [*points, (normal, shear)]
        found = wall_friction(whole) if self.scene.is_smooth else strengths(points, (normal, shear))
        density = self.state.mass / self.scene.volume_below(height)
        stresses = {f"shear_stress_{number}": point[1] for number, point in enumerate(whole, 1)}
        return {"sheared_density": density} | stresses | found
