"""What scenes share that begin with a rain into a container: its settings and the world before it."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.model import GRAVITY, ContactCoefficients, Grains, WorldSetup
from dem_warp.scenes.rain import CrossSection, Rain, place_rain
from dem_warp.scenes.scene import Controller, Observable
from dem_warp.walls import Wall

FREEBOARD = 1.2
"""Grains fall this many times the way from the brim to the lowest wall, at the most."""

FILL_OBSERVABLES = {
    "grain_count": Observable("1", "grains in the container when it has been filled and struck off"),
    "fill_height": Observable("m", "mean height of the bed's surface above the container's floor"),
    "solid_fraction": Observable("1", "volume of the grains over that of the container up to the surface"),
    "simulated_time": Observable("s", "from the first grain of the rain to the end"),
}
"""What every poured scene measures."""


@dataclass(frozen=True, kw_only=True)
class PouredScene(ABC):
    """A container that a rain of grains fills; every kind has a `wall_material` beside.

    Attributes
    ----------
    rain_rate, rain_speed : float
        Grains a second, and the speed at which they enter [m/s].
    grain_count : int, optional
        Grains to pour; by default until four lie above the brim, and what stands above it is removed.
    rest_speed, rest_time : float
        Grains rest when their root mean square speed has been below `rest_speed` [m/s], and none has passed
        ten times that, for `rest_time` [s].
    air_drag : float
        Of still air: a free grain slows down by this part of its velocity a second, whatever its size [1/s].
    """

    rain_rate: float = 3000.0
    rain_speed: float = 0.5
    grain_count: int | None = None
    rest_speed: float = 1.0e-3
    rest_time: float = 0.05
    air_drag: float = 0.0

    observables: ClassVar[Mapping[str, Observable]] = FILL_OBSERVABLES
    densest_fill: ClassVar[float] = 0.64
    """Solid fraction that no poured bed is expected to pass: how many grains are kept ready."""
    weighed: ClassVar[int | None] = None
    """Number of the wall whose impulse is summed up."""

    def __post_init__(self) -> None:
        self._require_positive("rain_rate", "rain_speed", "rest_speed", "rest_time")
        self._require_not_negative("air_drag")
        if self.grain_count is not None and self.grain_count < 1:
            raise ValueError(
                f"{type(self).__name__}.grain_count: must be at least 1, got {self.grain_count!r}"
            )

    def _require_positive(self, *names: str) -> None:
        for name in names:
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"{type(self).__name__}.{name}: must be positive and finite, got {value!r}")

    def _require_not_negative(self, *names: str) -> None:
        for name in names:
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise ValueError(f"{type(self).__name__}.{name}: must be finite and 0 or more, got {value!r}")

    # ---- what a scene says of its container ----------------------------------------------------------------

    @property
    @abstractmethod
    def floor(self) -> float:
        """Height of the container's lowest point [m]."""

    @property
    @abstractmethod
    def brim(self) -> float:
        """Height that it is filled to [m]."""

    @abstractmethod
    def volume_below(self, height: float) -> float:
        """Volume of the container up to a height [m3]."""

    @abstractmethod
    def cross_section(self, reach: float) -> CrossSection:
        """What grains of a bounding radius [m] may rain through."""

    @abstractmethod
    def walls(self, reach: float) -> tuple[Wall, ...]:
        """Its walls, and whatever else the test needs, for grains of a bounding radius [m]."""

    @abstractmethod
    def room(self, reach: float) -> tuple[float, float, float]:
        """Half sides along x and y, and lowest height, of the space that grains may be in [m]."""

    @abstractmethod
    def controller(self, case: Any, setup: WorldSetup, chunk: int) -> Controller[Any]:
        """Controller of one case."""

    @property
    def gravity(self) -> tuple[float, float, float]:
        """[m/s2]"""
        return 0.0, 0.0, -GRAVITY

    def contacts(self, case: Case[Any]) -> tuple[ContactCoefficients, ...]:
        """Contacts of grains with grains, and with each kind of wall."""
        return case.contacts(case.scene.wall_material)

    def contact_of(self, wall: int) -> int:
        """Which of the contacts holds for a wall, by its number."""
        return 1

    def release(self, reach: float) -> float:
        """Height from which grains fall freely [m]."""
        return self.brim + reach

    @property
    def volume(self) -> float:
        """Volume of the container up to its brim [m3]."""
        return self.volume_below(self.brim)

    @property
    def fall_height(self) -> float:
        """From the brim to the lowest wall [m]."""
        return self.brim

    @property
    def top_speed(self) -> float:
        """Speed of the fastest grain that an ordinary course of events brings [m/s]."""
        return float(np.sqrt(self.rain_speed**2 + 2 * GRAVITY * FREEBOARD * self.fall_height))

    # ---- the world before the first step -------------------------------------------------------------------

    def supply(self, case: Case[Any]) -> int:
        """Grains kept ready."""
        mean_volume = case.grains.mean(lambda shape: shape.volume)
        return self.grain_count or int(np.ceil(self.densest_fill * self.volume / mean_volume))

    def prepare(self, cases: Sequence[Case[Any]], device: Any) -> list[WorldSetup]:
        """Worlds of cases that share this kind of scene; sizes, grains and counts may differ."""
        scenes = [case.scene for case in cases]
        drawn = [case.grains.draw(case.scene.supply(case), case.seed) for case in cases]
        rains = place_rain(
            drawn,
            [case.seed for case in cases],
            [
                scene.cross_section(float(grains.bounding_radii.max()))
                for scene, grains in zip(scenes, drawn, strict=True)
            ],
            [scene.rain_speed / scene.rain_rate for scene in scenes],
            device,
        )
        return [_world(case, rain) for case, rain in zip(cases, rains, strict=True)]


