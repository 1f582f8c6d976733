"""Penetration: a cone, a plate or another body goes down into poured grains at constant speed."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from dem_warp.case import Case
from dem_warp.materials import Material
from dem_warp.model import GRAVITY, WorldSetup
from dem_warp.parameters import Parameter
from dem_warp.population import GrainPopulation
from dem_warp.scenes.lids import DrivenScene, LidController, LidState, size_of, speed_doubt
from dem_warp.scenes.phases import Phase
from dem_warp.scenes.poured_scene import FILL_OBSERVABLES
from dem_warp.scenes.rain import CrossSection
from dem_warp.scenes.scene import Decision, Observable
from dem_warp.view import WorldView
from dem_warp.walls import Cone, Cylinder, Disc, Mesh, Motion, Plane, Triangles, Wall

SHAFT, TIP = 2, 3
PARTS = 5
"""Equal parts of the depth over which forces are averaged."""

POINTS = 200
"""Fewest looks along the depth."""

SLOW, TOO_FAST = 0.01, 0.3
"""Inertial numbers at the whole depth above which the force depends on the speed, and that are refused."""

WIDE, FINE = 5.0, 5.0
"""Least widths of the bin over the tool, and of the tool over a grain, for the force of a wide bed."""

GAP = 0.1
"""Gap between tip and shaft over a grain's bounding radius: a sphere at the shoulder touches one of them."""

Tool = Literal["cone", "plate", "body"]
"""Shapes of a tip."""

PENETRATION_OBSERVABLES = {
    f"{name}force_{number}": Observable(
        "N", f"mean force upwards on the {what} in part {number} of the depth's {PARTS}"
    )
    for name, what in (("", "tool"), ("tip_", "tip"), ("shaft_", "shaft"))
    for number in range(1, PARTS + 1)
} | {"work": Observable("J", "work of the tool from the bed's surface to the whole depth")}
"""Observables of a penetration; the depth is that of the tip below the surface of the bed as poured."""


@dataclass(frozen=True)
class Penetration(DrivenScene):
    """Grains in a round bin are penetrated by a tool, a tip below a round shaft, at constant speed."""

    diameter: Annotated[float, Parameter("m", above=0.0)]
    """Inner diameter of the bin."""
    fill_depth: Annotated[float, Parameter("m", above=0.0)]
    """Depth of the grains in the bin."""
    wall_material: Material
    """Material of the bin and the tool."""
    depth: Annotated[float, Parameter("m", above=0.0)]
    """Depth of the lowest point of the tool below the surface of the bed at the end."""
    tool_diameter: Annotated[float | None, Parameter("m", above=0.0)] = None
    """Diameter of a cone or a plate; a body has its own."""
    tool: Tool = "cone"
    """Tip of the tool. body: that of a file."""
    tool_angle: Annotated[float, Parameter("rad", above=0.0, below=math.pi)] = math.pi / 3
    """Whole angle of the tip of a cone."""
    body: Triangles | None = None
    """Closed surface of a body, a mesh file in mm: z is up, and the axis of the bin is x = y = 0."""
    shaft_diameter: Annotated[float | None, Parameter("m", above=0.0)] = None
    """Diameter of the shaft above the tip. Default: as wide as the tip."""
    speed: Annotated[float, Parameter("m/s", above=0.0)] = 0.03
    """Speed of the tool."""

    name = "penetration"
    wall_names = ("base", "bin", "shaft", "tip")
    part_names = (("base",), ("bin",), ("tool", "shaft"), ("tool", "tip"))
    weighed, movers = (SHAFT, TIP), 2
    observables: ClassVar[Mapping[str, Observable]] = FILL_OBSERVABLES | PENETRATION_OBSERVABLES

    def __post_init__(self) -> None:
        super().__post_init__()
        given = {"tool_diameter": self.tool != "body", "body": self.tool == "body"}
        for name, is_wanted in given.items():
            if (getattr(self, name) is not None) != is_wanted:
                rule = f"{'needed' if is_wanted else 'must be absent'} with tool = {self.tool!r}"
                raise ValueError(f"Penetration.{name}: {rule}")
        for name, value, most, limit in (
            ("tool_diameter" if self.body is None else "body", self.width, self.diameter, "diameter"),
            ("shaft_diameter", self.shaft_width, 1.000001 * self.width, "width of the tip"),
            ("depth", self.depth, self.fill_depth, "fill_depth"),
        ):
            if not value < most:
                rule = f"must be below the {limit}, {most:.4g} m"
                raise ValueError(f"Penetration.{name}: {rule}, got {value!r} m")

    @property
    def corners(self) -> np.ndarray:
        """Corners of the body's triangles above its lowest point [m], (3 n, 3)."""
        corners = np.array(self.body, dtype=float).reshape(-1, 3)
        return corners - [0.0, 0.0, corners[:, 2].min()]

    @property
    def width(self) -> float:
        """Width of the tip, twice its farthest distance from the axis [m]."""
        if self.body is None:
            return float(self.tool_diameter or 0.0)
        return 2 * float(np.hypot(*self.corners[:, :2].T).max())

    @property
    def shaft_width(self) -> float:
        """Diameter of the shaft [m]."""
        return self.width if self.shaft_diameter is None else self.shaft_diameter

    @property
    def tip_height(self) -> float:
        """Height of the tip [m]."""
        if self.body is not None:
            return float(self.corners[:, 2].max())
        return self.width / 2 / math.tan(self.tool_angle / 2) if self.tool == "cone" else 0.0

    def volume_below(self, height: float) -> float:
        return math.pi / 4 * self.diameter**2 * height

    def cross_section(self, reach: float) -> CrossSection:
        return CrossSection.circle(self.diameter / 2)

    def walls(self, reach: float) -> tuple[Wall, ...]:
        bottom, low = (0.0, 0.0, 0.0), self.rest_place(reach)
        shoulder = (0.0, 0.0, low + self.tip_height + GAP * reach)
        return (
            Plane(),
            Cylinder(bottom, self.diameter / 2, low),
            Cylinder(shoulder, self.shaft_width / 2, self.brim),
            self._tip((0.0, 0.0, low)),
        )

    def _tip(self, point: tuple[float, float, float]) -> Wall:
        """Return the tip with its lowest point at a place [m]."""
        if self.tool == "plate":
            return Disc(point, (0.0, 0.0, 1.0), self.width / 2)
        if self.tool == "cone":
            return Cone(point, 0.0, self.width / 2, self.tip_height)
        # neighbours share their corners to the digit
        vertices, faces = np.unique(np.round(self.corners + point, 9), axis=0, return_inverse=True)
        return Mesh(vertices, faces.reshape(-1, 3), point)

    def room(self, reach: float) -> tuple[float, float, float]:
        half_width = self.diameter / 2 + 2 * reach
        return half_width, half_width, -2 * reach

    def doubts(self, grains: GrainPopulation, material: Material) -> tuple[str, ...]:
        """Describe a tool that is fast, narrow for the grains or wide for the bin."""
        size = size_of(grains)
        # the pressure is at least the weight of the grains above; their density cancels
        inertia = self.speed / self.width * size / math.sqrt(GRAVITY * self.depth)
        fast = speed_doubt(self, "tool", inertia, (SLOW, TOO_FAST), "the whole depth")
        narrow = f"the tool is {self.width / size:.1f} grains wide; below {FINE:g} single grains stop it"
        near = (
            f"the bin is {self.diameter / self.width:.1f} tools wide; below {WIDE:g} a rough wall adds force"
        )
        left = self.fill_depth - self.depth
        low = f"the tool ends {left / self.width:.1f} of its widths above the base, which adds force below 1"
        found = {
            narrow: self.width < FINE * size,
            near: self.diameter < WIDE * self.width,
            low: left < self.width,
        }
        return (*fast, *(doubt for doubt, holds in found.items() if holds))

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "PenetrationController":
        return PenetrationController(case, setup, chunk)


