"""Base of scenes whose grains a lid presses: doubts about speed and load, the lid's way down, its forces."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, TypeVar

import numpy as np

from dem_warp.materials import Material
from dem_warp.population import GrainPopulation
from dem_warp.scenes.boxes import FilledScene
from dem_warp.scenes.poured_controller import PouredController
from dem_warp.scenes.scene import SceneState
from dem_warp.view import WorldView
from dem_warp.walls import Motion

SLOW, TOO_FAST = 1e-3, 1e-2
"""Inertial numbers at the first stress to be read: quasi-static below one, refused above the other (GDR MiDi,
European Physical Journal E 14, 2004, 341-365)."""

SMALL_SQUEEZE, LARGE_SQUEEZE = 0.05, 0.25
"""Compressions of a grain over its size above which the contact law is doubtful, and has no meaning."""


def size_of(grains: GrainPopulation) -> float:
    """Return the diameter of balls with the mean volume of grains [m]."""
    return float((6 / math.pi * grains.mean(lambda shape: shape.volume)) ** (1 / 3) * grains.size_mean)


def speed_doubt(
    scene: Any, mover: str, inertia: float, limits: tuple[float, float], where: str
) -> tuple[str, ...]:
    """Describe a speed whose inertial number is above the first limit; refuse one above the second."""
    slow, too_fast = limits
    if inertia > too_fast:
        rule = f"must be below {scene.speed * too_fast / inertia:.3g} m/s, an inertial number of {too_fast}"
        raise ValueError(f"{type(scene).__name__}.speed: {rule}, got {scene.speed!r}")
    fast = (
        f"the {mover} is not quasi-static: an inertial number of {inertia:.1e} at {where}, above {slow:g}; "
        f"below {scene.speed * slow / inertia:.3g} m/s it is"
    )
    return (fast,) * (inertia > slow)


class DrivenScene(FilledScene):
    """A filled container with a mover, a lid or a tool, with a `fill_depth` and a `speed`."""

    fill_depth: float
    speed: float

    movers: ClassVar[int] = 1
    """Number of walls of the mover, the last ones."""

    @property
    def brim(self) -> float:
        return self.fill_depth

    def rest_place(self, reach: float) -> float:
        """Return the height of the mover during the filling, above the release [m]."""
        return self.release(reach) + 2 * reach


class LidScene(DrivenScene):
    """A filled container whose grains a lid presses, with a `stress`."""

    stress: float

    presser: ClassVar[str]
    """Name of the lid in messages."""
    first_load: ClassVar[float]
    """First stress to be read, over the largest."""

    def squeeze(self, material: Material) -> float:
        """Return the compression over their size of spheres of a material in a cubic array at the stress."""
        modulus = material.shear_modulus / (1 - material.poisson_ratio)
        return (1.5 * self.stress / modulus) ** (2 / 3)

    def doubts(self, grains: GrainPopulation, material: Material) -> tuple[str, ...]:
        """Describe a lid that is fast, and grains that are soft for the stress."""
        kind = type(self).__name__
        inertia = self.speed / self.fill_depth * size_of(grains)
        inertia *= math.sqrt(material.density / (self.first_load * self.stress))
        squeeze = self.squeeze(material)
        where = f"{self.first_load:.0%} of the stress"
        fast = speed_doubt(self, self.presser, inertia, (SLOW, TOO_FAST), where)
        if squeeze > LARGE_SQUEEZE:
            most = self.stress * (LARGE_SQUEEZE / squeeze) ** 1.5
            rule = f"must be below {most:.3g} Pa, "
            rule += f"where the {self.presser} meets the base with grains so soft"
            raise ValueError(f"{kind}.stress: {rule}, got {self.stress!r}")
        soft = (
            f"the stress squeezes spheres by {squeeze:.0%} of their size; the contact law holds for small "
            "overlaps"
        )
        return (*fast, *(soft,) * (squeeze > SMALL_SQUEEZE))


@dataclass
class LidState(SceneState):
    """State of a lid."""

    mass: float = 0.0
    """Mass of the grains [kg]."""
    place: float = 0.0
    """Height of the lid at the last look, or at the start of its motion [m]."""
    velocity: float = 0.0
    stops: float = 0.0
    """Its velocity [m/s], and the time at which it stops [s]."""
    looked: float = 0.0
    """Time of the last look [s]."""
    impulses: list[float] = field(default_factory=list)
    """Impulses of the grains on the weighed walls, along each axis, at the last look [N s]."""


LidT = TypeVar("LidT", bound=LidState)


class LidController(PouredController[LidT]):
    """Controller of a container with a lid or a tool, the last of its walls."""

    def lower(self, view: WorldView, kept: np.ndarray) -> Mapping[int, Motion]:
        """Begin to lower the lid to just above the grains `kept`."""
        state, scene = self.state, self.case.scene
        state.enter("approach", view)
        state.place = scene.rest_place(self.reach)
        self.mark(view)
        path = max(state.place - float(view.positions[kept, 2].max()) - self.reach, 1e-3 * self.reach)
        return self.move(view, -scene.rain_speed, path / scene.rain_speed)

    def move(self, view: WorldView, velocity: float, duration: float = math.inf) -> Mapping[int, Motion]:
        """Move the lid or the tool up or down at a velocity [m/s] for a time [s]."""
        self.state.velocity, self.state.stops = velocity, min(view.time + duration, 1e9)
        scene, count = self.case.scene, len(self.case.scene.wall_names)
        motion = Motion(velocity=(0.0, 0.0, velocity), duration=duration)
        return dict.fromkeys(range(count - scene.movers, count), motion)

    def mark(self, view: WorldView) -> None:
        """Begin to sum up forces from this look on."""
        self.state.looked, self.state.impulses = view.time, view.impulses.ravel().tolist()

    def forces(self, view: WorldView) -> tuple[np.ndarray, float]:
        """Return the mean forces on the weighed walls since the last look [N], (walls, 3), and its time."""
        state, passed = self.state, view.time - self.state.looked
        pushed = (view.impulses - np.array(state.impulses).reshape(-1, 3)) / passed
        self.mark(view)
        return pushed, passed
