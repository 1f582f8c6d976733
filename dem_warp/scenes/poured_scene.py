"""Base of scenes that begin with a rain into a container: its settings and the initial world."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.model import GRAVITY, Grains, WorldSetup
from dem_warp.parameters import Parameter, check_parameters
from dem_warp.scenes.rain import CrossSection, Rain, place_rain
from dem_warp.scenes.scene import Observable
from dem_warp.scenes.walled_scene import WalledScene, world_of

FREEBOARD = 1.2
"""Largest fall of a grain over the height from the brim to the lowest wall."""

RAIN_FRACTION = 0.1
"""Solid fraction of a rain that finds its own rate: each grain still finds a free place at random."""

FILL_OBSERVABLES = {
    "grain_count": Observable("1", "grains in the container after it was filled and levelled off"),
    "fill_height": Observable("m", "mean height of the bed's surface above the container's floor"),
    "solid_fraction": Observable("1", "volume of the grains over that of the container up to the surface"),
    "simulated_time": Observable("s", "time from the first grain of the rain to the end"),
}
"""Observables of every poured scene."""


@dataclass(frozen=True, kw_only=True)
class PouredScene(WalledScene):
    """A container filled by a rain of grains."""

    rain_rate: Annotated[float | None, Parameter("1/s", above=0.0)] = None
    """Grains per second while filling. Default: as many as find places in the cross-section, 10 % of
    the rain's volume at `rain_speed`."""
    rain_speed: Annotated[float, Parameter("m/s", above=0.0)] = 0.5
    """Speed of the raining grains."""
    grain_count: Annotated[int | None, Parameter("1", at_least=1)] = None
    """Number of grains to pour. Default: until four lie above the brim; all above it are then removed."""
    rest_speed: Annotated[float, Parameter("m/s", above=0.0)] = 1.0e-3
    """Largest root mean square speed of resting grains; the fastest may have ten times this speed."""
    rest_time: Annotated[float, Parameter("s", above=0.0)] = 0.05
    """Time that the grains must stay below `rest_speed` to be at rest."""
    air_drag: Annotated[float, Parameter("1/s", at_least=0.0)] = 0.0
    """Rate at which still air slows a free grain of any size."""

    observables: ClassVar[Mapping[str, Observable]] = FILL_OBSERVABLES
    densest_fill: ClassVar[float] = 0.64
    """Largest expected solid fraction of the poured bed, for the number of grains."""

    def __post_init__(self) -> None:
        check_parameters(self)

    @property
    @abstractmethod
    def floor(self) -> float:
        """Height of the container's lowest point [m]."""

    @property
    @abstractmethod
    def brim(self) -> float:
        """Height of the filling [m]."""

    @abstractmethod
    def volume_below(self, height: float) -> float:
        """Return the volume of the container up to a height [m3]."""

    @abstractmethod
    def cross_section(self, reach: float) -> CrossSection:
        """Return the opening for a rain of grains of a bounding radius [m]."""

    def release(self, reach: float) -> float:
        """Return the height from which grains fall freely [m]."""
        return self.brim + reach

    @property
    def volume(self) -> float:
        """Volume of the container up to its brim [m3]."""
        return self.volume_below(self.brim)

    @property
    def fall_height(self) -> float:
        """Height from the brim to the lowest wall [m]."""
        return self.brim

    @property
    def top_speed(self) -> float:
        """Largest ordinary speed of a grain [m/s]."""
        return float(np.sqrt(self.rain_speed**2 + 2 * GRAVITY * FREEBOARD * self.fall_height))

    @property
    def opening(self) -> float:
        """Width of the outlet [m]; infinite for the whole container."""
        return np.inf

    @property
    def is_counted(self) -> bool:
        """True if a number of grains is poured, which is never full."""
        return self.grain_count is not None

    def ordered(self, case: Case[Any]) -> int | None:
        """Return the number of grains to pour, or None for as many as fill the container."""
        return self.grain_count

    def grains_per_second(self, case: Case[Any]) -> float:
        """Return the rate of the rain [1/s]."""
        if self.rain_rate is not None:
            return self.rain_rate
        size = case.grains.size_mean
        reach, mean_volume = size * case.grains.grain_reach, size**3 * case.grains.mean(lambda s: s.volume)
        area = self.cross_section(reach).open_area(reach)
        return RAIN_FRACTION * self.rain_speed * area / mean_volume

    def supply(self, case: Case[Any]) -> int:
        """Return the number of grains of the rain; raise TooManyGrainsError above the limit."""
        mean_volume = case.grains.mean(lambda shape: shape.volume)
        count = self.ordered(case) or np.ceil(self.densest_fill * self.volume / mean_volume)
        return self.within_limit(case, float(count))

    def prepare(self, cases: Sequence[Case[Any]], device: Any) -> list[WorldSetup]:
        scenes = [case.scene for case in cases]
        drawn = [case.grains.draw(case.scene.supply(case), case.seed) for case in cases]
        rains = place_rain(
            drawn,
            [case.seed for case in cases],
            [
                scene.cross_section(float(grains.bounding_radii.max()))
                for scene, grains in zip(scenes, drawn, strict=True)
            ],
            [case.scene.rain_speed / case.scene.grains_per_second(case) for case in cases],
            device,
        )
        return [_world(case, rain) for case, rain in zip(cases, rains, strict=True)]


def _world(case: Case[Any], rain: Rain) -> WorldSetup:
    reach = rain.grains.bounding_radii.max()
    return world_of(case, _falling(case, rain, case.scene.release(reach), reach), rain.grains.clumps, reach)


def _falling(case: Case[Any], rain: Rain, release: float, reach: float) -> Grains:
    """Return the grains of a rain that falls to the release plane [m] at one speed."""
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
