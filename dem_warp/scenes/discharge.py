"""Base of scenes in which a gate falls away and grains run out: the course and the rate."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.model import WorldSetup
from dem_warp.scenes.averages import mean_over_time
from dem_warp.scenes.poured_controller import UNREST, Phase, PouredController
from dem_warp.scenes.scene import Course, Decision, Observable
from dem_warp.scenes.surfaces import LEAST_POINTS, slope
from dem_warp.view import WorldView
from dem_warp.walls import Motion

STEADY = (0.2, 0.7)
"""The flow is steady between these parts of the mass that comes out: past the opening, before the end."""

DISCHARGE_OBSERVABLES = {
    "filled_mass": Observable("kg", "mass of the grains in the container when it opens"),
    "fallen_mass": Observable("kg", "mass of the grains that have come out when all is at rest"),
    "mass_left": Observable("kg", "mass of the grains that stay in the container"),
    "discharge_time": Observable("s", "from the opening to the last grain that comes out, to within a look"),
    "flow_rate": Observable(
        "kg/s",
        "slope of the least-squares line of the mass fallen over time, from 20 to 70 % of all that falls; "
        "absent where fewer than three looks fall in between, and where the test failed",
    ),
    "flow_rate_se": Observable(
        "kg/s",
        "standard error of the mean flow of that part, which knows how long the flow remembers; absent where "
        "fewer than four looks fall in between",
    ),
    "clogged": Observable(
        "1", "1: grains rest over the middle of the outlet, or none came out; 0: the way is free"
    ),
    "grains_lost": Observable("1", "grains that are neither in the container nor came out of it"),
}


@dataclass
class Discharge(Course):
    """Course of a scene whose grains run out of a container."""

    fallen: list[list[float]] = field(default_factory=list)
    """Time since the opening [s] and mass that has come out [kg], at the opening and every look after it."""

    @property
    def last_fall(self) -> float:
        """Time since the opening at which the last grain had come out [s]."""
        time, mass = np.array(self.fallen).T
        return float(time[np.argmax(mass == mass[-1])])

    @property
    def flow_rate(self) -> float | None:
        """Rate of the steady part [kg/s]; None where too few looks show it."""
        time, mass = self._steady
        return slope(time, mass) if len(mass) >= LEAST_POINTS else None

    @property
    def flow_rate_se(self) -> float | None:
        """Standard error of the mean flow of the steady part [kg/s]; None where too few looks show it."""
        time, mass = self._steady
        mean = mean_over_time(np.diff(mass) / np.diff(time))
        return mean.standard_error if mean else None

    @property
    def _steady(self) -> np.ndarray:
        """Time and mass of the looks of the steady part, (2, k)."""
        looks = np.array(self.fallen).T
        low, high = np.array(STEADY) * looks[1, -1]
        return looks[:, (looks[1] >= low) & (looks[1] <= high)]


class DischargeController(PouredController[Discharge]):
    """Phases of a discharge: fill, settle, open until the gate is out of the way, discharge."""

    gate: ClassVar[int]
    """Number of the wall that closes the outlet."""

    def __init__(self, case: Case[Any], setup: WorldSetup, chunk: int) -> None:
        super().__init__(case, setup, chunk, Discharge("fill"))
        self.phases["open"] = Phase(self._open, 0.05)
        self.phases["discharge"] = Phase(self._discharge, self.expected_discharge)

    # ---- what a scene says of its outlet -------------------------------------------------------------------

    @property
    @abstractmethod
    def gate_path(self) -> float:
        """Height that the gate falls, to where no grain is [m]."""

    @property
    @abstractmethod
    def expected_discharge(self) -> float:
        """Roughly how long the discharge takes [s]."""

    @abstractmethod
    def came_out(self, view: WorldView) -> np.ndarray:
        """Which grains have come out of the container, also those that have left the world, (n,) bool."""

    @abstractmethod
    def over_outlet(self, view: WorldView) -> np.ndarray:
        """Which grains are above the middle of the outlet, where no slope can end, (n,) bool."""

    def why_clogged(self, view: WorldView) -> str:
        """Reason of the failure when grains rest over the outlet."""
        seen = self.course.observables
        left, filled = seen["mass_left"], seen["filled_mass"]
        return f"the outlet is clogged: {left:.3g} kg of {filled:.3g} kg stay above it"

    def measure(self, view: WorldView) -> dict[str, float]:
        """Observables of the scene's own, when all that could has come out and is at rest."""
        return {}

    # ---- phases --------------------------------------------------------------------------------------------

    def begin(self, view: WorldView, kept: np.ndarray) -> Mapping[int, Motion]:
        """Let the gate fall, faster than grains can follow."""
        self.course.observables["filled_mass"] = float(view.masses[kept].sum())
        self.course.fallen.append([0.0, 0.0])
        self.course.enter("open", view)
        return {self.gate: Motion(velocity=(0.0, 0.0, -self.poured.top_speed))}

    def _open(self, view: WorldView) -> Decision:
        self._record(view, view.time - self.course.phase_start)
        if (view.time - self.course.phase_start) * self.poured.top_speed < self.gate_path:
            return Decision()
        self.course.enter("discharge", view)
        return Decision(move={self.gate: Motion()})

    def _discharge(self, view: WorldView) -> Decision:
        course = self.course
        opened = course.phase_start - course.phases[-1]["time"]
        self._record(view, view.time - opened)
        at_rest, limit = self.rests(view), self.SETTLE_LIMIT
        if not at_rest and view.time - opened - course.last_fall <= limit:
            return Decision()
        self._measure_masses(view)
        course.enter("rest", view)
        if not at_rest:
            failure = f"the grains left did not rest within {limit:g} s of the last that fell; {UNREST}"
            return Decision(done=True, failure=failure)
        return Decision(done=True, failure=self._judge(view))

    def _record(self, view: WorldView, time: float) -> None:
        self.course.fallen.append([time, float(view.masses[self.came_out(view)].sum())])

    def _measure_masses(self, view: WorldView) -> None:
        out, seen = self.came_out(view), self.course.observables
        inside = view.alive & ~out
        seen |= {
            "fallen_mass": self.course.fallen[-1][1],
            "mass_left": float(view.masses[inside].sum()),
            "discharge_time": self.course.last_fall,
            "grains_lost": seen["grain_count"] - float(np.count_nonzero(inside | out)),
            "simulated_time": view.time,
        }

    def _judge(self, view: WorldView) -> str:
        """Measure a world at rest whose outlet is free; why the test failed where it is not."""
        out, seen = self.came_out(view), self.course.observables
        blocked = (view.alive & ~out & self.over_outlet(view)).any() or not out.any()
        seen["clogged"] = float(blocked)
        if blocked:
            return self.why_clogged(view)
        seen |= self.measure(view)
        if (rate := self.course.flow_rate) is not None:
            seen["flow_rate"] = rate
        if (error := self.course.flow_rate_se) is not None:
            seen["flow_rate_se"] = error
        return ""
