"""Controllers that lead a world through phases, each with an expected duration."""

from abc import ABC
from collections.abc import Callable
from typing import Any, Generic, NamedTuple

import numpy as np

from dem_warp.case import Case
from dem_warp.model import WorldSetup
from dem_warp.scenes.scene import Decision, StateT
from dem_warp.view import WorldView

CALM = 10.0
"""Largest speed of a resting grain over `rest_speed`, which limits the root mean square speed."""

UNREST = (
    "if grains tremble in place, lower time_step_fraction; grains that lose no energy (restitution 1, "
    "friction 0) never rest"
)
"""Advice for grains that do not rest: with too long a step, damping adds energy."""


class Phase(NamedTuple):
    """Phase of a scene."""

    look: Callable[[WorldView], Decision]
    expected: float
    """Approximate duration of all its visits [s]."""
    visits: int = 1
    """Times that the world enters it."""


class PhasedController(ABC, Generic[StateT]):
    """Controller of phases; `phases` has each by its name."""

    LOOK = 4.0e-3
    """Time between two looks [s], rounded up to a power of two times the chunk."""

    phases: dict[str, Phase]

    def __init__(self, case: Case[Any], setup: WorldSetup, chunk: int, state: StateT) -> None:
        self.case, self.setup, self.state = case, setup, state
        self.grain_reach = case.grains.grain_reach
        self.period = chunk * 2 ** max(int(np.ceil(np.log2(self.LOOK / (chunk * setup.time_step)))), 0)

    def fraction(self, time: float) -> float:
        """Return roughly the fraction done at a simulated time [s], 0 to 1."""
        each = {name: phase.expected / phase.visits for name, phase in self.phases.items()}
        done = sum(each.get(phase["name"], 0.0) for phase in self.state.phases)
        whole = sum(phase.expected for phase in self.phases.values())
        return min((done + min(time - self.state.phase_start, each[self.state.phase])) / whole, 1.0)

    def look(self, view: WorldView) -> Decision:
        return self.phases[self.state.phase].look(view)

    def rests(self, view: WorldView) -> bool:
        """Return True if the grains have been slow for `rest_time`."""
        limit = self.case.scene.rest_speed
        if not (view.rms_speed < limit and view.fastest < CALM * limit):
            self.state.slow_since = None
            return False
        if self.state.slow_since is None:
            self.state.slow_since = view.time
        return view.time - self.state.slow_since >= self.case.scene.rest_time
