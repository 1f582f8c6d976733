"""Base of scenes that begin with a rain into a container: its settings and the initial world."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.entries import max_partners
from dem_warp.materials import WallPart
from dem_warp.model import GRAVITY, ContactCoefficients, Grains, WorldSetup
from dem_warp.parameters import Parameter, check_parameters, require_choice
from dem_warp.scenes.rain import CrossSection, Rain, place_rain
from dem_warp.scenes.scene import Controller, Observable
from dem_warp.walls import Wall

FREEBOARD = 1.2
"""Largest fall of a grain over the height from the brim to the lowest wall."""

FILL_OBSERVABLES = {
    "grain_count": Observable("1", "grains in the container after it was filled and levelled off"),
    "fill_height": Observable("m", "mean height of the bed's surface above the container's floor"),
    "solid_fraction": Observable("1", "volume of the grains over that of the container up to the surface"),
    "simulated_time": Observable("s", "time from the first grain of the rain to the end"),
}
"""Observables of every poured scene."""


class TooManyGrainsError(ValueError):
    """A scene needs more grains than a world can have."""

    def __init__(self, scene: str, rule: str, count: float) -> None:
        super().__init__(f"{scene}.grain_count: {rule}, got {count:.4g}")
        self.rule, self.count = rule, count


@dataclass(frozen=True, kw_only=True)
class PouredScene(ABC):
    """A container filled by a rain of grains; every subclass also has a `wall_material`."""

    rain_rate: Annotated[float, Parameter("1/s", above=0.0)] = 3000.0
    """Grains per second while filling."""
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

    name: ClassVar[str]
    """Name in study files."""
    leaves_a_heap: ClassVar[bool] = False
    """True if the test ends in a heap with a repose angle."""
    observables: ClassVar[Mapping[str, Observable]] = FILL_OBSERVABLES
    densest_fill: ClassVar[float] = 0.64
    """Largest expected solid fraction of the poured bed, for the number of grains."""
    part_names: ClassVar[tuple[tuple[str, ...], ...]] = ()
    """Part names of each wall that may have its own material, from general to special; empty: no parts."""
    weighed: ClassVar[int | None] = None
    """Number of the wall whose impulse is summed up."""

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

    @abstractmethod
    def walls(self, reach: float) -> tuple[Wall, ...]:
        """Return all walls, for grains of a bounding radius [m]."""

    @abstractmethod
    def room(self, reach: float) -> tuple[float, float, float]:
        """Return half sides along x and y, and lowest height, of the space for grains [m]."""

    @abstractmethod
    def controller(self, case: Any, setup: WorldSetup, chunk: int) -> Controller[Any]:
        """Return the controller of one case."""

    @property
    def gravity(self) -> tuple[float, float, float]:
        """Gravity [m/s2]."""
        return 0.0, 0.0, -GRAVITY

    def contacts(self, case: Case[Any]) -> tuple[ContactCoefficients, ...]:
        """Return the contacts of grains with grains, and with each kind of wall."""
        return case.contacts(case.scene.wall_material)

    def contact_of(self, wall: int) -> int:
        """Return the index of the contact of a wall."""
        return 1

    def check_parts(self, names: Sequence[str]) -> None:
        """Raise ValueError for a name that is no part of the walls."""
        known = tuple(dict.fromkeys(name for wall in self.part_names for name in wall))
        for name in names:
            require_choice(f"{type(self).__name__}: part of the walls", name, known)

    def surfaces(self, case: Case[Any], wall_count: int) -> tuple[tuple[ContactCoefficients, ...], list[int]]:
        """Return the contacts of a case, with those of wall parts, and the contact index of each wall."""
        contacts = self.contacts(case)
        place = {part: len(contacts) + number for number, part in enumerate(case.wall_parts)}
        parts = [self.part_of(case, wall) for wall in range(wall_count)]
        holds = [self.contact_of(wall) if part is None else place[part] for wall, part in enumerate(parts)]
        return (*contacts, *map(case.contact_with, case.wall_parts)), holds

    def part_of(self, case: Case[Any], wall: int) -> WallPart | None:
        """Return the part with its own material that a wall belongs to, by its most special name, or None."""
        parts = {part.name: part for part in case.wall_parts}
        names = self.part_names[wall] if parts and self.part_names else ()
        return next((parts[name] for name in reversed(names) if name in parts), None)

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

    def supply(self, case: Case[Any]) -> int:
        """Return the number of grains of the rain; raise TooManyGrainsError above the limit."""
        mean_volume = case.grains.mean(lambda shape: shape.volume)
        count = self.grain_count or np.ceil(self.densest_fill * self.volume / mean_volume)
        most = max_partners(case.grains.sphere_count) // case.grains.sphere_count
        if not count <= most:
            rule = f"must be at most {most:,} grains of {case.grains.sphere_count} spheres"
            raise TooManyGrainsError(type(self).__name__, rule, float(count))
        return int(count)

    def prepare(self, cases: Sequence[Case[Any]], device: Any) -> list[WorldSetup]:
        """Return the initial worlds of cases of this kind of scene; sizes, grains and counts may differ."""
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
    walls = scene.walls(reach)
    contacts, holds = scene.surfaces(case, len(walls))
    return WorldSetup(
        grains=grains,
        shapes=rain.grains.clumps,
        contacts=contacts,
        walls=tuple(zip(walls, holds, strict=True)),
        time_step=case.time_step,
        skin=case.numerics.skin or default_skin(case),
        speed_limit=20 * scene.top_speed,
        domain=(
            (-half_x, -half_y, bottom),
            (half_x, half_y, float(grains.positions[:, 2].max()) + 2 * reach),
        ),
        gravity=scene.gravity,
        air_drag=scene.air_drag,
        rolling_holds=case.laws.rolling != "own_spin_whole_step",
        forms=case.laws.forms,
        weighed=scene.weighed,
    )


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


def default_skin(case: Case[Any]) -> float:
    """Return a skin that keeps the lists short and the rebuilds rare [m]; it grows with the time step.

    Two grains may each use up half of it within the shortest cycle, two steps. So it holds four steps of the
    fastest grain, and an eighth more, up to three radii.
    """
    radius = case.grains.mean(lambda shape: float(shape.radii.mean())) * case.grains.size_mean
    path = case.scene.top_speed * case.time_step
    return float(np.clip(24.0 * path, 0.7 * radius, np.clip(4.5 * path, radius, 3.0 * radius)))
