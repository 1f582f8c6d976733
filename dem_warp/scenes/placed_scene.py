"""Base of scenes that place grains: copies of a grain, tested at once, each by itself."""

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, TypeVar

import numpy as np

from dem_warp.case import Case
from dem_warp.clumps import stack_spheres
from dem_warp.model import AT_ONCE, Grains, WorldSetup
from dem_warp.parameters import Parameter, check_parameters
from dem_warp.population import DrawnGrains
from dem_warp.result import place_spheres
from dem_warp.scenes.phases import PhasedController
from dem_warp.scenes.rain import random_orientations
from dem_warp.scenes.scene import Decision, Observable, SceneState
from dem_warp.scenes.walled_scene import WalledScene, world_of
from dem_warp.view import WorldView
from dem_warp.walls import Vector


def of_copies(own: Mapping[str, Observable]) -> dict[str, Observable]:
    """Return a scene's own observables, each with its standard deviation, and those of all copies."""
    return {
        "grain_count": Observable("1", "copies of the grain that were measured"),
        "simulated_time": Observable("s", "time from the release of the copies to the end"),
        **own,
        **{
            f"{name}_sd": Observable(unit, f"standard deviation of {name} from copy to copy")
            for name, (unit, _) in own.items()
        },
    }


@dataclass(frozen=True, kw_only=True)
class PlacedScene(WalledScene):
    """Grains placed at rest, each in a random orientation."""

    grain_count: Annotated[int, Parameter("1", at_least=1)] = 200
    """Number of copies of the grain, of random orientation, that are tested at once and never meet."""
    air_drag: Annotated[float, Parameter("1/s", at_least=0.0)] = 0.0
    """Rate at which still air slows a free grain of any size."""

    def __post_init__(self) -> None:
        check_parameters(self)

    @abstractmethod
    def feet(self, reach: float) -> np.ndarray:
        """Return the lowest point of each copy [m], (n, 3), for grains of a bounding radius [m]."""

    @property
    def upwards(self) -> Vector:
        """Direction against which the foot of a copy is its lowest point."""
        return 0.0, 0.0, 1.0

    def supply(self, case: Case[Any]) -> int:
        return self.within_limit(case, self.grain_count)

    def copies(self, case: Case[Any]) -> tuple[DrawnGrains, np.ndarray]:
        """Draw the copies of a case and their orientations (quaternions x y z w, (n, 4))."""
        count = self.supply(case)
        return case.grains.draw(count, case.seed), random_orientations(count, case.seed)

    def prepare(self, cases: Sequence[Case[Any]], device: Any) -> list[WorldSetup]:
        return [_world(case) for case in cases]


def _world(case: Case[Any]) -> WorldSetup:
    scene = case.scene
    drawn, orientations = scene.copies(case)
    reach, rest = float(drawn.bounding_radii.max()), np.zeros((drawn.count, 3))
    above = heights(drawn, orientations, scene.upwards)[:, None] * np.array(scene.upwards)
    grains = Grains(
        positions=scene.feet(reach) + above,
        orientations=orientations,
        velocities=rest,
        spins=rest,
        sizes=drawn.sizes,
        densities=np.full(drawn.count, case.grain_material.density),
        shapes=drawn.shapes,
        release_steps=np.full(drawn.count, AT_ONCE),
    )
    return world_of(case, grains, drawn.clumps, reach)


def heights(drawn: DrawnGrains, orientations: np.ndarray, upwards: Vector) -> np.ndarray:
    """Return the height of each grain's centre above its lowest point [m], (n,)."""
    spheres = stack_spheres(drawn.clumps)[drawn.shapes]
    centers, radii, grains = place_spheres(np.zeros((drawn.count, 3)), orientations, drawn.sizes, spheres)
    highest = np.full(drawn.count, -np.inf)
    np.maximum.at(highest, grains, radii - centers @ np.array(upwards))
    return highest


def grid(count: int, spacing: float) -> np.ndarray:
    """Return places of a square grid about the origin of the plane z = 0 [m], (count, 3)."""
    across = int(np.ceil(np.sqrt(count)))
    rows = np.arange(count)
    places = np.column_stack([rows // across, rows % across, np.zeros(count)])
    return spacing * (places - [(across - 1) / 2, (across - 1) / 2, 0.0])


@dataclass
class CopiesState(SceneState):
    """State of a scene of copies."""

    readings: dict[str, list[float]] = field(default_factory=dict)
    """Readings of the copies that were measured, by quantity."""

    def read(self, **values: np.ndarray) -> None:
        """Add readings of some copies, (k,) each."""
        for name, numbers in values.items():
            self.readings.setdefault(name, []).extend(numbers.tolist())

    def measure(self, view: WorldView, middle: Callable[[list[float]], Any] = np.mean) -> str:
        """Measure middle and standard deviation of each quantity; return the reason of a failure, else ""."""
        for name, numbers in self.readings.items():
            self.observables |= {"grain_count": float(len(numbers)), name: float(middle(numbers))}
            if len(numbers) > 1:
                spread = np.std(numbers, ddof=1) if np.ptp(numbers) > 0.0 else 0.0
                self.observables[f"{name}_sd"] = float(spread)
        self.observables["simulated_time"] = view.time
        return "" if any(self.readings.values()) else "no copy of the grain could be measured"


CopiesT = TypeVar("CopiesT", bound=CopiesState)


class PlacedController(PhasedController[CopiesT]):
    """Controller of a scene of copies, which it removes once they are measured."""

    def look(self, view: WorldView) -> Decision:
        """Decide by this world's own copies: in a batch a view has as many slots as the largest world."""
        own = slice(self.setup.grains.count)
        arrays = ("alive", "released", "positions", "velocities", "masses")
        return super().look(replace(view, **{name: getattr(view, name)[own] for name in arrays}))
