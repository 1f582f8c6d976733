"""The end of a bridge: shift and scale with their intervals, the corrected point, the fresh runs there."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import pandas as pd

from doe import Comparison, Region, Transfer
from experiments.bridge.source import Source
from experiments.calibrate.values import interval_text, listed, quantity
from experiments.io.plain_data import jsonable


class BridgeOutcome(StrEnum):
    """End of a bridge."""

    MET = "met"
    """Fresh runs at the corrected point meet the target."""
    MISSED = "missed"
    """They do not."""
    OUT_OF_REACH = "out-of-reach"
    """The corrected surface does not reach the target where the factors may be."""
    TOO_MANY_FAILED_RUNS = "too-many-failed-runs"
    """Too few runs gave the response."""


@dataclass(frozen=True, eq=False)
class Crossing:
    """A bridge that has ended; what it did not reach is None."""

    source: Source
    engine: str
    """Engine of the other solver, in words."""
    outcome: BridgeOutcome
    reason: str
    """The outcome as a sentence."""
    runs: pd.DataFrame
    """Every run of the other solver, fresh ones too, one row each."""
    margin: float
    """Difference from the target that does not matter, in the response's unit."""
    carried: Transfer | None = None
    """The surface as it is in the other solver."""
    extent: float = 1.0
    """Coded half width of the box that the corrected point lies in; the card's runs reach 1 to 2."""
    point: dict[str, float] | None = None
    """Corrected value of every factor, natural unit."""
    prediction: tuple[float, float] | None = None
    """Response that the corrected surface has there, and its standard error."""
    region: Region | None = None
    """Settings that are as good there."""
    fresh: Comparison | None = None
    """Fresh runs at that point against the target."""

    def to_dict(self) -> dict[str, Any]:
        """Everything as JSON-able data."""
        carried = self.carried
        found: dict[str, Any] = {
            "card": str(self.source.path),
            "engine": self.engine,
            "response": self.source.response,
            "unit": self.source.unit,
            "target": jsonable(self.source.target),
            "outcome": self.outcome.value,
            "reason": self.reason,
            "margin": self.margin,
            "point": self.point,
            "card_point": self.source.point,
            "prediction": self.prediction,
            "fresh": None if self.fresh is None else jsonable(self.fresh),
            "runs": jsonable(self.runs),
        }
        if carried is not None:
            found |= {"shift": carried.shift, "scale": carried.scale, "noise": carried.noise}
            found |= {f"{name}_interval": list(ends) for name, ends in carried.intervals().items()}
        return found

    def sentences(self) -> list[str]:
        """Say what was found, for a person: shift, scale, the point, the outcome."""
        said, unit = [], self.source.unit
        if self.carried is not None:
            ends = self.carried.intervals()
            said.append(
                f"Shift {quantity(self.carried.shift, unit, '+')} "
                f"(95 % {interval_text(ends['shift'], unit, '+')}), "
                f"scale {self.carried.scale:.3g} (95 % {ends['scale'][0]:.3g} to {ends['scale'][1]:.3g}), "
                f"noise of a run {quantity(self.carried.noise, unit)}."
            )
        if self.point is not None and self.prediction is not None:
            mean, error = self.prediction
            said.append(
                f"Corrected from {listed(self.source.point)} to {listed(self.point)}, where "
                f"{quantity(mean, unit)} +- {quantity(error, unit)} is expected."
            )
        return [*said, self.reason]
