"""The ledge test: the side of a filled box opens, grains run out of it, and a slope stays."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from dem_warp.case import Case
from dem_warp.model import WorldSetup
from dem_warp.parameters import Parameter
from dem_warp.scenes.boxes import BoxScene, ReleaseController, box_plates
from dem_warp.scenes.poured_scene import FILL_OBSERVABLES
from dem_warp.scenes.scene import Observable
from dem_warp.scenes.surfaces import flank_angle, profile
from dem_warp.view import WorldView
from dem_warp.walls import Mesh, Motion, Wall

DOOR = 1
LONGEST = 5.0
"""Length of an apron without a given one over the depth of the filling."""

STANDING = 0.95
"""Least part of the mass in the box with which its face stands."""

COVERED = 0.5
"""Least part of the box's depth that grains cover up to the front of a deposit."""


@dataclass(frozen=True)
class Ledge(BoxScene):
    """A box, filled by a rain of grains, whose side at +x opens; its sides along x go on along the apron."""

    door: Literal["lift", "fall", "hinge"] = "lift"
    """lift: the door moves up; fall: down through the floor; hinge: it swings out about its upper edge."""
    door_speed: Annotated[float, Parameter("m/s", above=0.0)] = 1.0
    """Speed of the door, or of its lower edge when it swings."""
    apron: Annotated[float | None, Parameter("m", at_least=0.0)] = None
    """Length of the floor beyond the door; grains that fall over its end are lost. 0: none, as in a shear
    box. Default: five depths of the filling."""

    name = "ledge"
    wall_names = ("box", "door")
    observables: ClassVar[Mapping[str, Observable]] = FILL_OBSERVABLES | {
        "ledge_angle": Observable(
            "deg",
            "slope of the grains that stay, least-squares line from 10 to 90 % of its height; 90 where the "
            "face stands; absent if it rises by less than two grains",
        ),
        "share_left": Observable("1", "mass that stays in the box over the filled mass"),
        "filled_mass": Observable("kg", "mass of the grains in the box when it opens"),
        "run_out": Observable(
            "m",
            "distance from the door to the front of the grains beyond it, up to where they cover half of the "
            "depth, in columns of a grain's size",
        ),
        "stands": Observable("1", f"1: the face stands, with {100 * STANDING:g} % of the mass in the box"),
        "flow_time": Observable("s", "time from the opening until the grains rest"),
        "grains_lost": Observable("1", "grains that fell over the end of the apron"),
    }
    part_names = (("box",), ("door",))

    @property
    def end(self) -> float:
        """Place of the end of the apron along x [m]."""
        return self.width / 2 + (LONGEST * self.fill_depth if self.apron is None else self.apron)

    def walls(self, reach: float) -> tuple[Wall, ...]:
        """Return the box with its apron, up to above the release, and the door."""
        x, y, top = self.width / 2, self.depth / 2, self.release(reach) + 2 * reach
        door = Mesh.plates([[(x, -y, 0.0), (x, y, 0.0), (x, y, top), (x, -y, top)]])
        return Mesh.plates(box_plates((-x, self.end), y, top)[:-1]), replace(door, point=(x, 0.0, top))

    def opening_motion(self, reach: float) -> Motion:
        """Return the motion of the door, which ends when it is out of the way."""
        path, speed = self.release(reach) + 2 * reach, self.door_speed
        if self.door == "hinge":
            return Motion(spin=(0.0, -speed / path, 0.0), duration=math.pi / 2 * path / speed)
        up = speed if self.door == "lift" else -speed
        return Motion(velocity=(0.0, 0.0, up), duration=(path + 2 * reach) / speed)

    def room(self, reach: float) -> tuple[float, float, float]:
        return self.end + 2 * reach, self.depth / 2 + 2 * reach, -2 * reach

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "LedgeController":
        return LedgeController(case, setup, chunk)


class LedgeController(ReleaseController):
    """Controller of a ledge: fill, settle, run out."""

    def __init__(self, case: Case[Ledge], setup: WorldSetup, chunk: int) -> None:
        self.motion = case.scene.opening_motion(float(setup.bounding_radii.max()))
        super().__init__(case, setup, chunk, "run out", self.motion.duration + 0.8)

    def begin(self, view: WorldView, kept: np.ndarray) -> Mapping[int, Motion]:
        """Open the door."""
        self.state.observables["filled_mass"] = float(view.masses[kept].astype(float).sum())
        self.state.enter(self.released, view)
        return {DOOR: self.motion}

    def is_free(self, view: WorldView) -> bool:
        return view.time - self.state.phase_start >= self.motion.duration

    def measure(self, view: WorldView) -> dict[str, float]:
        scene, reach = self.case.scene, self.grain_reach
        positions, masses = view.positions[view.alive], view.masses[view.alive].astype(float)
        share = float(masses[positions[:, 0] < scene.width / 2].sum()) / self.state.observables["filled_mass"]
        stands = share >= STANDING
        angle = 90.0 if stands else flank_angle(*profile(positions, reach), reach)
        return {
            "share_left": share,
            "stands": float(stands),
            "run_out": front(positions, scene.width / 2, scene.depth, reach),
            "flow_time": view.time - self.state.phase_start - self.poured.rest_time,
        } | ({} if angle is None else {"ledge_angle": angle})


def front(positions: np.ndarray, start: float, depth: float, reach: float) -> float:
    """Return the distance from `start` to the first column that grains cover by less than half [m].

    `positions` (n, 3) are centres, uniform along y over a `depth`, of grains of a bounding radius `reach`.
    """
    side = 2 * reach
    beyond = positions[positions[:, 0] >= start]
    cells = np.unique(np.floor((beyond[:, :2] - [start, -depth / 2]) / side).astype(int), axis=0)
    covered = np.bincount(cells[:, 0]) / math.ceil(depth / side) if len(cells) else np.zeros(0)
    return side * float(np.argmin(np.append(covered >= COVERED, False)))