@dataclass
class PenetrationState(LidState):
    """State of a penetration."""

    level: float = 0.0
    """Height of the bed's surface before the tool comes [m]."""
    curve: list[list[float]] = field(default_factory=list)
    """Depth of the tip [m], and impulses on shaft and tip [N s]: from the last look above the surface on."""


class PenetrationController(LidController[PenetrationState]):
    """Controller of a penetration: fill, settle, approach, penetrate."""

    def __init__(self, case: Case[Penetration], setup: WorldSetup, chunk: int) -> None:
        self.scene = scene = case.scene
        self.step = scene.depth / POINTS
        self.LOOK = min(self.LOOK, self.step / scene.speed)
        super().__init__(case, setup, chunk, PenetrationState("fill"))
        self.phases |= {
            "approach": Phase(self._approach, 3 * self.reach / scene.rain_speed + self.LOOK),
            "penetrate": Phase(self._penetrate, (scene.depth + self.reach) / scene.speed),
        }

    def begin(self, view: WorldView, kept: np.ndarray) -> Mapping[int, Motion]:
        self.state.level = self.level(view, kept)
        return self.lower(view, kept)

    def _approach(self, view: WorldView) -> Decision:
        state, wanted = self.state, self.scene.depth + 2 * self.reach
        if state.level < wanted:
            rule = f"the bed is {1e3 * state.level:.3g} mm deep, and the tool needs {1e3 * wanted:.3g} mm"
            return Decision(done=True, failure=f"{rule}: fill in more grains, or lower the depth")
        if view.time < state.stops:
            return Decision()
        state.place += state.velocity * (state.stops - state.looked)
        state.enter("penetrate", view)
        self._note(view)
        return Decision(move=self.move(view, -self.scene.speed))

    def _note(self, view: WorldView) -> float:
        """Note depth and impulses; return the depth [m]."""
        state = self.state
        depth = state.level - state.place + self.scene.speed * (view.time - state.phase_start)
        point = [depth, *map(float, view.impulses[:, 2])]
        if state.curve and depth <= 0.0:
            state.curve = [point]
        elif not state.curve or depth >= min(state.curve[-1][0] + self.step, self.scene.depth):
            state.curve.append(point)
        return depth

    def _penetrate(self, view: WorldView) -> Decision:
        if self._note(view) < self.scene.depth:
            return Decision()
        self.state.observables |= self.measure() | {"simulated_time": view.time}
        self.state.enter("rest", view)
        return Decision(done=True)

    def measure(self) -> dict[str, float]:
        """Return the mean forces in the parts of the depth, and the work."""
        depths, *impulses = np.array(self.state.curve).T
        part = self.scene.depth / PARTS
        ends = part * np.arange(PARTS + 1)
        shaft, tip = (np.diff(np.interp(ends, depths, each)) * self.scene.speed / part for each in impulses)
        forces = {"": shaft + tip, "tip_": tip, "shaft_": shaft}
        found = {
            f"{name}force_{number}": float(force)
            for name, each in forces.items()
            for number, force in enumerate(each, 1)
        }
        return found | {"work": float(forces[""].sum() * part)}