def _world(case: Case[Any], rain: Rain) -> WorldSetup:
    scene = case.scene
    reach = rain.grains.bounding_radii.max()
    grains = _falling(case, rain, scene.release(reach), reach)
    half_x, half_y, bottom = scene.room(reach)
    return WorldSetup(
        grains=grains,
        shapes=rain.grains.clumps,
        contacts=scene.contacts(case),
        walls=tuple((wall, scene.contact_of(number)) for number, wall in enumerate(scene.walls(reach))),
        time_step=case.time_step,
        skin=case.numerics.skin or default_skin(case),
        speed_limit=20 * scene.top_speed,
        domain=(
            (-half_x, -half_y, bottom),
            (half_x, half_y, float(grains.positions[:, 2].max()) + 2 * reach),
        ),
        gravity=scene.gravity,
        air_drag=scene.air_drag,
        rolling_holds=case.numerics.rolling_holds,
        weighed=scene.weighed,
    )


def _falling(case: Case[Any], rain: Rain, release: float, reach: float) -> Grains:
    """Grains of a rain that comes down to the release plane at one speed [m]."""
    count, speed = rain.grains.count, case.scene.rain_speed
    positions = rain.positions + np.array([0.0, 0.0, release + reach])
    return Grains(
        positions=positions,
        orientations=rain.orientations,
        velocities=np.tile([0.0, 0.0, -speed], (count, 1)),
        spins=np.zeros((count, 3)),
        sizes=rain.grains.sizes,
        densities=np.full(count, case.grain_material.density),
        shapes=rain.grains.shapes,
        release_steps=np.ceil((positions[:, 2] - release) / (speed * case.time_step)).astype(int),
    )


def default_skin(case: Case[Any]) -> float:
    """Skin that keeps both the lists short and the rebuilds rare [m]; longer steps want a larger one."""
    radius = case.grains.mean(lambda shape: float(shape.radii.mean())) * case.grains.size_mean
    path = case.scene.top_speed * case.time_step
    return float(np.clip(24.0 * path, 0.7 * radius, radius))
