"""What each stage of a campaign found, and the decisions that it took.

A stage that simulates keeps its heaps as ``cases``: one row a case as the runner returned it (every factor in
its natural unit, ``seed``, ``stage``, ``scene``, ``run``, ``replicate``, ``status``, ``reason``, ``angle``,
``angle_se`` [deg], observables, ``case_key``). Failed cases stay in it. Runs and replicates count from 1.

What a stage says of the responses beside the angle stands in its ``responses``, by the name of the response
and in its unit.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from experiments.calibrate.export import indexed, jsonable
from experiments.studyfile.campaign import TARGET_SCENE

if TYPE_CHECKING:
    from doe import Comparison, Design, Factor, JointFit, NoiseFloor, Region, Sample, ScreenResult, Surface
    from experiments.studyfile.campaign import CampaignSettings


class Outcome(StrEnum):
    """How a campaign ended."""

    CALIBRATED = "calibrated"
    NOT_VERIFIED = "not-verified"
    NO_SIGNIFICANT_FACTOR = "no-significant-factor"
    TARGET_NOT_REACHED = "target-not-reached"
    PLATEAU = "plateau"
    NO_CONTOUR = "no-contour"
    TOO_MANY_FAILED_RUNS = "too-many-failed-runs"


class ClimbEnd(StrEnum):
    """How a climb ended."""

    CROSSED = "crossed"
    TURNED = "turned"
    FLAT = "flat"
    BOUNDED = "bounded"


@dataclass(frozen=True)
class Decision:
    """One decision, in words and with the numbers that made it."""

    stage: str
    """Stage that decided: "noise_floor", "screening", "selection", ..."""
    rule: str
    """The rule, as a sentence."""
    numbers: dict[str, Any]
    """The numbers that the rule looked at (unit in the key)."""
    outcome: str
    """What was decided, as a sentence."""


class _Tabled:
    """A stage's result with tables worth a file of their own."""

    def tables(self) -> dict[str, pd.DataFrame]:
        """Tables by file name (without ending), beside the cases."""
        return {}


@dataclass(frozen=True)
class TargetResult(_Tabled):
    """The repose angle to be matched."""

    sample: Sample
    """Mean, standard deviation and count of the target's measurements [deg]."""
    truth: dict[str, float] | None
    """Twin study: hidden value of every factor; None for a physical target."""
    cases: pd.DataFrame | None
    """Twin study: the heaps of the target; None for a physical target."""
    decisions: tuple[Decision, ...]
    responses: dict[str, Sample] = field(default_factory=dict)


@dataclass(frozen=True)
class NoiseFloorResult(_Tabled):
    """Replicates with every factor at its middle."""

    cases: pd.DataFrame
    floor: NoiseFloor
    """Mean, standard deviation and its interval [deg]."""
    decisions: tuple[Decision, ...]
    responses: dict[str, NoiseFloor] = field(default_factory=dict)


@dataclass(frozen=True)
class ScreeningResult(_Tabled):
    """The Plackett-Burman design, its response and analysis."""

    cases: pd.DataFrame
    design: Design
    """As planned; ``screen.design`` holds the cases that gave an angle, a row each."""
    response: np.ndarray
    """Repose angles [deg] of the plan, shape (runs, replicates); a failed case is NaN."""
    screen: ScreenResult
    decisions: tuple[Decision, ...]
    responses: dict[str, ScreenResult] = field(default_factory=dict)

    def tables(self) -> dict[str, pd.DataFrame]:
        """The coded design with an angle for each replicate, the effects, the analysis of variance."""
        angles = {f"angle_{i}": column for i, column in enumerate(self.response.T, start=1)}
        return {
            "screening_design": self.design.coded.assign(**angles),
            "screening_effects": self.screen.table,
            "screening_anova": self.screen.anova,
        } | {f"screening_effects_{name}": screen.table for name, screen in self.responses.items()}


