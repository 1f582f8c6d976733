"""The rotating drum: partly fill it, turn it at a constant rate, measure the slope of the surface."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.materials import Material
from dem_warp.model import GRAVITY, WorldSetup
from dem_warp.parameters import LATER, Parameter
from dem_warp.scenes.averages import mean_over_time
from dem_warp.scenes.drum_surface import (
    STATIONS,
    DrumView,
    Picture,
    SurfaceAngles,
    bed_volume,
    half_chord,
    level_of,
    surface_angles,
    surface_heights,
)
from dem_warp.scenes.phases import Phase
from dem_warp.scenes.poured_controller import PouredController
from dem_warp.scenes.poured_scene import FILL_OBSERVABLES, PouredScene
from dem_warp.scenes.rain import CrossSection
from dem_warp.scenes.scene import Decision, Observable, SceneState
from dem_warp.view import WorldView
from dem_warp.walls import Cylinder, Disc, Motion, Wall

SHELL, ENDS = 0, (1, 2)
MOST_FILLED = 0.8
"""Largest part of the drum that a rain can fill: higher up its wall closes over the bed."""

OPEN_FILLED = 0.5
"""Largest part that a rain fills across the whole width of the drum."""

HATCH = 0.8
"""Height of the hatch above the axis over the radius; grains of fuller or inclined beds fall from it."""

FLYING = 0.5
"""Least speed of a falling grain over its first speed."""


@dataclass(frozen=True)
class Drum(PouredScene):
    """A drum, partly filled by a rain of grains, turns about its axis, which is along y.

    z is up in the cross-section. For an inclined axis gravity is turned instead of the drum: its front, the
    end at -y, is the lower one.
    """

    diameter: Annotated[float, Parameter("m", above=0.0)]
    """Inner diameter of the drum."""
    length: Annotated[float, Parameter("m", above=0.0)]
    """Inner length of the drum."""
    wall_material: Material
    """Material of the shell and the two ends, which turn with it."""
    rotation_rate: Annotated[float, Parameter("1/s", above=0.0)]
    """Revolutions per second."""
    filling: Annotated[float, Parameter("1", above=0.0, at_most=MOST_FILLED)] = 0.35
    """Approximate part of the drum's volume that the bed fills. A level bed of up to a half is levelled off
    and ends 10 to 40 % lower; `fill_height` is the height reached."""
    start_up: Annotated[float, Parameter("1", at_least=0.0)] = 1.0
    """Revolutions before measuring."""
    revolutions: Annotated[float, Parameter("1", above=0.0)] = 2.0
    """Revolutions while measuring."""
    inclination: Annotated[float, Parameter("rad", at_least=0.0, below=math.pi / 2)] = field(
        default=0.0, metadata=LATER
    )
    """Inclination of the axis; the front end is the lower."""
    picture: Picture = field(default="depth", metadata=LATER)
    """Picture for the slopes. depth: the mean surface over the length of the drum; silhouette: the outline in
    a camera before the front end against a light behind the drum; end: the grains at the front end."""
    camera_distance: Annotated[float | None, Parameter("m", above=0.0)] = field(default=None, metadata=LATER)
    """Distance of the camera from the front end, on the axis, for a silhouette. Default: infinite."""

    name = "drum"
    wall_names = ("shell", "end-1", "end-2")
    observables: ClassVar[Mapping[str, Observable]] = (
        FILL_OBSERVABLES
        | {
            "dynamic_angle": Observable(
                "deg",
                "slope of the least-squares line through the middle 80 % of the surface, mean over time",
            ),
            "dynamic_angle_sd": Observable("deg", "standard deviation of that slope over time"),
            "dynamic_angle_se": Observable(
                "deg",
                "standard error of that mean, with the slope's autocorrelation; absent with fewer than four "
                "looks",
            ),
            "dynamic_angle_freedom": Observable(
                "1", "degrees of freedom of that standard error, for Student's t"
            ),
            "upper_angle": Observable("deg", "slope of the upper half of that part, mean over time"),
            "lower_angle": Observable("deg", "slope of the lower half of that part, mean over time"),
            "mass_angle": Observable(
                "deg", "mean angle between the vertical and the line from the axis to the centre of mass"
            ),
            "mass_angle_se": Observable("deg", "standard error of the mean of that angle over time"),
            "grains_lost": Observable("1", "grains that left the drum"),
        }
        | {
            f"surface_{number}": Observable(
                "m", f"height of the surface above the axis at x = {place:+g} of the radius, mean over time"
            )
            for number, place in enumerate(STATIONS, 1)
        }
    )
    part_names = (("shell",), ("ends", "front"), ("ends", "back"))
    floor = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.camera_distance is not None and self.picture != "silhouette":
            rule = f"must be left out with the picture {self.picture}"
            raise ValueError(f"Drum.camera_distance: {rule}, got {self.camera_distance!r}")
        if self.is_hatched and self.highest > self.hatch:
            raise ValueError(
                f"Drum.filling: the bed at the lower end must be below the hatch at {self.hatch:.4g} m, got "
                f"{self.highest:.4g} m at filling {self.filling!r}: lower filling, inclination or length"
            )
        if self.froude_number >= 1:
            fastest = self.rotation_rate / math.sqrt(self.froude_number)
            raise ValueError(
                f"Drum.rotation_rate: must be below {fastest:.4g} [1/s], where grains stick to the shell, "
                f"got {self.rotation_rate!r}"
            )

    @property
    def spin(self) -> float:
        """Angular velocity [rad/s]."""
        return 2 * math.pi * self.rotation_rate

    @property
    def froude_number(self) -> float:
        """Centripetal acceleration of the shell over gravity."""
        return self.spin**2 * self.diameter / 2 / (GRAVITY * math.cos(self.inclination))

    @property
    def gravity(self) -> tuple[float, float, float]:
        """Gravity in the frame of the drum [m/s2]."""
        return 0.0, -GRAVITY * math.sin(self.inclination), -GRAVITY * math.cos(self.inclination)

    @property
    def view(self) -> DrumView:
        return DrumView(self.diameter / 2, self.length, self.picture, self.camera_distance)

    @property
    def brim(self) -> float:
        return level_of(self.filling, self.diameter / 2)

    @property
    def is_hatched(self) -> bool:
        """True if the bed is inclined or above the axis: grains fall from a hatch until it has its volume."""
        return self.inclination > 0.0 or self.filling > OPEN_FILLED

    @property
    def hatch(self) -> float:
        """Height of the hatch [m]."""
        return (1 + HATCH) * self.diameter / 2

    @property
    def highest(self) -> float:
        """Height of a level bed at the lower end [m]."""
        return self.brim + self.length / 2 * math.tan(self.inclination)

    def volume_below(self, height: float) -> float:
        radius = self.diameter / 2
        angle = 2 * math.acos(float(np.clip(1 - height / radius, -1.0, 1.0)))
        return radius**2 / 2 * (angle - math.sin(angle)) * self.length

    def release(self, reach: float) -> float:
        """Return a height above the bed where the drum is wide [m]."""
        return self.hatch if self.is_hatched else max(self.brim + reach, self.diameter / 2)

    def cross_section(self, reach: float) -> CrossSection:
        above_axis = self.release(reach) - self.diameter / 2 + reach
        half_width = math.sqrt(max((self.diameter / 2) ** 2 - above_axis**2, 0.0))
        return CrossSection((half_width, self.length / 2))

    def walls(self, reach: float) -> tuple[Wall, ...]:
        radius, half, axis = self.diameter / 2, self.length / 2, (0.0, 1.0, 0.0)
        return (
            Cylinder((0.0, -half, radius), radius, self.length, axis),
            Disc((0.0, -half, radius), axis, radius),
            Disc((0.0, half, radius), axis, radius),
        )

    def room(self, reach: float) -> tuple[float, float, float]:
        return self.diameter / 2 + 2 * reach, self.length / 2 + 2 * reach, -2 * reach

    @property
    def fall_height(self) -> float:
        return self.diameter

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> "DrumController":
        return DrumController(case, setup, chunk)


@dataclass
class DrumState(SceneState):
    """State of a drum."""

    angles: list[list[float]] = field(default_factory=list)
    """`SurfaceAngles` of every look where all of them could be measured."""
    heights: list[list[float]] = field(default_factory=list)
    """Heights of the surface at `STATIONS` of every look where they could be measured [m]."""


class DrumController(PouredController[DrumState]):
    """Controller of a drum: fill, settle, start up, turn."""

    def __init__(self, case: Case[Drum], setup: WorldSetup, chunk: int) -> None:
        super().__init__(case, setup, chunk, DrumState("fill"))
        self.scene = scene = case.scene
        self.phases["start up"] = Phase(self._start_up, scene.start_up / scene.rotation_rate)
        self.phases["turn"] = Phase(self._turn, scene.revolutions / scene.rotation_rate)

    def is_full(self, view: WorldView) -> bool:
        """Return True if the landed grains fill their part of the drum; a counted fill is never full."""
        if not self.scene.is_hatched:
            return super().is_full(view)
        if self.poured.is_counted:
            return False
        landed = view.alive & view.released & ~self._flying(view)
        return self._volume(view, landed) >= self.scene.volume

    def surplus(self, view: WorldView) -> np.ndarray:
        """Mark the grains above the brim; with a hatch, those still falling when the drum is full."""
        if not self.scene.is_hatched:
            return super().surplus(view)
        raining = view.alive & (self.state.phase == "fill")
        return raining & self._flying(view)

    def level(self, view: WorldView, kept: np.ndarray) -> float:
        """Return the height of the bed's surface; with a hatch, of a level bed of the same volume [m]."""
        if not self.scene.is_hatched:
            return super().level(view, kept)
        filling = self._volume(view, kept) / self.scene.volume_below(self.scene.diameter)
        return level_of(filling, self.scene.diameter / 2)

    def _volume(self, view: WorldView, bed: np.ndarray) -> float:
        """Return the volume of the drum below the surface of some grains [m3]."""
        scene = self.scene
        return bed_volume(self._from_axis(view, bed), scene.diameter / 2, scene.length, self.grain_reach)

    def _flying(self, view: WorldView) -> np.ndarray:
        return np.linalg.norm(view.velocities, axis=1) > FLYING * self.scene.rain_speed

    def _from_axis(self, view: WorldView, which: np.ndarray) -> np.ndarray:
        return view.positions[which] - np.array([0.0, 0.0, self.scene.diameter / 2])

    def begin(self, view: WorldView, kept: np.ndarray) -> Mapping[int, Motion]:
        """Turn the drum; its lowest line moves towards -x."""
        self.state.enter("start up", view)
        return dict.fromkeys((SHELL, *ENDS), Motion(spin=(0.0, self.scene.spin, 0.0)))

    def _start_up(self, view: WorldView) -> Decision:
        if view.time - self.state.phase_start >= self.phases["start up"].expected:
            self.state.enter("turn", view)
        return Decision()

    def _turn(self, view: WorldView) -> Decision:
        chord = half_chord(self.state.observables["fill_height"], self.scene.diameter / 2)
        from_axis = self._from_axis(view, view.alive)
        angles = surface_angles(from_axis, chord, self.grain_reach, self.scene.view)
        if angles is not None:
            self.state.angles.append(list(angles))
        heights = surface_heights(from_axis, chord, self.grain_reach, self.scene.view)
        if heights is not None:
            self.state.heights.append(heights.tolist())
        if view.time - self.state.phase_start < self.phases["turn"].expected:
            return Decision()
        return Decision(done=True, failure=self._finish(view))

    def _finish(self, view: WorldView) -> str:
        seen = self.state.observables
        seen["grains_lost"] = seen["grain_count"] - float(np.count_nonzero(view.alive))
        seen["simulated_time"] = view.time
        self.state.enter("end", view)
        if not self.state.angles:
            return "the surface of the bed was never wide enough to fit a line to each half"
        means = np.mean(self.state.angles, axis=0)
        seen |= {name: float(mean) for name, mean in zip(SurfaceAngles._fields, means, strict=True)}
        seen["dynamic_angle_sd"] = float(np.std([angles[0] for angles in self.state.angles]))
        for place, name in enumerate(SurfaceAngles._fields):
            mean = mean_over_time([angles[place] for angles in self.state.angles])
            known = {f"{name}_se": mean.standard_error, f"{name}_freedom": mean.freedom} if mean else {}
            seen |= {key: value for key, value in known.items() if key in self.scene.observables}
        surface = np.mean(self.state.heights, axis=0)
        seen |= {f"surface_{number}": float(height) for number, height in enumerate(surface, 1)}
        return ""
