"""Interface of scenes: initial worlds, and a controller that leads each through its phases."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Any, NamedTuple, Protocol, TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from dem_warp.model import WorldSetup
from dem_warp.view import WorldView
from dem_warp.walls import Motion


@dataclass(frozen=True)
class Decision:
    """Instructions of a scene for its world."""

    remove: np.ndarray | None = None
    """Grain slots to remove, (k,) int."""
    move: Mapping[int, Motion] = field(default_factory=dict)
    """New motions of walls, by number."""
    done: bool = False
    """True if the world has ended."""
    failure: str = ""
    """Reason of a failed end; empty otherwise."""


class Observable(NamedTuple):
    """Unit and definition of a measured number."""

    unit: str
    meaning: str


@dataclass
class SceneState:
    """State of a controller between two looks at its world.

    A checkpoint keeps it as JSON, so its fields and those of subclasses are plain values.
    """

    phase: str
    phase_start: float = 0.0
    """Start time of the phase [s]."""
    slow_since: float | None = None
    """Time since which the grains are slow in this phase [s]."""
    phases: list[dict[str, Any]] = field(default_factory=list)
    """Name, duration [s] and steps of each ended phase."""
    observables: dict[str, float] = field(default_factory=dict)
    """Measured numbers, in the units of the scene's `Observable`."""

    def enter(self, phase: str, view: WorldView) -> None:
        """Record the end of the present phase and begin another."""
        steps = view.step - sum(done["steps"] for done in self.phases)
        self.phases.append({"name": self.phase, "time": view.time - self.phase_start, "steps": steps})
        self.phase, self.phase_start, self.slow_since = phase, view.time, None


def restore_state(kind: type[Any], values: Mapping[str, Any]) -> Any:
    """Build a state from the values in a checkpoint; raise ValueError for wrong fields or types."""
    hints = get_type_hints(kind)
    if odd := sorted(values.keys() ^ hints.keys()):
        raise ValueError(f"{kind.__name__}: missing or unknown fields {odd}")
    for name, value in values.items():
        if not _fits(value, hints[name]):
            raise ValueError(f"{kind.__name__}.{name}: must be {hints[name]}, got {value!r}")
    return kind(**values)


def _fits(value: Any, hint: Any) -> bool:
    """Return True if a value has an annotated type, with finite numbers."""
    inner = get_args(hint)
    if hint is float:
        return type(value) in (int, float) and isfinite(value)
    match get_origin(hint):
        case None:
            return hint is Any or isinstance(value, hint)
        case origin if origin is list:
            return isinstance(value, list) and all(_fits(item, inner[0]) for item in value)
        case origin if origin is dict:
            return isinstance(value, dict) and all(_fits(item, inner[1]) for item in value.values())
        case _:
            return any(_fits(value, each) for each in inner)


StateT = TypeVar("StateT", bound=SceneState)


class Controller(Protocol[StateT]):
    """Controller of one world; its decisions depend on that world alone."""

    period: int
    """Steps between two looks: a power of two times the chunk."""
    state: StateT
    """The only part that changes: with it a controller continues a world."""

    def look(self, view: WorldView) -> Decision:
        """Decide what happens next."""
        ...

    def fraction(self, time: float) -> float:
        """Return roughly the fraction done at a simulated time [s], 0 to 1."""
        ...


class Scene(Protocol):
    """Parameters of a physical test."""

    @property
    def observables(self) -> Mapping[str, Observable]:
        """Everything that the scene may measure, by name."""
        ...

    def check_parts(self, names: Sequence[str]) -> None:
        """Raise ValueError for a name that is no part of the walls."""
        ...

    def prepare(self, cases: Sequence[Any], device: Any) -> list[WorldSetup]:
        """Return the initial worlds of cases of this kind of scene."""
        ...

    def controller(self, case: Any, setup: WorldSetup, chunk: int) -> Controller[Any]:
        """Return the controller of one case, which looks at multiples of `chunk` steps."""
        ...
