"""Base of scenes with walls: what studies, exporters and worlds know of every scene."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.clumps import ClumpShape
from dem_warp.entries import max_partners
from dem_warp.materials import Material, WallPart
from dem_warp.model import GRAVITY, ContactCoefficients, Grains, WorldSetup
from dem_warp.parameters import require_choice
from dem_warp.population import GrainPopulation
from dem_warp.scenes.scene import Controller, Observable
from dem_warp.walls import Wall


class TooManyGrainsError(ValueError):
    """A scene needs more grains than a world can have."""

    def __init__(self, scene: str, rule: str, count: float) -> None:
        super().__init__(f"{scene}.grain_count: {rule}, got {count:.4g}")
        self.rule, self.count = rule, count


class WalledScene(ABC):
    """Grains between walls; every subclass is a frozen dataclass with a `wall_material`."""

    name: ClassVar[str]
    """Name in study files."""
    leaves_a_heap: ClassVar[bool] = False
    """True if the test ends in a heap with a repose angle."""
    observables: ClassVar[Mapping[str, Observable]]
    """Everything that the scene may measure, by name."""
    part_names: ClassVar[tuple[tuple[str, ...], ...]] = ()
    """Part names of each wall that may have its own material, from general to special; empty: no parts."""
    weighed: ClassVar[tuple[int, ...]] = ()
    """Numbers of the walls whose impulses are summed up."""
    free_wall: ClassVar[int | None] = None
    """Number of the wall that a force may move, if there is one."""

    @property
    @abstractmethod
    def air_drag(self) -> float:
        """Rate at which still air slows a free grain of any size [1/s]."""

    @property
    @abstractmethod
    def top_speed(self) -> float:
        """Largest ordinary speed of a grain [m/s]."""

    @abstractmethod
    def supply(self, case: Case[Any]) -> int:
        """Return the number of grains of a world; raise TooManyGrainsError above the limit."""

    @abstractmethod
    def walls(self, reach: float) -> tuple[Wall, ...]:
        """Return all walls, for grains of a bounding radius [m]."""

    @abstractmethod
    def room(self, reach: float) -> tuple[float, float, float]:
        """Return half sides along x and y, and lowest height, of the space for grains [m]."""

    @abstractmethod
    def prepare(self, cases: Sequence[Case[Any]], device: Any) -> list[WorldSetup]:
        """Return the initial worlds of cases of this kind of scene; sizes, grains and counts may differ."""

    @abstractmethod
    def controller(self, case: Any, setup: WorldSetup, chunk: int) -> Controller[Any]:
        """Return the controller of one case."""

    def doubts(self, grains: GrainPopulation, material: Material) -> tuple[str, ...]:
        """Describe what is unlikely with grains of a simulated material; ValueError for the impossible."""
        return ()

    @property
    def period(self) -> float | None:
        """Length after which the world repeats itself along x and y [m]; None if it does not."""
        return None

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

    def within_limit(self, case: Case[Any], count: float) -> int:
        """Return a number of grains; raise TooManyGrainsError above the limit."""
        most = max_partners(case.grains.sphere_count) // case.grains.sphere_count
        if not count <= most:
            rule = f"must be at most {most:,} grains of {case.grains.sphere_count} spheres"
            raise TooManyGrainsError(type(self).__name__, rule, float(count))
        return int(count)

    def ceiling(self, grains: Grains, reach: float) -> float:
        """Return the highest point of the space for grains [m]."""
        return float(grains.positions[:, 2].max()) + 2 * reach


def world_of(case: Case[Any], grains: Grains, shapes: tuple[ClumpShape, ...], reach: float) -> WorldSetup:
    """Return the initial world of a case with grains of a bounding radius [m]."""
    scene = case.scene
    half_x, half_y, bottom = scene.room(reach)
    walls = scene.walls(reach)
    contacts, holds = scene.surfaces(case, len(walls))
    return WorldSetup(
        grains=grains,
        shapes=shapes,
        contacts=contacts,
        walls=tuple(zip(walls, holds, strict=True)),
        time_step=case.time_step,
        skin=case.numerics.skin or default_skin(case),
        speed_limit=20 * scene.top_speed,
        domain=((-half_x, -half_y, bottom), (half_x, half_y, scene.ceiling(grains, reach))),
        gravity=scene.gravity,
        air_drag=scene.air_drag,
        rolling_holds=case.laws.rolling != "own_spin_whole_step",
        forms=case.laws.forms,
        weighed=scene.weighed,
        free_wall=scene.free_wall,
        period=scene.period,
    )


def default_skin(case: Case[Any]) -> float:
    """Return a skin that keeps the lists short and the rebuilds rare [m]; it grows with the time step.

    Two grains may each use up half of it within the shortest cycle, two steps. So it holds four steps of the
    fastest grain, and an eighth more, up to three radii.
    """
    radius = case.grains.mean(lambda shape: float(shape.radii.mean())) * case.grains.size_mean
    path = case.scene.top_speed * case.time_step
    return float(np.clip(24.0 * path, 0.7 * radius, np.clip(4.5 * path, radius, 3.0 * radius)))
