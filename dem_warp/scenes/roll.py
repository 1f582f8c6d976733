"""The rolling test: grains roll down a slope, each by itself, and run out on a level plate."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated, Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.materials import Material
from dem_warp.model import GRAVITY, WorldSetup
from dem_warp.parameters import Parameter
from dem_warp.scenes.bench_formulas import rolling_run
from dem_warp.scenes.phases import UNREST, Phase
from dem_warp.scenes.placed_scene import CopiesState, PlacedController, PlacedScene, of_copies
from dem_warp.scenes.scene import Decision, Observable
from dem_warp.view import WorldView
from dem_warp.walls import Mesh, Vector, Wall

APART = 12.0
"""Distance of two lanes over the bounding radius of a grain."""

FACETS = 32
"""Facets of a rounded foot of the slope."""

MARGIN = 1.1
"""Distance of two grains that come too near, over the sum of their bounding radii."""

LIMIT = 20.0
"""Longest time beyond the expected one until the grains rest [s]."""


@dataclass(frozen=True)
class Roll(PlacedScene):
    """Grains roll down a slope towards +x, and on over the level plate z = 0, each in a lane of its own."""

    slope: Annotated[float, Parameter("rad", above=0.0, at_most=math.radians(60.0))]
    """Angle of the slope from the horizontal."""
    distance: Annotated[float, Parameter("m", above=0.0)]
    """Way of each grain down the slope to the level plate."""
    wall_material: Material
    run: Annotated[float, Parameter("m", above=0.0)] = field(default=1.0, kw_only=True)
    """Length of the level plate, which most grains must not leave."""
    foot_radius: Annotated[float, Parameter("m", at_least=0.0)] = field(default=0.02, kw_only=True)
    """Radius of the rounded foot of the slope; 0: a sharp corner, on which grains bounce."""
    rest_speed: Annotated[float, Parameter("m/s", above=0.0)] = field(default=1.0e-3, kw_only=True)
    """Largest root mean square speed of resting grains; the fastest may have ten times this speed."""
    rest_time: Annotated[float, Parameter("s", above=0.0)] = field(default=0.05, kw_only=True)
    """Time that the grains must stay below `rest_speed` to be at rest."""

    name = "roll"
    wall_names = ("plate",)
    part_names = (("plate",),)
    observables: ClassVar[Mapping[str, Observable]] = of_copies(
        {
            "run_out": Observable(
                "m",
                "median over the copies of the horizontal distance of the centre from the line where slope "
                "and level plate meet, at rest or as it leaves the plate; negative on the slope",
            ),
            "run_friction": Observable(
                "1",
                "median over the copies of S sin(b) / (S cos(b) + L) of slope b, way S down it and run-out "
                "L: the rolling friction of a ball that runs out so far",
            ),
        }
    ) | {
        "grains_lost": Observable("1", "copies that are left out, as they came near another"),
    }

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.tangent < min(self.distance, self.run):
            rule = f"must be below {min(self.distance, self.run) / math.tan(self.slope / 2):.4g} [m]"
            raise ValueError(f"Roll.foot_radius: {rule}, got {self.foot_radius!r}")

    @property
    def tangent(self) -> float:
        """Distance from the line where slope and plate meet to the ends of the rounding [m]."""
        return self.foot_radius * math.tan(self.slope / 2)

    @property
    def upwards(self) -> Vector:
        """Normal of the slope."""
        return math.sin(self.slope), 0.0, math.cos(self.slope)

    @property
    def top_speed(self) -> float:
        return math.sqrt(2 * GRAVITY * self.distance * math.sin(self.slope))

    def half_width(self, reach: float) -> float:
        """Return half the width of all lanes, and as much at their sides as a grain may drift [m]."""
        return APART * reach * self.grain_count / 2 + self.distance + self.run

    def walls(self, reach: float) -> tuple[Wall, ...]:
        """Return slope, rounding and level plate in one piece, from a little above the grains."""
        up, y = self.distance + 4 * reach, self.half_width(reach)
        angles = np.linspace(self.slope, 0.0, FACETS + 1)
        center = np.array([self.tangent, self.foot_radius])
        rounding = center - self.foot_radius * np.column_stack([np.sin(angles), np.cos(angles)])
        top = [-up * math.cos(self.slope), up * math.sin(self.slope)]
        knots = rounding if self.foot_radius else np.zeros((1, 2))
        line = np.vstack([top, knots, [self.run, 0.0]])
        plates = [
            [(x, -y, z), (x, y, z), (after, y, low), (after, -y, low)]
            for (x, z), (after, low) in pairwise(line)
        ]
        return (Mesh.plates(plates),)

    def feet(self, reach: float) -> np.ndarray:
        lanes = APART * reach * (np.arange(self.grain_count) - (self.grain_count - 1) / 2)
        foot = np.array([-math.cos(self.slope), 0.0, math.sin(self.slope)]) * self.distance
        return foot + lanes[:, None] * np.array([0.0, 1.0, 0.0])

    def room(self, reach: float) -> tuple[float, float, float]:
        return max(self.run, self.distance) + 6 * reach, self.half_width(reach), -2 * reach

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "RollController":
        return RollController(case, setup, chunk)


@dataclass
class RollState(CopiesState):
    """State of a rolling test."""

    lost: int = 0
    """Number of copies that came near another."""


class RollController(PlacedController[RollState]):
    """Controller of a rolling test, which removes grains that roll off or come near another."""

    def __init__(self, case: Case[Roll], setup: WorldSetup, chunk: int) -> None:
        super().__init__(case, setup, chunk, RollState("roll"))
        scene = case.scene
        self.expected = 2 * (scene.distance + scene.run) / scene.top_speed
        self.phases = {"roll": Phase(self._roll, self.expected)}
        self.reaches = setup.bounding_radii

    def _roll(self, view: WorldView) -> Decision:
        off = view.alive & (view.positions[:, 0] > self.case.scene.run)
        near = ~off & self._near_another(view)
        self._read(view.positions[off, 0])
        self.state.lost += int(np.count_nonzero(near))
        rolls = view.alive & ~off & ~near
        late = view.time > self.expected + LIMIT
        if rolls.any() and not (late or self.rests(view)):
            return Decision(remove=np.flatnonzero(off | near))
        self._read(view.positions[rolls, 0])
        self.state.observables["grains_lost"] = float(self.state.lost)
        self.state.enter("end", view)
        failure = self.state.measure(view, np.median)
        if self.state.observables.get("run_out", 0.0) > self.case.scene.run:
            failure = "half of the grains rolled off the level plate: lengthen run"
        if late:
            failure = f"the grains did not rest within {self.expected + LIMIT:.1f} s; {UNREST}"
        return Decision(remove=np.flatnonzero(off | near), done=True, failure=failure)

    def _read(self, run: np.ndarray) -> None:
        scene = self.case.scene
        self.state.read(run_out=run, run_friction=rolling_run(scene.slope, scene.distance, run))

    def _near_another(self, view: WorldView) -> np.ndarray:
        """Mark the copies that may touch another before the next look, as they move now."""
        own = np.flatnonzero(view.alive)
        places, moves, reaches = view.positions[own], view.velocities[own].astype(float), self.reaches[own]
        apart, closing = places[:, None] - places, moves[:, None] - moves
        squares = np.maximum((closing**2).sum(axis=2), np.finfo(float).tiny)
        nearest = np.clip(-(apart * closing).sum(axis=2) / squares, 0.0, self.period * self.setup.time_step)
        least = np.linalg.norm(apart + nearest[:, :, None] * closing, axis=2)
        near = np.zeros(len(view.alive), dtype=bool)
        near[own] = np.count_nonzero(least < MARGIN * (reaches[:, None] + reaches), axis=1) > 1
        return near
