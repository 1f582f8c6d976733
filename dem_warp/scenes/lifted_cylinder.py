"""The lifted-cylinder test: fill an open tube on a plate, strike it off, lift it, wait for the heap."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dem_warp.case import Case
from dem_warp.materials import Material
from dem_warp.model import Grains, WorldSetup
from dem_warp.scenes.rain import Rain, place_rain
from dem_warp.scenes.scene import Course, Decision
from dem_warp.solver import WorldView
from dem_warp.walls import Cylinder, Disc, Motion, Plane

PLATE, TUBE = 0, 1
GRAVITY = 9.81
DENSEST_FILL = 0.58
"""Solid fraction that no poured bed of the grains is expected to pass: how many grains are kept ready."""

HEAPED = 4
"""Slow grains above the rim that show the tube to be full."""

GONE = 1.5
"""Grains that have risen with the tube by this many times its height leave with it."""

CLOGGED = 0.02
"""Part of the grains from which on a tube that takes them along is clogged: no heap."""

CALM = 10.0
"""A heap rests when its root mean square speed is below `rest_speed` and no grain passes CALM times that."""


@dataclass(frozen=True)
class LiftedCylinder:
    """An open tube is filled by a rain of grains and lifted at constant speed.

    Attributes
    ----------
    diameter, height : float
        Inner diameter and height of the tube [m].
    wall_material : Material
        Of the tube and the plate.
    lift_speed : float
        [m/s]
    rain_rate, rain_speed : float
        Grains a second, and the speed at which they enter [m/s].
    grain_count : int, optional
        Grains to pour; by default as many as fill the tube, what stands above the rim being removed.
    rest_speed, rest_time : float
        The heap rests when it has been slower than this (CALM) for this long [m/s], [s].
    duration : float, optional
        Ends the case at a fixed simulated time [s] instead of at rest.
    plate_diameter : float, optional
        Of a round plate, over whose rim grains fall and are lost [m]; by default the plate has no end.
    """

    diameter: float
    height: float
    wall_material: Material
    lift_speed: float = 0.05
    rain_rate: float = 3000.0
    rain_speed: float = 0.5
    grain_count: int | None = None
    rest_speed: float = 1.0e-3
    rest_time: float = 0.05
    duration: float | None = None
    plate_diameter: float | None = None

    def __post_init__(self) -> None:
        for name in (
            "diameter",
            "height",
            "lift_speed",
            "rain_rate",
            "rain_speed",
            "rest_speed",
            "rest_time",
        ):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"LiftedCylinder.{name}: must be positive and finite, got {value!r}")
        if self.grain_count is not None and self.grain_count < 1:
            raise ValueError(f"LiftedCylinder.grain_count: must be at least 1, got {self.grain_count!r}")
        if self.duration is not None and self.duration <= 0:
            raise ValueError(f"LiftedCylinder.duration: must be positive [s], got {self.duration!r}")
        if self.plate_diameter is not None and not self.diameter < self.plate_diameter < np.inf:
            raise ValueError(
                f"LiftedCylinder.plate_diameter: must be finite and above the tube's {self.diameter!r} [m], "
                f"got {self.plate_diameter!r}"
            )

    @property
    def plate(self) -> Plane | Disc:
        """What the tube stands on, at z = 0."""
        if self.plate_diameter is None:
            return Plane()
        return Disc((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), self.plate_diameter / 2)

    @property
    def volume(self) -> float:
        """Inside the tube [m3]."""
        return np.pi / 4 * self.diameter**2 * self.height

    @property
    def fall_speed(self) -> float:
        """Speed of a grain that falls from the release plane to the plate [m/s]."""
        return float(np.sqrt(self.rain_speed**2 + 2 * GRAVITY * 1.2 * self.height))

    def supply(self, case: "LiftCase") -> int:
        """Grains kept ready."""
        mean_volume = case.grains.mean(lambda shape: shape.volume)
        return self.grain_count or int(np.ceil(DENSEST_FILL * self.volume / mean_volume))

    def prepare(self, cases: "Sequence[LiftCase]", device: Any) -> list[WorldSetup]:
        """Worlds of cases that share this kind of scene; tubes, grains and counts may differ."""
        scenes = [case.scene for case in cases]
        rains = place_rain(
            [case.grains.draw(case.scene.supply(case), case.seed) for case in cases],
            [case.seed for case in cases],
            [scene.diameter / 2 for scene in scenes],
            [scene.rain_speed / scene.rain_rate for scene in scenes],
            device,
        )
        return [_world(case, rain) for case, rain in zip(cases, rains, strict=True)]

    def controller(self, case: "LiftCase", setup: WorldSetup, chunk: int) -> "LiftController":
        """Controller of one case."""
        return LiftController(case, setup, chunk)


LiftCase = Case[LiftedCylinder]


def _world(case: LiftCase, rain: Rain) -> WorldSetup:
    scene, grain = case.scene, case.grain_material
    count = rain.grains.count
    reach = rain.grains.bounding_radii.max()
    release = scene.height + reach
    positions = rain.positions + np.array([0.0, 0.0, release + reach])
    velocities = np.tile([0.0, 0.0, -scene.rain_speed], (count, 1))
    grains = Grains(
        positions=positions,
        orientations=rain.orientations,
        velocities=velocities,
        spins=np.zeros((count, 3)),
        sizes=rain.grains.sizes,
        densities=np.full(count, grain.density),
        shapes=rain.grains.shapes,
        release_steps=np.ceil((positions[:, 2] - release) / (scene.rain_speed * case.time_step)).astype(int),
    )
    half_width = 4.0 * scene.diameter + 2.0 * scene.height
    tube = Cylinder((0.0, 0.0, 0.0), scene.diameter / 2, scene.height)
    return WorldSetup(
        grains=grains,
        shapes=rain.grains.clumps,
        contacts=case.contacts(scene.wall_material),
        walls=((scene.plate, 1), (tube, 1)),
        time_step=case.time_step,
        skin=case.numerics.skin or default_skin(case),
        speed_limit=20 * scene.fall_speed,
        domain=(
            (-half_width, -half_width, -2 * reach),
            (half_width, half_width, float(positions[:, 2].max()) + 2 * reach),
        ),
        gravity=(0.0, 0.0, -GRAVITY),
    )


def default_skin(case: LiftCase) -> float:
    """Skin that keeps both the lists short and the rebuilds rare [m]; longer steps want a larger one."""
    radius = case.grains.mean(lambda shape: float(shape.radii.mean())) * case.grains.size_mean
    path = case.scene.fall_speed * case.time_step
    return float(np.clip(24.0 * path, 0.5 * radius, radius))


class LiftController:
    """Phases of one lifted cylinder: fill, settle, lift.

    It looks at its world every `period` steps, which follows from the world's time step alone.
    """

    LOOK = 4.0e-3
    """Time between two looks [s]; rounded up to a power of two of chunks."""

    FILL_MARGIN, SETTLE_LIMIT, LIFT_MARGIN = 2.0, 3.0, 6.0
    """Time [s] allowed beyond the rain, for the settling, and beyond the tube's own height."""

    def __init__(self, case: LiftCase, setup: WorldSetup, chunk: int) -> None:
        self.case, self.scene, self.setup = case, case.scene, setup
        self.period = chunk * 2 ** max(int(np.ceil(np.log2(self.LOOK / (chunk * setup.time_step)))), 0)
        self.course = Course("fill")

    def fraction(self, time: float) -> float:
        """Roughly how much of the case is done at a simulated time [s], 0 to 1."""
        rain = float(self.setup.grains.release_steps.max()) * self.setup.time_step
        lift = 0.5 * self.scene.diameter / self.scene.lift_speed
        expected = {"fill": (0.0, rain + 0.1), "settle": (rain + 0.1, 0.2), "lift": (rain + 0.3, lift + 0.3)}
        before, length = expected[self.course.phase]
        part = min((time - self.course.phase_start) / length, 1.0)
        return (before + part * length) / (rain + lift + 0.6)

    def look(self, view: WorldView) -> Decision:
        """Decide what happens next from the present state."""
        return {"fill": self._fill, "settle": self._settle, "lift": self._lift}[self.course.phase](view)

    def _rests(self, view: WorldView) -> bool:
        """Whether the grains have been slow for `rest_time`."""
        speed = np.linalg.norm(view.velocities[view.alive], axis=1)
        slow = not speed.size or (
            np.sqrt(np.mean(speed**2)) < self.scene.rest_speed and speed.max() < CALM * self.scene.rest_speed
        )
        if not slow:
            self.course.slow_since = None
            return False
        if self.course.slow_since is None:
            self.course.slow_since = view.time
        return view.time - self.course.slow_since >= self.scene.rest_time

    def _fill(self, view: WorldView) -> Decision:
        free = view.alive & view.released
        above = view.positions[:, 2] > self.scene.height
        slow = np.linalg.norm(view.velocities, axis=1) < 0.5 * self.scene.rain_speed
        rained_out = bool(view.released[view.alive].all())
        full = self.scene.grain_count is None and np.count_nonzero(free & above & slow) >= HEAPED
        last = self.setup.grains.release_steps.max() * self.setup.time_step
        if view.time > last + self.FILL_MARGIN:
            return Decision(
                done=True, failure=f"the filling did not end within {self.FILL_MARGIN:g} s of the rain"
            )
        if not (full or (rained_out and self._rests(view))):
            return Decision()
        self.course.enter("settle", view)
        if self.scene.grain_count is not None:
            return Decision()
        return Decision(remove=np.flatnonzero(view.alive & (above | ~view.released)))

    def _settle(self, view: WorldView) -> Decision:
        if view.time - self.course.phase_start > self.SETTLE_LIMIT:
            return Decision(
                done=True, failure=f"the filled tube did not come to rest within {self.SETTLE_LIMIT:g} s"
            )
        if not self._rests(view):
            return Decision()
        above = view.alive & (view.positions[:, 2] > self.scene.height)
        if self.scene.grain_count is not None:
            above[:] = False
        self._measure_fill(view, view.alive & ~above)
        self.course.enter("lift", view)
        lift = Motion(velocity=(0.0, 0.0, self.scene.lift_speed))
        return Decision(remove=np.flatnonzero(above), move=(TUBE, lift))

    def _measure_fill(self, view: WorldView, kept: np.ndarray) -> None:
        positions = view.positions[kept]
        volume = float(
            (self.setup.masses[: len(kept)] / self.setup.grains.densities)[
                kept[: self.setup.grains.count]
            ].sum()
        )
        level = bed_level(positions, self.scene.diameter / 2, self.case.grains.grain_reach)
        self.course.observables["grain_count"] = float(np.count_nonzero(kept))
        self.course.observables["fill_height"] = level
        self.course.observables["solid_fraction"] = volume / (np.pi / 4 * self.scene.diameter**2 * level)

    def _lift(self, view: WorldView) -> Decision:
        elapsed = view.time - self.course.phase_start
        rise = self.scene.lift_speed * elapsed
        positions = view.positions[view.alive]
        reach = self.setup.bounding_radii.max()
        top = positions[:, 2].max() + reach if len(positions) else 0.0
        if self.scene.duration is not None and view.time < self.scene.duration:
            return Decision()
        over = self.scene.duration is not None or (rise > top and self._rests(view))
        if over:
            self._finish(view, elapsed)
            return Decision(done=True)
        riding = view.alive & (view.positions[:, 2] > rise)
        if rise > GONE * self.scene.height and riding.any():
            count = np.count_nonzero(riding)
            if count > CLOGGED * self.course.observables["grain_count"]:
                return Decision(done=True, failure=f"the tube is clogged: {count} grains rose with it")
            return Decision(remove=np.flatnonzero(riding))
        if elapsed > self.scene.height / self.scene.lift_speed + self.LIFT_MARGIN:
            return Decision(
                done=True, failure=f"the heap did not come to rest within {elapsed:.1f} s of the lift"
            )
        return Decision()

    def _finish(self, view: WorldView, elapsed: float) -> None:
        rested = (
            elapsed if self.course.slow_since is None else self.course.slow_since - self.course.phase_start
        )
        self.course.observables["time_to_rest"] = float(rested)
        self.course.observables["simulated_time"] = view.time
        self.course.observables["grains_lost"] = self.course.observables["grain_count"] - float(
            np.count_nonzero(view.alive)
        )
        self.course.enter("rest", view)


def bed_level(positions: np.ndarray, radius: float, reach: float) -> float:
    """Height of a bed's surface in a tube [m].

    It is the mean, over cells of a grain's size, of the highest centre, plus half a grain.

    Parameters
    ----------
    positions : (n, 3) array
        Grain centres [m].
    radius : float
        Of the tube [m].
    reach : float
        Bounding radius of a grain [m].
    """
    side = 2 * reach
    cells = np.floor((positions[:, :2] + radius) / side).astype(int)
    tops: dict[tuple[int, int], float] = {}
    for (i, j), z in zip(cells, positions[:, 2], strict=True):
        tops[i, j] = max(tops.get((i, j), 0.0), z)
    return float(np.mean(list(tops.values())) + 0.5 * reach) if tops else 0.0
