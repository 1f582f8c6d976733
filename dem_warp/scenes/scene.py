"""Base of every scene: worlds to start from, and a controller that leads each through its phases."""

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
    """Order of a scene to its world."""

    remove: np.ndarray | None = None
    """Grain slots to take out, (k,) int."""
    move: Mapping[int, Motion] = field(default_factory=dict)
    """Walls to set in motion, by number, and their motions."""
    done: bool = False
    """The world has ended."""
    failure: str = ""
    """Reason of an end without a result; empty otherwise."""


class Observable(NamedTuple):
    """Unit and definition of a number that a scene measures."""

    unit: str
    meaning: str


@dataclass
class Course:
    """Progress of a world: all that its controller remembers from one look to the next.

    A checkpoint keeps it as JSON, so its fields, and those that a scene adds in a subclass, are plain values.
    """

    phase: str
    phase_start: float = 0.0
    """Time at which the phase began [s]."""
    slow_since: float | None = None
    """Time since which the grains have been slow in this phase [s]."""
    phases: list[dict[str, Any]] = field(default_factory=list)
    """Name, time [s] and steps of each phase that has ended."""
    observables: dict[str, float] = field(default_factory=dict)
    """In the units that the scene says."""

    def enter(self, phase: str, view: WorldView) -> None:
        """Record the end of the present phase and begin another."""
        steps = view.step - sum(done["steps"] for done in self.phases)
        self.phases.append({"name": self.phase, "time": view.time - self.phase_start, "steps": steps})
        self.phase, self.phase_start, self.slow_since = phase, view.time, None


def course_of(kind: type[Any], values: Mapping[str, Any]) -> Any:
    """Build the course of a kind from the plain values that a checkpoint kept.

    Raises
    ------
    ValueError
        When there are other fields, or a value is of another type.
    """
    hints = get_type_hints(kind)
    if odd := sorted(values.keys() ^ hints.keys()):
        raise ValueError(f"{kind.__name__}: must have its fields, got a difference in {odd}")
    for name, value in values.items():
        if not _fits(value, hints[name]):
            raise ValueError(f"{kind.__name__}.{name}: must be {hints[name]}, got {value!r}")
    return kind(**values)


def _fits(value: Any, hint: Any) -> bool:
    """Tell that a plain value is of an annotated type, its numbers finite."""
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


CourseT = TypeVar("CourseT", bound=Course)


class Controller(Protocol[CourseT]):
    """Leads one world; what it decides depends on that world alone."""

    period: int
    """Steps between two looks, a power of two of chunks; follows from the world alone."""
    course: CourseT
    """Nothing else in a controller changes, so that with its course it takes up a world half-way."""

    def look(self, view: WorldView) -> Decision:
        """Decide what happens next from the present state."""
        ...

    def fraction(self, time: float) -> float:
        """Roughly how much of the case is done at a simulated time [s], 0 to 1."""
        ...


class Scene(Protocol):
    """A physical test, as its parameters."""

    @property
    def observables(self) -> Mapping[str, Observable]:
        """Everything that the scene may measure, by name."""
        ...

    def check_parts(self, names: Sequence[str]) -> None:
        """Check that each name is that of a part of the walls; a ValueError says which there are."""
        ...

    def prepare(self, cases: Sequence[Any], device: Any) -> list[WorldSetup]:
        """Worlds of cases (of this kind of scene, each with its own parameters) before the first step."""
        ...

    def controller(self, case: Any, setup: WorldSetup, chunk: int) -> Controller[Any]:
        """Controller of one case, which looks at multiples of `chunk` steps."""
        ...
