"""Results of the stages of a campaign, and the decisions that they took.

A stage that simulates keeps its ``cases``: one row a case as the runner returned it (every factor in its
natural unit, ``seed``, ``stage``, ``scene``, ``run``, ``replicate``, ``status``, ``reason``, observables,
``case_key``). Failed cases stay in it. Runs and replicates count from 1.

Results of a stage are in its ``responses``, by the name of the response and in its unit; the first leads.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
import pandas as pd

from doe import Comparison, NoiseFloor, Sample
from experiments.io.plain_data import indexed

if TYPE_CHECKING:
    from doe import Design, JointFit, Region, ScreenResult, Surface, Transfer
    from experiments.calibrate.direct_checks import DirectCheck
    from experiments.studyfile.campaign import Response

Found = TypeVar("Found")


class Outcome(StrEnum):
    """Ending of a campaign.

    Fresh cases at the chosen point are shown to be equivalent to the target (calibrated), they differ from it
    (missed), or there are too few of either to decide; the others end before.
    """

    CALIBRATED = "calibrated"
    UNDECIDED = "undecided"
    MISSED = "missed"
    NO_SIGNIFICANT_FACTOR = "no-significant-factor"
    TARGET_NOT_REACHED = "target-not-reached"
    PLATEAU = "plateau"
    BOX_TOO_SMALL = "box-too-small"
    NO_CONTOUR = "no-contour"
    TOO_MANY_FAILED_RUNS = "too-many-failed-runs"


class ClimbEnd(StrEnum):
    """Ending of a climb."""

    CROSSED = "crossed"
    TURNED = "turned"
    FLAT = "flat"
    BOUNDED = "bounded"


def failed(cases: pd.DataFrame, responses: Iterable[Response]) -> pd.DataFrame:
    """Return the cases that failed, or lack one of the responses that their scene measures."""
    lost = cases["status"] != "finished"
    for response in responses:
        values = cases.get(response.observable, pd.Series(np.nan, cases.index))
        lost |= (cases["scene"] == response.scene) & values.isna()
    return cases[lost]


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
    """The decision, as a sentence."""


class StageResult:
    """A stage's result, with tables worth a file of their own."""

    decisions: tuple[Decision, ...]

    def tables(self) -> dict[str, pd.DataFrame]:
        """Return tables by file name (without ending), without the cases."""
        return {}


@dataclass(frozen=True)
class _ByResponse(StageResult, Generic[Found]):
    """A stage's result that has a part for each response."""

    responses: dict[str, Found]
    """Parts by the name of the response."""

    @property
    def leading(self) -> Found:
        """Part of the response that leads."""
        return next(iter(self.responses.values()))

    def _stacked(self, table: Callable[[Found], pd.DataFrame]) -> pd.DataFrame:
        """Put tables of all responses below each other, their names in the first column."""
        tables = {name: indexed(table(found)) for name, found in self.responses.items()}
        return pd.concat(tables, names=["response"]).reset_index(level="response").reset_index(drop=True)


@dataclass(frozen=True)
class TargetResult(_ByResponse[Sample]):
    """Mean, standard deviation and count of every response's measurements."""

    truth: dict[str, float] | None
    """Twin study: hidden value of every factor; None for a physical target."""
    cases: pd.DataFrame | None
    """Twin study: the cases of the target; None for a physical target."""
    decisions: tuple[Decision, ...]


@dataclass(frozen=True)
class NoiseFloorResult(_ByResponse[NoiseFloor]):
    """Replicates with every factor at its middle."""

    cases: pd.DataFrame
    decisions: tuple[Decision, ...]


@dataclass(frozen=True)
class Screened:
    """Effects of the factors on a response."""

    measured: np.ndarray
    """The response by run and replicate of the plan, shape (runs, replicates); a failed case is NaN."""
    screen: ScreenResult
    """Its analysis; ``screen.design`` holds the cases that gave the response, a row each."""


@dataclass(frozen=True)
class ScreeningResult(_ByResponse[Screened]):
    """The Plackett-Burman design and its analysis."""

    cases: pd.DataFrame
    design: Design
    """Design as planned."""
    decisions: tuple[Decision, ...]

    def tables(self) -> dict[str, pd.DataFrame]:
        """Return the coded design with its responses, the effects and the analyses of variance."""
        values = {
            f"{name}_{i}": column
            for name, found in self.responses.items()
            for i, column in enumerate(found.measured.T, start=1)
        }
        return {
            "screening_design": self.design.coded.assign(**values),
            "screening_effects": self._stacked(lambda found: found.screen.table),
            "screening_anova": self._stacked(lambda found: found.screen.anova),
        }


@dataclass(frozen=True)
class SelectionResult(StageResult):
    """The factors that the later stages vary."""

    kept: tuple[str, ...]
    """Names, in the study's order (``table`` ranks them)."""
    table: pd.DataFrame
    """Factors, strongest first: effect on the leading response, its p, percent, rank, visible (larger than
    noise alone explains), p_NAME of every further response, kept, reason."""
    visible_effect: float
    """Smallest effect on the leading response that the design could see, at the power of the settings."""
    decisions: tuple[Decision, ...]

    def tables(self) -> dict[str, pd.DataFrame]:
        """Return the reason that each factor was kept or not."""
        return {"selection": self.table}


@dataclass(frozen=True)
class ClimbResult(StageResult):
    """The leading response's path of steepest ascent, and the place where it meets the target."""

    cases: pd.DataFrame
    kept: tuple[str, ...]
    path: pd.DataFrame
    """Steps (index ``step``; 1 is the start, an extension below it counts 0, -1, ...): value of every kept
    factor, predicted (by the screening), mean (measured), sd, n (cases measured), error (mean less target),
    error_percent; NaN where all cases of a step failed."""
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
        return {"climb": self.path}

    @property
    def best(self) -> dict[str, float]:
        """Kept factors at the step with the smallest error, natural unit."""
        return {name: float(self.path.loc[self.best_step, name]) for name in self.kept}


