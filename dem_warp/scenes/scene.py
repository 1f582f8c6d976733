"""What every scene offers: worlds to start from, and a controller that leads each through its phases."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from dem_warp.model import WorldSetup
from dem_warp.solver import WorldView


@dataclass(frozen=True)
class Decision:
    """What a scene wants done with its world.

    Attributes
    ----------
    remove : (k,) int array, optional
        Grain slots to take out.
    move : (wall, velocity), optional
        Wall to set in motion [m/s].
    done : bool
        The world has ended.
    failure : str
        Why it ended without a result; empty otherwise.
    """

    remove: np.ndarray | None = None
    move: tuple[int, tuple[float, float, float]] | None = None
    done: bool = False
    failure: str = ""


class Controller(Protocol):
    """Leads one world; what it decides depends on that world alone."""

    period: int
    """Steps between two looks; follows from the world alone."""
    phase: str
    phases: list[dict[str, Any]]
    """Name, time [s] and steps of each phase that has ended."""
    observables: dict[str, float]

    def look(self, view: WorldView) -> Decision:
        """Decide what happens next from the present state."""
        ...

    def fraction(self, time: float) -> float:
        """Roughly how much of the case is done at a simulated time [s], 0 to 1."""
        ...


class Scene(Protocol):
    """A physical test, as its parameters."""

    def prepare(self, cases: Sequence[Any], device: Any) -> list[WorldSetup]:
        """Worlds of cases (of this kind of scene, each with its own parameters) before the first step."""
        ...

    def controller(self, case: Any, setup: WorldSetup, chunk: int) -> Controller:
        """Controller of one case, which looks at multiples of `chunk` steps."""
        ...
