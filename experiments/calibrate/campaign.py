"""A campaign as a whole: its stages as far as they were reached, their decisions, cases and tables."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import pandas as pd

from experiments.calibrate.results import (
    STAGES,
    ClimbResult,
    Decision,
    FidelityResult,
    NoiseFloorResult,
    OptimumResult,
    Outcome,
    ScreeningResult,
    SelectionResult,
    StageResult,
    SurfaceResult,
    TargetResult,
    VerificationResult,
    failed,
)
from experiments.calibrate.worth import costs_of
from experiments.io.plain_data import indexed, jsonable

if TYPE_CHECKING:
    from doe import Factor
    from experiments.studyfile.campaign import CampaignSettings, Direct, Response


@dataclass(frozen=True)
class Campaign:
    """A calibration campaign; the stages after the one where it ended are None."""

    factors: tuple[Factor, ...]
    responses: tuple[Response, ...]
    """Numbers to be matched; the first leads."""
    settings: CampaignSettings
    outcome: Outcome
    reason: str
    """The outcome as a sentence: what happened and, where it failed, what to change."""
    cases: pd.DataFrame
    """Every case, one row each, in the order of simulation."""
    target: TargetResult | None = None
    noise_floor: NoiseFloorResult | None = None
    screening: ScreeningResult | None = None
    selection: SelectionResult | None = None
    climb: ClimbResult | None = None
    surface: SurfaceResult | None = None
    fidelity: FidelityResult | None = None
    optimum: OptimumResult | None = None
    verification: VerificationResult | None = None
    direct: tuple[Direct, ...] = ()
    """Factors that were measured by themselves."""

    @property
    def stages(self) -> dict[str, StageResult]:
        """The stages that were reached, by name, in order."""
        found = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: result for name, result in found.items() if isinstance(result, StageResult)}

    @property
    def unreached(self) -> tuple[str, ...]:
        """Names of the stages that were not reached."""
        planned = STAGES if self.settings.fidelity else STAGES[:-1]
        return tuple(name for name in planned if getattr(self, name) is None)

    @property
    def decisions(self) -> tuple[Decision, ...]:
        """Every decision, in the order in which they were taken."""
        return tuple(decision for result in self.stages.values() for decision in result.decisions)

    @property
    def failed_cases(self) -> pd.DataFrame:
        """Cases that failed, or lack a response that their scene measures."""
        return failed(self.cases, self.responses)

    @property
    def scene_costs(self) -> pd.DataFrame:
        """Cost of every scene."""
        return costs_of(self.cases)

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain JSON data; numbers that are not finite are null."""
        return {field.name: jsonable(getattr(self, field.name)) for field in fields(self)}

    def tables(self) -> dict[str, pd.DataFrame]:
        """Return tables of every stage that was reached, for CSV files: a named index is a column."""
        tables = {"cases": self.cases, "factors": pd.DataFrame([jsonable(f) for f in self.factors])}
        for result in self.stages.values():
            tables |= result.tables()
        if len(self.scene_costs) > 1:
            tables["scene_costs"] = self.scene_costs
        tables["decisions"] = self._decision_table()
        return {name: indexed(table) for name, table in tables.items()}

    def _decision_table(self) -> pd.DataFrame:
        columns = [field.name for field in fields(Decision)]
        table = pd.DataFrame([jsonable(decision) for decision in self.decisions], columns=columns)
        texts = ["; ".join(f"{name} = {value}" for name, value in each.items()) for each in table["numbers"]]
        return table.assign(numbers=texts)