@dataclass(frozen=True)
class SelectionResult(_Tabled):
    """The factors that the later stages vary."""

    kept: tuple[str, ...]
    """Names, in the study's order (``table`` ranks them)."""
    table: pd.DataFrame
    """By factor, strongest first: effect [deg], p, percent, rank, visible (larger than noise alone explains),
    p_NAME of every further response, kept, reason."""
    visible_effect: float
    """Smallest effect [deg] that the noise floor lets this design see (at the power of the settings)."""
    decisions: tuple[Decision, ...]

    def tables(self) -> dict[str, pd.DataFrame]:
        """Why each factor was kept or not."""
        return {"selection": self.table}


@dataclass(frozen=True)
class ClimbResult(_Tabled):
    """The path of steepest ascent and where it meets the target."""

    cases: pd.DataFrame
    kept: tuple[str, ...]
    path: pd.DataFrame
    """By step (index ``step``; 1 is the start, an extension below it counts 0, -1, ...): value of every kept
    factor, predicted (by the screening) and measured angle, sd [deg], n (cases measured), error (angle less
    target) [deg], error_percent; NaN where all cases of a step failed."""
    step: dict[str, float]
    """Move of every kept factor per step, natural unit."""
    end: ClimbEnd
    crossing: dict[str, float] | None
    """Kept factors where the path crosses the target (interpolated), natural unit; None when it does not."""
    crossing_step: float | None
    """The same place as a fractional step."""
    best_step: int
    """Step with the smallest error."""
    decisions: tuple[Decision, ...]

    def tables(self) -> dict[str, pd.DataFrame]:
        """The path."""
        return {"climb": self.path}

    @property
    def best(self) -> dict[str, float]:
        """Kept factors at the step with the smallest error, natural unit."""
        return {name: float(self.path.loc[self.best_step, name]) for name in self.kept}


@dataclass(frozen=True)
class ResponseSurface:
    """The surfaces of a response beside the angle, over the same design."""

    full: Surface
    reduced: Surface


@dataclass(frozen=True)
class SurfaceResult(_Tabled):
    """The composite design and the fitted surfaces (coded in the design's own half-ranges)."""

    cases: pd.DataFrame
    design: Design
    """As planned; ``full.design`` holds the cases that gave an angle, a row each."""
    response: np.ndarray
    """Repose angle [deg] of every planned run, mean over its replicates; NaN where all of them failed."""
    center: dict[str, float]
    half_range: dict[str, float]
    full: Surface
    reduced: Surface
    """The surface that the optimum is taken from."""
    outside: pd.DataFrame
    """Runs outside the stated factor ranges: run, factor, value, low, high."""
    decisions: tuple[Decision, ...]
    responses: dict[str, ResponseSurface] = field(default_factory=dict)

    def tables(self) -> dict[str, pd.DataFrame]:
        """The design in both units with its angles, the analyses of variance, runs outside the ranges."""
        coded = self.design.coded.add_suffix("_coded")
        return {
            "surface_design": pd.concat([self.design.natural, coded], axis=1).assign(angle=self.response),
            "surface_anova_full": self.full.anova,
            "surface_anova_reduced": self.reduced.anova,
            "surface_outside_ranges": self.outside,
        } | {f"surface_anova_{name}": fits.full.anova for name, fits in self.responses.items()}


@dataclass(frozen=True)
class TruthCheck:
    """A twin study's hidden settings against the fitted surface."""

    values: dict[str, float]
    """Hidden value of every kept factor, natural unit."""
    inside_design: bool
    """Whether the composite design reaches so far."""
    compatible: bool | None
    """Whether the truth lies in the compatible region; None outside the design, where nothing can be said."""
    distance: float | None
    """Coded distance from the truth to the target contour; None when there is no contour."""
    predicted: float
    """The surface's angle at the truth [deg]."""


