"""The rotating drum: part fill it, turn it at a constant rate, watch the slope of the flowing surface."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np

from dem_warp.case import Case
from dem_warp.materials import Material
from dem_warp.model import GRAVITY, WorldSetup
from dem_warp.parameters import Parameter
from dem_warp.scenes.poured_controller import Phase, PouredController
from dem_warp.scenes.poured_scene import FILL_OBSERVABLES, PouredScene
from dem_warp.scenes.rain import CrossSection
from dem_warp.scenes.scene import Course, Decision, Observable
from dem_warp.scenes.surfaces import profile, slope
from dem_warp.view import WorldView
from dem_warp.walls import Cylinder, Disc, Motion, Wall

SHELL, ENDS = 0, (1, 2)
MOST_FILLED = 0.5
"""Part of the drum that a rain can fill: above the axis its wall closes over the bed."""

SURFACE = 0.8
"""The slope is fitted over this part of the surface's chord, clear of the drum's wall at both ends."""


@dataclass(frozen=True)
class Drum(PouredScene):
    """A horizontal drum, part filled by a rain of grains, turns about its axis, which is along y."""

    diameter: Annotated[float, Parameter("m", above=0.0)]
    """Inner diameter of the drum."""
    length: Annotated[float, Parameter("m", above=0.0)]
    """Inner length of the drum."""
    wall_material: Material
    """Material of the shell and the two ends, which turn along."""
    rotation_rate: Annotated[float, Parameter("1/s", above=0.0)]
    """Revolutions per second."""
    filling: Annotated[float, Parameter("1", above=0.0, at_most=MOST_FILLED)] = 0.35
    """Part of the drum's volume that the bed takes."""
    start_up: Annotated[float, Parameter("1", at_least=0.0)] = 1.0
    """Revolutions before measuring."""
    revolutions: Annotated[float, Parameter("1", above=0.0)] = 2.0
    """Revolutions while measuring."""

    name = "drum"
    wall_names = ("shell", "end-1", "end-2")
    observables: ClassVar[Mapping[str, Observable]] = FILL_OBSERVABLES | {
        "dynamic_angle": Observable(
            "deg",
            "slope of the least-squares line through the middle 80 % of the surface, mean over time",
        ),
        "dynamic_angle_sd": Observable("deg", "standard deviation of that slope from look to look"),
        "upper_angle": Observable("deg", "the same slope, of the upper half of that part"),
        "lower_angle": Observable("deg", "the same slope, of the lower half of that part"),
        "mass_angle": Observable(
            "deg",
            "turn of the line from the axis to the bed's centre of mass from the vertical, mean over time",
        ),
        "grains_lost": Observable("1", "grains that left the drum"),
    }
    floor = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.froude_number >= 1:
            fastest = self.rotation_rate / math.sqrt(self.froude_number)
            raise ValueError(
                f"Drum.rotation_rate: must be below {fastest:.4g} 1/s, where grains stick to the shell, "
                f"got {self.rotation_rate!r}"
            )

    @property
    def spin(self) -> float:
        """[rad/s]"""
        return 2 * math.pi * self.rotation_rate

    @property
    def froude_number(self) -> float:
        """Centripetal acceleration of the shell over gravity."""
        return self.spin**2 * self.diameter / 2 / GRAVITY

    @property
    def brim(self) -> float:
        """Height of a level bed that takes `filling` of the drum, the shell's lowest line being at 0 [m]."""
        angles = np.linspace(0.0, math.pi, 10_001)
        angle = np.interp(self.filling, (angles - np.sin(angles)) / (2 * math.pi), angles)
        return float(self.diameter / 2 * (1 - np.cos(angle / 2)))

    def volume_below(self, height: float) -> float:
        """Volume of the drum up to a height [m3]."""
        radius = self.diameter / 2
        angle = 2 * math.acos(float(np.clip(1 - height / radius, -1.0, 1.0)))
        return radius**2 / 2 * (angle - math.sin(angle)) * self.length

    def release(self, reach: float) -> float:
        """Above the bed, where the drum is wide [m]."""
        return max(self.brim + reach, self.diameter / 2)

    def cross_section(self, reach: float) -> CrossSection:
        """The widest box for a grain at the height of its release."""
        above_axis = self.release(reach) - self.diameter / 2 + reach
        half_width = math.sqrt(max((self.diameter / 2) ** 2 - above_axis**2, 0.0))
        return CrossSection((half_width, self.length / 2))

    def walls(self, reach: float) -> tuple[Wall, ...]:
        """Shell and ends."""
        radius, half, axis = self.diameter / 2, self.length / 2, (0.0, 1.0, 0.0)
        return (
            Cylinder((0.0, -half, radius), radius, self.length, axis),
            Disc((0.0, -half, radius), axis, radius),
            Disc((0.0, half, radius), axis, radius),
        )

    def room(self, reach: float) -> tuple[float, float, float]:
        """The drum."""
        return self.diameter / 2 + 2 * reach, self.length / 2 + 2 * reach, -2 * reach

    @property
    def fall_height(self) -> float:
        """Across the drum [m]."""
        return self.diameter

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "DrumController":
        """Controller of one case."""
        return DrumController(case, setup, chunk)


