"""The inclined plate: it is turned until the grains on it slide or roll, each by itself."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.clumps import ClumpShape
from dem_warp.materials import Material
from dem_warp.model import GRAVITY, ContactCoefficients, Grains, WorldSetup
from dem_warp.parameters import Parameter
from dem_warp.population import DrawnGrains
from dem_warp.result import place_spheres
from dem_warp.scenes.phases import UNREST, Phase
from dem_warp.scenes.placed_scene import CopiesState, PlacedController, PlacedScene, grid, heights, of_copies
from dem_warp.scenes.plates import UP, Plate, check_glued, glued
from dem_warp.scenes.rain import random_orientations
from dem_warp.scenes.scene import Decision, Observable
from dem_warp.scenes.tilting_box import STARTED, STEEPEST, USUAL, in_box
from dem_warp.view import WorldView
from dem_warp.walls import Disc, Motion, Wall

SETTLE_LIMIT = 5.0
"""Longest time until the grains rest on the level plate [s]."""

APART = 6.0
"""Distance of two copies over their bounding radius."""


@dataclass(frozen=True)
class Incline(PlacedScene):
    """Grains, or sledges of them, on a plate that is turned about its middle, downhill to +x."""

    wall_material: Material
    rotation_rate: Annotated[float, Parameter("1/s", above=0.0)] = field(default=3.0 / 360.0, kw_only=True)
    """Revolutions of the plate per second; 3 degrees per second are 0.5 per minute."""
    sledge: Annotated[int, Parameter("1", at_least=1, at_most=16)] = field(default=1, kw_only=True)
    """Grains that are glued together to a sledge, side by side; 1: single grains."""
    plate: Plate = field(default="smooth", kw_only=True)
    """smooth; or grains: the plate is covered with glued grains."""
    rest_speed: Annotated[float, Parameter("m/s", above=0.0)] = field(default=1.0e-3, kw_only=True)
    """Largest root mean square speed of resting grains; the fastest may have ten times this speed."""
    rest_time: Annotated[float, Parameter("s", above=0.0)] = field(default=0.05, kw_only=True)
    """Time that the grains must stay below `rest_speed` to be at rest."""

    name = "incline"
    wall_names = ("plate",)
    part_names = (("plate",),)
    top_speed = 0.5
    observables: ClassVar[Mapping[str, Observable]] = of_copies(
        {
            "start_angle": Observable(
                "deg",
                "angle of the plate at which half of the copies slide or roll down it: each counts when it "
                "first moves at 3 % of sqrt(g d), with the size d of a grain, or else at 80 degrees",
            )
        }
    )

    @property
    def spin(self) -> float:
        """Angular velocity [rad/s]."""
        return 2 * math.pi * self.rotation_rate

    def check_parts(self, names: Sequence[str]) -> None:
        """Raise ValueError for an unknown part, or a plate of glued grains with a material."""
        super().check_parts(names)
        check_glued("Incline", self.plate, names)

    def copies(self, case: Case[Any]) -> tuple[DrawnGrains, np.ndarray]:
        """Draw the grains, or the sledges, which stand on their feet, and their orientations."""
        drawn, orientations = super().copies(case)
        if self.sledge == 1:
            return drawn, orientations
        made = [sledge_of(shape, self.sledge, case.seed) for shape in drawn.clumps]
        upright = np.array([turn for _, turn in made])[drawn.shapes]
        yaws = np.arctan2(orientations[:, 2], orientations[:, 3])
        drawn = replace(drawn, clumps=tuple(shape for shape, _ in made))
        return drawn, _turned(upright, yaws)

    def half_width(self, reach: float) -> float:
        """Return the radius of the plate under the grid of copies [m]."""
        return APART * reach * math.ceil(math.sqrt(self.grain_count)) / math.sqrt(2.0)

    def walls(self, reach: float) -> tuple[Wall, ...]:
        radius = self.half_width(reach)
        return (
            glued(2 * radius, 0.0, reach) if self.plate == "grains" else Disc((0.0, 0.0, 0.0), UP, radius),
        )

    def contacts(self, case: Case[Any]) -> tuple[ContactCoefficients, ...]:
        """Return the contacts of grains with grains, and with the plate, smooth or of glued grains."""
        grains, walls = super().contacts(case)
        return grains, grains if self.plate == "grains" else walls

    def feet(self, reach: float) -> np.ndarray:
        return grid(self.grain_count, APART * reach)

    def ceiling(self, grains: Grains, reach: float) -> float:
        """Return the height of the upper rim of the steepest plate [m]."""
        return self.half_width(reach) + 4 * reach

    def room(self, reach: float) -> tuple[float, float, float]:
        half = self.half_width(reach) + 4 * reach
        return half, half, -half

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "InclineController":
        return InclineController(case, setup, chunk, InclineState("settle"))


def sledge_of(shape: ClumpShape, count: int, seed: int) -> tuple[ClumpShape, np.ndarray]:
    """Return a ring of grains on one plane, each in a random orientation, and its turn upright.

    The turn is the quaternion x y z w from the principal frame of the sledge to that in which it stands.
    """
    reach, turns = shape.bounding_radius, 2 * np.pi * np.arange(count) / count
    alone = DrawnGrains((shape,), np.zeros(count, dtype=int), np.ones(count))
    orientations = random_orientations(count, seed)
    ring = reach / math.sin(math.pi / count) * np.column_stack([np.cos(turns), np.sin(turns), 0.0 * turns])
    ring[:, 2] = heights(alone, orientations, UP)
    spheres = np.repeat(np.column_stack([shape.centers, shape.radii])[None], count, axis=0)
    centers, radii, _ = place_spheres(ring, orientations, np.ones(count), spheres)
    sledge = ClumpShape.from_spheres(centers, radii)
    # the rotation between the two sets of centres, which lie at least in one plane: Kabsch (1976)
    standing, principal = (each - each.mean(axis=0) for each in (centers, sledge.centers))
    left, _, right = np.linalg.svd(standing.T @ principal)
    matrix = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    return sledge, _quaternion(matrix)


def _quaternion(m: np.ndarray) -> np.ndarray:
    """Return the quaternion x y z w of a rotation matrix: Bar-Itzhack, J. Guidance 23 (2000) 1085."""
    k = np.zeros((4, 4))
    k[:3, :3] = m + m.T - np.trace(m) * np.eye(3)
    k[3, :3] = k[:3, 3] = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    k[3, 3] = np.trace(m)
    return np.linalg.eigh(k)[1][:, -1]


def _turned(quaternions: np.ndarray, yaws: np.ndarray) -> np.ndarray:
    """Return orientations turned on about the z axis by half angles [rad], (n, 4)."""
    (x, y, z, w), c, s = quaternions.T, np.cos(yaws), np.sin(yaws)
    return np.column_stack([c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z])


@dataclass
class InclineState(CopiesState):
    """State of an inclined plate."""

    turned_at: float = 0.0
    """Time at which the plate began to turn [s]."""


class InclineController(PlacedController[InclineState]):
    """Controller of an inclined plate: settle, tilt; copies that move are removed."""

    def __init__(self, case: Case[Incline], setup: WorldSetup, chunk: int, state: InclineState) -> None:
        super().__init__(case, setup, chunk, state)
        self.phases = {"settle": Phase(self._settle, 0.3), "tilt": Phase(self._tilt, USUAL / case.scene.spin)}
        self.started = STARTED * math.sqrt(GRAVITY * 2 * self.grain_reach)

    def _settle(self, view: WorldView) -> Decision:
        if view.time > SETTLE_LIMIT:
            failure = f"the grains did not come to rest on the plate within {SETTLE_LIMIT:g} s; {UNREST}"
            return Decision(done=True, failure=failure)
        if not self.rests(view):
            return Decision()
        self.state.turned_at = view.time
        self.state.enter("tilt", view)
        return Decision(move={0: Motion(spin=(0.0, self.case.scene.spin, 0.0))})

    def _tilt(self, view: WorldView) -> Decision:
        spin = self.case.scene.spin
        angle = spin * (view.time - self.state.turned_at)
        downhill = in_box(view.velocities, angle)[:, 0] - spin * in_box(view.positions, angle)[:, 2]
        steep = angle > STEEPEST
        moved = view.alive & ((downhill > self.started) | steep)
        self.state.read(start_angle=np.full(np.count_nonzero(moved), math.degrees(angle)))
        if (view.alive & ~moved).any():
            return Decision(remove=np.flatnonzero(moved))
        self.state.enter("end", view)
        failure = self.state.measure(view, np.median)
        stayed = steep and np.count_nonzero(moved) > len(view.alive) / 2
        if stayed:
            failure = f"half of the grains stayed in place up to {math.degrees(STEEPEST):g} degrees"
        return Decision(done=True, failure=failure)