@dataclass(frozen=True)
class OptimumResult(_Tabled):
    """The chosen point of the target contour and everything that is as good."""

    point: dict[str, float]
    """Chosen value of every kept factor, natural unit."""
    settings: dict[str, float]
    """The same with every other factor at its middle: what a case needs."""
    prediction: pd.Series
    """The fit there [deg]: mean, se, confidence and prediction interval, named as by ``Surface.predict``."""
    extent: float
    """Coded half width of the box that contour and region are drawn in: the reach of the axial points."""
    contour: pd.DataFrame
    """Points of the angle's contour in that box, one column a kept factor, natural unit (index: piece)."""
    region: Region
    """Where the fit and the target agree within their uncertainties, for all responses."""
    unidentified: tuple[str, ...]
    """Kept factors that the target does not pin down."""
    truth: TruthCheck | None
    """Twin study: where the hidden truth lies; None for a physical target."""
    decisions: tuple[Decision, ...]
    joint: JointFit | None = None
    """The angle and the further responses together; None where there are none."""

    def tables(self) -> dict[str, pd.DataFrame]:
        """The angle's contour, the range of each factor over the compatible region, the joint fit."""
        tables = {"contour": self.contour, "compatible_ranges": self.region.ranges}
        if self.joint is not None:
            tables["joint_responses"] = self.joint.tests(self.point)
            tables["joint_shrinkage"] = self.joint.shrinkage
            tables["joint_directions"] = self.joint.directions
        return tables


@dataclass(frozen=True)
class VerificationResult(_Tabled):
    """Fresh cases at the chosen point against the target."""

    cases: pd.DataFrame
    angles: np.ndarray
    """Repose angles [deg] of the cases that gave one."""
    comparison: Comparison
    margin: float
    """Equivalence margin [deg]."""
    verified: bool
    decisions: tuple[Decision, ...]
    responses: dict[str, Comparison] = field(default_factory=dict)

    def tables(self) -> dict[str, pd.DataFrame]:
        """The fresh cases."""
        return {"verification": self.cases}


StageResult = (
    TargetResult
    | NoiseFloorResult
    | ScreeningResult
    | SelectionResult
    | ClimbResult
    | SurfaceResult
    | OptimumResult
    | VerificationResult
)

STAGES = ("target", "noise_floor", "screening", "selection", "climb", "surface", "optimum", "verification")


@dataclass(frozen=True)
class Campaign:
    """A calibration campaign; the stages after the one where it ended are None."""

    factors: tuple[Factor, ...]
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
    optimum: OptimumResult | None = None
    verification: VerificationResult | None = None

    @property
    def stages(self) -> dict[str, StageResult]:
        """The stages that were reached, by name, in order."""
        return {name: result for name in STAGES if (result := getattr(self, name)) is not None}

    @property
    def decisions(self) -> tuple[Decision, ...]:
        """Every decision, in the order in which they were taken."""
        return tuple(decision for result in self.stages.values() for decision in result.decisions)

    @property
    def failed_cases(self) -> pd.DataFrame:
        """Cases that failed, and heaps that gave no angle."""
        heaps = self.cases["scene"] == TARGET_SCENE
        return self.cases[(self.cases["status"] != "finished") | (heaps & self.cases["angle"].isna())]

    @property
    def scene_costs(self) -> pd.DataFrame:
        """What every scene took (index ``scene``): cases, simulated_time [s], grain_time [s].

        The last is the simulated time of every grain together, to which the work is nearly proportional.
        """
        known = self.cases.reindex(columns=["scene", "simulated_time", "grain_count"])
        known = known.assign(grain_time=known["simulated_time"] * known["grain_count"])
        groups = known.groupby("scene", sort=False)
        return groups[["simulated_time", "grain_time"]].sum().assign(cases=groups.size())

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain JSON data: text, finite numbers, lists and dicts; other numbers are null."""
        return {field.name: jsonable(getattr(self, field.name)) for field in fields(self)}

    def tables(self) -> dict[str, pd.DataFrame]:
        """Tables of every stage that was reached, for CSV files: a named index is a column."""
        tables = {"cases": self.cases, "factors": pd.DataFrame([jsonable(f) for f in self.factors])}
        for result in self.stages.values():
            tables |= result.tables()
        if len(self.scene_costs) > 1:
            tables["scene_costs"] = self.scene_costs
        tables["decisions"] = self._decision_table()
        return {name: indexed(table) for name, table in tables.items()}

    def _decision_table(self) -> pd.DataFrame:
        rows = [
            {
                "stage": decision.stage,
                "rule": decision.rule,
                "numbers": "; ".join(
                    f"{name} = {value}" for name, value in jsonable(decision.numbers).items()
                ),
                "outcome": decision.outcome,
            }
            for decision in self.decisions
        ]
        return pd.DataFrame(rows, columns=["stage", "rule", "numbers", "outcome"])