class SurfaceAngles(NamedTuple):
    """Slopes of a bed at one look [deg], as the observables of `Drum` define them."""

    dynamic_angle: float
    upper_angle: float
    lower_angle: float
    mass_angle: float


@dataclass
class Turning(Course):
    """Course of a drum."""

    angles: list[list[float]] = field(default_factory=list)
    """`SurfaceAngles` of every look at which all of them could be seen."""


class DrumController(PouredController[Turning]):
    """Phases of one drum: fill, settle, start up, turn."""

    def __init__(self, case: Case[Drum], setup: WorldSetup, chunk: int) -> None:
        super().__init__(case, setup, chunk, Turning("fill"))
        self.scene = scene = case.scene
        self.phases["start up"] = Phase(self._start_up, scene.start_up / scene.rotation_rate)
        self.phases["turn"] = Phase(self._turn, scene.revolutions / scene.rotation_rate)

    def begin(self, view: WorldView, kept: np.ndarray) -> Mapping[int, Motion]:
        """Turn the drum, so that its lowest line moves towards -x."""
        self.course.enter("start up", view)
        return dict.fromkeys((SHELL, *ENDS), Motion(spin=(0.0, self.scene.spin, 0.0)))

    def _start_up(self, view: WorldView) -> Decision:
        if view.time - self.course.phase_start >= self.phases["start up"].expected:
            self.course.enter("turn", view)
        return Decision()

    def _turn(self, view: WorldView) -> Decision:
        radius, level = self.scene.diameter / 2, self.course.observables["fill_height"]
        half_chord = math.sqrt(max(level * (2 * radius - level), 0.0))
        from_axis = view.positions[view.alive] - np.array([0.0, 0.0, radius])
        angles = surface_angles(from_axis, half_chord, self.grain_reach)
        if angles is not None:
            self.course.angles.append(list(angles))
        if view.time - self.course.phase_start < self.phases["turn"].expected:
            return Decision()
        return Decision(done=True, failure=self._finish(view))

    def _finish(self, view: WorldView) -> str:
        seen = self.course.observables
        seen["grains_lost"] = seen["grain_count"] - float(np.count_nonzero(view.alive))
        seen["simulated_time"] = view.time
        self.course.enter("end", view)
        if not self.course.angles:
            return "the surface of the bed was never wide enough for a line through each half"
        means = np.mean(self.course.angles, axis=0)
        seen |= {name: float(mean) for name, mean in zip(SurfaceAngles._fields, means, strict=True)}
        seen["dynamic_angle_sd"] = float(np.std([angles[0] for angles in self.course.angles]))
        return ""


def surface_angles(positions: np.ndarray, half_chord: float, reach: float) -> SurfaceAngles | None:
    """Slopes of the bed in a drum; None where a part of its surface is too short for a line.

    The bed is turned back by the angle of its centre of mass, so that its surface is nearly level and steep
    parts can be seen as well as flat ones.

    Parameters
    ----------
    positions : (n, 3) array
        Grain centres from the drum's axis, which is along y; the bed is high at -x [m].
    half_chord : float
        Half the length of the surface in the cross-section [m].
    reach : float
        Bounding radius of a grain [m].
    """
    if not len(positions):
        return None
    center = positions.mean(axis=0)
    turn = math.atan2(-center[0], -center[2])
    x, y, z = positions.T
    cosine, sine = math.cos(turn), math.sin(turn)
    level = np.column_stack([x * cosine - z * sine, y, x * sine + z * cosine])
    along, height = profile(level, reach)
    middle = np.abs(along) < SURFACE * half_chord
    gradients = [
        slope(along[part], height[part]) for part in (middle, middle & (along < 0), middle & (along > 0))
    ]
    whole, upper, lower = (None if g is None else math.degrees(turn - math.atan(g)) for g in gradients)
    if whole is None or upper is None or lower is None:
        return None
    return SurfaceAngles(whole, upper, lower, math.degrees(turn))