@dataclass(frozen=True)
class FittedResponse:
    """Surfaces of a response over the composite design."""

    measured: np.ndarray
    """The response of every planned run, mean over its replicates; NaN where all of them failed."""
    full: Surface
    """``full.design`` holds the cases that gave the response, a row each."""
    reduced: Surface
    """The surface without the terms that show nothing."""
    carried: Transfer | None = None
    """The surface as it is at the study's own scale; None where the design was run there."""

    @property
    def final(self) -> Surface | Transfer:
        """The surface that the optimum is taken from."""
        return self.reduced if self.carried is None else self.carried

    @property
    def shown(self) -> tuple[pd.DataFrame, np.ndarray]:
        """Natural settings and responses of the runs at the scale of that surface."""
        of, there = self.full, self.carried
        return (there.runs, there.response) if there else (of.design.natural, of.response)


@dataclass(frozen=True)
class SurfaceResult(_ByResponse[FittedResponse]):
    """The composite design and the fitted surfaces (coded in the design's own half-ranges)."""

    cases: pd.DataFrame
    design: Design
    """Design as planned."""
    center: dict[str, float]
    half_range: dict[str, float]
    outside: pd.DataFrame
    """Runs outside the stated factor ranges: run, factor, value, low, high."""
    decisions: tuple[Decision, ...]

    def tables(self) -> dict[str, pd.DataFrame]:
        """Return the design in both units, the analyses of variance and runs outside the ranges."""
        coded = self.design.coded.add_suffix("_coded")
        values = {name: found.measured for name, found in self.responses.items()}
        return {
            "surface_design": pd.concat([self.design.natural, coded], axis=1).assign(**values),
            "surface_anova_full": self._stacked(lambda found: found.full.anova),
            "surface_anova_reduced": self._stacked(lambda found: found.reduced.anova),
            "surface_outside_ranges": self.outside,
        }


@dataclass(frozen=True)
class FidelityResult(_ByResponse["Transfer"]):
    """The surfaces of a cheaper scale, moved to the study's own by some runs there."""

    scale: str
    """The cheaper scale."""
    cases: pd.DataFrame
    """Runs at the study's own scale, those of the climb inside the design first."""
    decisions: tuple[Decision, ...]

    def tables(self) -> dict[str, pd.DataFrame]:
        """Return the runs."""
        return {"fidelity_runs": self.cases}


@dataclass(frozen=True)
class TruthCheck:
    """A twin study's hidden settings against the fitted surface."""

    values: dict[str, float]
    """Hidden value of every kept factor, natural unit."""
    inside_design: bool
    """True where the composite design reaches so far."""
    compatible: bool | None
    """True where the truth lies in the compatible region; None outside the design: nothing can be said."""
    distance: float | None
    """Coded distance from the truth to the target contour; None when there is no contour."""
    predicted: float
    """The leading response's surface at the truth."""


@dataclass(frozen=True)
class OptimumResult(StageResult):
    """The chosen point and everything that is as good."""

    point: dict[str, float]
    """Chosen value of every kept factor, natural unit."""
    settings: dict[str, float]
    """The same with every other factor at its middle: what a case needs."""
    prediction: pd.Series
    """Fit of the leading response there, as of ``Surface.predict``, and ``full_mean`` of the full model."""
    extent: float
    """Coded half width of the box that contour and region are drawn in: the reach of the axial points."""
    contour: pd.DataFrame
    """Points of the leading response's target contour in that box: a column a kept factor (index: piece)."""
    region: Region
    """Settings at which the fit and the target agree within their uncertainties, for all responses."""
    ranges: pd.DataFrame
    """Range of each factor: low, high, low_open, high_open (at an edge of what was explored)."""
    unidentified: tuple[str, ...]
    """Kept factors that the target does not pin down."""
    truth: TruthCheck | None
    """Twin study: where the hidden truth lies; None for a physical target."""
    decisions: tuple[Decision, ...]
    joint: JointFit | None = None
    """All responses together; None where there is one."""
    direct: tuple[DirectCheck, ...] = ()
    """Direct readings."""

    @property
    def pins_nothing(self) -> bool:
        """True where the target pins down none of the kept factors."""
        return set(self.unidentified) == set(self.point)

    def tables(self) -> dict[str, pd.DataFrame]:
        """Return the contour, the range of each factor and the joint fit."""
        tables = {"contour": self.contour, "compatible_ranges": self.ranges}
        if self.joint is not None:
            tables["joint_responses"] = self.joint.tests(self.point)
            tables["joint_shrinkage"] = self.joint.shrinkage
            tables["joint_directions"] = self.joint.directions
        if self.direct:
            tables["direct_readings"] = pd.DataFrame([check.row for check in self.direct])
        return tables


@dataclass(frozen=True)
class VerificationResult(_ByResponse[Comparison]):
    """Fresh cases at the chosen point against the target of every response, held-out ones too."""

    cases: pd.DataFrame
    verified: bool
    """True where equivalence with every target is shown, and no difference is found."""
    decisions: tuple[Decision, ...]

    def tables(self) -> dict[str, pd.DataFrame]:
        return {"verification": self.cases}


STAGES = (
    *("target", "noise_floor", "screening", "selection", "climb", "surface", "optimum", "verification"),
    "fidelity",  # last, as seeds depend on the places
)
"""Names of the stages."""
