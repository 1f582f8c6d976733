"""Base of scenes in which a gate opens and grains flow out: the controller and the flow rate."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from dem_warp.case import Case
from dem_warp.model import WorldSetup
from dem_warp.scenes.averages import mean_over_time
from dem_warp.scenes.phases import UNREST, Phase
from dem_warp.scenes.poured_controller import PouredController
from dem_warp.scenes.scene import Decision, Observable, SceneState
from dem_warp.scenes.surfaces import LEAST_POINTS, slope
from dem_warp.view import WorldView
from dem_warp.walls import Motion

STEADY = (0.2, 0.7)
"""Parts of the discharged mass between which the flow is steady."""

DISCHARGE_OBSERVABLES = {
    "filled_mass": Observable("kg", "mass of the grains in the container when it opens"),
    "fallen_mass": Observable("kg", "mass of the grains that have come out when all are at rest"),
    "mass_left": Observable("kg", "mass of the grains that stay in the container"),
    "discharge_time": Observable(
        "s", "time from the opening to the last grain that comes out, within a look"
    ),
    "flow_rate": Observable(
        "kg/s",
        "slope of the least-squares line of the fallen mass over time, from 20 to 70 % of the final value; "
        "absent with fewer than three looks in that range, or if the test failed",
    ),
    "flow_rate_se": Observable(
        "kg/s",
        "standard error of the mean flow in that range, with its autocorrelation; absent with fewer than "
        "four looks",
    ),
    "clogged": Observable(
        "1", "1: grains rest over the middle of the outlet, or none came out; 0: the outlet is free"
    ),
    "grains_lost": Observable("1", "grains neither in the container nor among those that came out"),
}


@dataclass
class DischargeState(SceneState):
    """State of a discharge."""

    fallen: list[list[float]] = field(default_factory=list)
    """Time since the opening [s] and discharged mass [kg], at the opening and at every look after it."""

    @property
    def last_fall(self) -> float:
        """Time since the opening when the last grain had come out [s]."""
        time, mass = np.array(self.fallen).T
        return float(time[np.argmax(mass == mass[-1])])

    @property
    def flow_rate(self) -> float | None:
        """Flow rate of the steady part [kg/s]; None with too few looks."""
        time, mass = self._steady
        return slope(time, mass) if len(mass) >= LEAST_POINTS else None

    @property
    def flow_rate_se(self) -> float | None:
        """Standard error of the mean flow of the steady part [kg/s]; None with too few looks."""
        time, mass = self._steady
        mean = mean_over_time(np.diff(mass) / np.diff(time))
        return mean.standard_error if mean else None

    @property
    def _steady(self) -> np.ndarray:
        """Times and masses of the steady part, (2, k)."""
        looks = np.array(self.fallen).T
        low, high = np.array(STEADY) * looks[1, -1]
        return looks[:, (looks[1] >= low) & (looks[1] <= high)]


class DischargeController(PouredController[DischargeState]):
    """Controller of a discharge: fill, settle, open, discharge."""

    gate: ClassVar[int]
    """Number of the wall that closes the outlet."""

    def __init__(self, case: Case[Any], setup: WorldSetup, chunk: int) -> None:
        super().__init__(case, setup, chunk, DischargeState("fill"))
        self.phases["open"] = Phase(self._open, 0.05)
        self.phases["discharge"] = Phase(self._discharge, self.expected_discharge)

    @property
    @abstractmethod
    def gate_path(self) -> float:
        """Height that the gate falls, below all grains [m]."""

    @property
    @abstractmethod
    def expected_discharge(self) -> float:
        """Approximate duration of the discharge [s]."""

    @abstractmethod
    def came_out(self, view: WorldView) -> np.ndarray:
        """Mark the grains that have come out, including those that have left the world, (n,) bool."""

    @abstractmethod
    def over_outlet(self, view: WorldView) -> np.ndarray:
        """Mark the grains above the middle of the outlet, where no slope can end, (n,) bool."""

    def why_clogged(self, view: WorldView) -> str:
        """Return the reason of the failure when grains rest over the outlet."""
        seen = self.state.observables
        left, filled = seen["mass_left"], seen["filled_mass"]
        return f"the outlet is clogged: {left:.3g} kg of {filled:.3g} kg stay above it"

    def measure(self, view: WorldView) -> dict[str, float]:
        """Return the scene's own observables at the end of the discharge."""
        return {}

    def begin(self, view: WorldView, kept: np.ndarray) -> Mapping[int, Motion]:
        """Let the gate fall, faster than the grains."""
        self.state.observables["filled_mass"] = float(view.masses[kept].sum())
        self.state.fallen.append([0.0, 0.0])
        self.state.enter("open", view)
        return {self.gate: Motion(velocity=(0.0, 0.0, -self.poured.top_speed))}

    def _open(self, view: WorldView) -> Decision:
        self._record(view, view.time - self.state.phase_start)
        if (view.time - self.state.phase_start) * self.poured.top_speed < self.gate_path:
            return Decision()
        self.state.enter("discharge", view)
        return Decision(move={self.gate: Motion()})

    def _discharge(self, view: WorldView) -> Decision:
        state = self.state
        opened = state.phase_start - state.phases[-1]["time"]
        self._record(view, view.time - opened)
        at_rest, limit = self.rests(view), self.SETTLE_LIMIT
        if not at_rest and view.time - opened - state.last_fall <= limit:
            return Decision()
        self._measure_masses(view)
        state.enter("rest", view)
        if not at_rest:
            failure = f"the remaining grains did not rest within {limit:g} s after the last fell; {UNREST}"
            return Decision(done=True, failure=failure)
        return Decision(done=True, failure=self._judge(view))

    def _record(self, view: WorldView, time: float) -> None:
        self.state.fallen.append([time, float(view.masses[self.came_out(view)].sum())])

    def _measure_masses(self, view: WorldView) -> None:
        out, seen = self.came_out(view), self.state.observables
        inside = view.alive & ~out
        seen |= {
            "fallen_mass": self.state.fallen[-1][1],
            "mass_left": float(view.masses[inside].sum()),
            "discharge_time": self.state.last_fall,
            "grains_lost": seen["grain_count"] - float(np.count_nonzero(inside | out)),
            "simulated_time": view.time,
        }

    def _judge(self, view: WorldView) -> str:
        """Measure a world at rest with a free outlet; return the reason of the failure if it is clogged."""
        out, seen = self.came_out(view), self.state.observables
        blocked = (view.alive & ~out & self.over_outlet(view)).any() or not out.any()
        seen["clogged"] = float(blocked)
        if blocked:
            return self.why_clogged(view)
        seen |= self.measure(view)
        rates = {"flow_rate": self.state.flow_rate, "flow_rate_se": self.state.flow_rate_se}
        seen |= {name: rate for name, rate in rates.items() if rate is not None}
        return ""
