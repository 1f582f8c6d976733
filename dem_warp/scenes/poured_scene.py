"""Base of scenes that begin with a rain into a container: its settings and the world before it."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.entries import max_partners
from dem_warp.materials import WallPart
from dem_warp.model import GRAVITY, ContactCoefficients, Grains, WorldSetup
from dem_warp.parameters import Parameter, check_parameters
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
"""Observables of every poured scene."""


@dataclass(frozen=True, kw_only=True)
class PouredScene(ABC):
    """A container that a rain of grains fills; every kind has a `wall_material` beside."""

    rain_rate: Annotated[float, Parameter("1/s", above=0.0)] = 3000.0
    """Grains per second while filling."""
    rain_speed: Annotated[float, Parameter("m/s", above=0.0)] = 0.5
    """Speed of the raining grains."""
    grain_count: Annotated[int | None, Parameter("1", at_least=1)] = None
    """Grains to pour; left out: until four lie above the brim, and what stands above it is removed."""
    rest_speed: Annotated[float, Parameter("m/s", above=0.0)] = 1.0e-3
    """The grains rest when their root mean square speed is below this, and none passes ten times it ..."""
    rest_time: Annotated[float, Parameter("s", above=0.0)] = 0.05
    """... for this long."""
    air_drag: Annotated[float, Parameter("1/s", at_least=0.0)] = 0.0
    """Part of its velocity that still air takes from a free grain in a second, whatever its size."""

    name: ClassVar[str]
    """Name in study files."""
    leaves_a_heap: ClassVar[bool] = False
    """The test ends in a heap, whose repose angle can be measured."""
    observables: ClassVar[Mapping[str, Observable]] = FILL_OBSERVABLES
    densest_fill: ClassVar[float] = 0.64
    """Solid fraction that no poured bed is expected to pass: how many grains are kept ready."""
    part_names: ClassVar[tuple[tuple[str, ...], ...]] = ()
    """Names that each wall answers to where it may be of another material than the rest, from the general to
    the special; empty: all walls are alike."""
    weighed: ClassVar[int | None] = None
    """Number of the wall whose impulse is summed up."""

    def __post_init__(self) -> None:
        check_parameters(self)

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
        """Opening that grains of a bounding radius [m] may rain through."""

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

    def check_parts(self, names: Sequence[str]) -> None:
        """Check names of parts of the walls.

        Raises
        ------
        ValueError
            When the scene has no such part.
        """
        known = list(dict.fromkeys(name for wall in self.part_names for name in wall))
        for name in names:
            if name not in known:
                rule = f"the walls have the parts {', '.join(known) or 'none'}"
                raise ValueError(f"{type(self).__name__}: {rule}, got {name!r}")

    def surfaces(self, case: Case[Any], wall_count: int) -> tuple[tuple[ContactCoefficients, ...], list[int]]:
        """Contacts of a case, and which of them holds for each wall, those of another material included."""
        contacts = self.contacts(case)
        place = {part: len(contacts) + number for number, part in enumerate(case.wall_parts)}
        parts = [self.part_of(case, wall) for wall in range(wall_count)]
        holds = [self.contact_of(wall) if part is None else place[part] for wall, part in enumerate(parts)]
        return (*contacts, *map(case.contact_with, case.wall_parts)), holds

    def part_of(self, case: Case[Any], wall: int) -> WallPart | None:
        """Part of another material that a wall belongs to, by its most special name; None of the rest."""
        parts = {part.name: part for part in case.wall_parts}
        names = self.part_names[wall] if parts and self.part_names else ()
        return next((parts[name] for name in reversed(names) if name in parts), None)

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

    @property
    def opening(self) -> float:
        """Width of what grains run out through [m]; infinite where it is the whole container."""
        return np.inf

    # ---- the world before the first step -------------------------------------------------------------------

    def supply(self, case: Case[Any]) -> int:
        """Grains kept ready.

        Raises
        ------
        ValueError
            If they are more than a world can have.
        """
        mean_volume = case.grains.mean(lambda shape: shape.volume)
        count = self.grain_count or np.ceil(self.densest_fill * self.volume / mean_volume)
        most = max_partners(case.grains.sphere_count) // case.grains.sphere_count
        if not count <= most:
            raise ValueError(
                f"{type(self).__name__}: must hold at most {most:,} grains of {case.grains.sphere_count} "
                f"spheres, got {count:.4g}: lower grain_count, or make the container smaller"
            )
        return int(count)

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
    """Skin that keeps both the lists short and the rebuilds rare [m]; longer steps want a larger one.

    Two grains may each use up half of it within the shortest cycle, two steps. So it holds four steps of the
    fastest grain, and an eighth more, up to three radii.
    """
    radius = case.grains.mean(lambda shape: float(shape.radii.mean())) * case.grains.size_mean
    path = case.scene.top_speed * case.time_step
    return float(np.clip(24.0 * path, 0.7 * radius, np.clip(4.5 * path, radius, 3.0 * radius)))
