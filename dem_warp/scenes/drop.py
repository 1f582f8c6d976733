"""The drop test: grains fall on a plate, each by itself, and rebound."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.materials import Material
from dem_warp.model import GRAVITY, Grains, WorldSetup
from dem_warp.parameters import Parameter
from dem_warp.scenes.bench_formulas import rebound
from dem_warp.scenes.phases import Phase
from dem_warp.scenes.placed_scene import CopiesState, PlacedController, PlacedScene, grid, of_copies
from dem_warp.scenes.scene import Decision, Observable
from dem_warp.view import WorldView
from dem_warp.walls import Plane, Wall

PATIENCE = 0.2
"""Time after the hit, over that of the fall, in which a grain that rebounds begins its highest flight."""

STRUCK = 0.05
"""Part of its speed that a falling grain has lost once it has hit the plate."""


@dataclass(frozen=True)
class Drop(PlacedScene):
    """Grains fall on a level or inclined plate.

    The plate is the plane z = 0, and gravity is inclined in its place, downhill to +x.
    """

    height: Annotated[float, Parameter("m", above=0.0)]
    """Fall of each grain until it touches the plate."""
    wall_material: Material
    plate_angle: Annotated[float, Parameter("rad", at_least=0.0, at_most=math.radians(60.0))] = field(
        default=0.0, kw_only=True
    )
    """Angle of the plate from the horizontal."""

    name = "drop"
    wall_names = ("plate",)
    part_names = (("plate",),)
    observables: ClassVar[Mapping[str, Observable]] = of_copies(
        {
            "rebound_height": Observable(
                "m",
                "mean over the copies of how far the centre rises from the plate after the hit, along the "
                "plate's normal; the height of rebound from a level plate",
            ),
            "rebound_restitution": Observable(
                "1",
                "mean over the copies of the centre's speed along the plate's normal after the hit over that "
                "before: on a level plate the root of the height of rebound over that of the fall; at 45 "
                "degrees what two catch heights give",
            ),
            "tangential_ratio": Observable(
                "1",
                "mean over the copies of the centre's speed down the plate after the hit over that before; "
                "absent on a level plate",
            ),
            "speed_ratio": Observable(
                "1", "mean over the copies of the centre's speed after the hit over that before"
            ),
        }
    )

    @property
    def gravity(self) -> tuple[float, float, float]:
        return GRAVITY * math.sin(self.plate_angle), 0.0, -GRAVITY * math.cos(self.plate_angle)

    @property
    def top_speed(self) -> float:
        return math.sqrt(2 * GRAVITY * self.height)

    @property
    def spacing(self) -> float:
        """Distance of two copies that cannot meet before they fall on the plate again [m].

        A grain rebounds with at most its energy. At an angle b of its speed from the normal it goes down the
        plate by (sin 2b / cos a + sin a cos^2 b / cos^2 a) times its fall, until it is farthest from it.
        """
        down = math.sin(self.plate_angle) / math.cos(self.plate_angle) ** 2
        return 2 * self.height * math.hypot(1 / math.cos(self.plate_angle), down / 2)

    def walls(self, reach: float) -> tuple[Wall, ...]:
        return (Plane(),)

    def feet(self, reach: float) -> np.ndarray:
        start = [-math.sin(self.plate_angle), 0.0, math.cos(self.plate_angle)]
        return grid(self.grain_count, self.spacing + 4 * reach) + self.height * np.array(start)

    def ceiling(self, grains: Grains, reach: float) -> float:
        """Return the height of a grain that leaves an inclined plate along its normal [m]."""
        return self.height / math.cos(self.plate_angle) + 4 * reach

    def room(self, reach: float) -> tuple[float, float, float]:
        half = math.ceil(math.sqrt(self.grain_count)) / 2 * (self.spacing + 4 * reach) + 3 * self.height
        return half, half, -2 * reach

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "DropController":
        return DropController(case, setup, chunk)


@dataclass
class DropState(CopiesState):
    """State of a drop test."""

    flights: list[list[float]] = field(default_factory=list)
    """Highest flight of each copy: rise [m], and speed down the plate and whole speed at its start [m/s]."""


class DropController(PlacedController[DropState]):
    """Controller of a drop test: each copy is removed when it comes back to the plate.

    A long grain may hit with one end, rise by little, and fly off when its other end has hit.
    """

    LOOK = 1.0e-3

    def __init__(self, case: Case[Drop], setup: WorldSetup, chunk: int) -> None:
        count, scene = setup.grains.count, case.scene
        start = DropState("drop", flights=[[0.0] * 3] * count)
        super().__init__(case, setup, chunk, start)
        self.downhill, self.pull = scene.gravity[0], -scene.gravity[2]
        self.fall = fall_time(scene.height, scene.air_drag)
        self.normal_fall = scene.height * math.cos(scene.plate_angle)
        self.hit_heights = setup.grains.positions[:, 2] - self.normal_fall
        self.phases = {"drop": Phase(self._look_on, 2 * self.fall)}

    def _look_on(self, view: WorldView) -> Decision:
        flights, now, away = np.array(self.state.flights), self._flights(view), view.velocities[:, 2]
        struck = away > (1 - STRUCK) * self._falling(view.time)
        flies = view.alive & struck & (view.positions[:, 2] > self.hit_heights)
        higher = flies & (now[:, 0] > flights[:, 0])
        flights[higher] = now[higher]
        self.state.flights = flights.tolist()
        ended = view.alive & (away <= 0.0) & (view.time > (1 + PATIENCE) * self.fall)
        self._read(flights[ended])
        if (view.alive & ~ended).any():
            return Decision(remove=np.flatnonzero(ended))
        self.state.enter("end", view)
        return Decision(done=True, failure=self.state.measure(view))

    def _falling(self, time: float) -> float:
        """Return the velocity along the normal of a grain that still falls [m/s], in still air."""
        drag = self.case.scene.air_drag
        return -self.pull * (-math.expm1(-drag * time) / drag if drag else time)

    def _flights(self, view: WorldView) -> np.ndarray:
        """Return the flights of grains that fly freely since the hit, in parabolas, (n, 3)."""
        along, across, away = view.velocities.T
        rise = np.maximum(view.positions[:, 2] + away**2 / (2 * self.pull) - self.hit_heights, 0.0)
        along = along - self.downhill * (view.time - self.fall)
        speed = np.sqrt(2 * self.pull * rise + along**2 + across**2)
        return np.column_stack([rise, along, speed])

    def _read(self, flights: np.ndarray) -> None:
        rise, along, speed = flights.T
        before = self.case.scene.top_speed
        downhill = before * math.sin(self.case.scene.plate_angle)
        self.state.read(
            rebound_height=rise,
            rebound_restitution=rebound(self.normal_fall, rise),
            speed_ratio=speed / before,
            **({"tangential_ratio": along / downhill} if downhill else {}),
        )


def fall_time(height: float, drag: float) -> float:
    """Return the time of a fall from rest in still air [s], by Newton's method."""
    time = math.sqrt(2 * height / GRAVITY)
    for _ in range(20 if drag else 0):
        speed = -GRAVITY * math.expm1(-drag * time) / drag
        time += (height - (GRAVITY * time - speed) / drag) / speed
    return time
