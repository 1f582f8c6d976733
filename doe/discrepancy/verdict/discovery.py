"""The record of an analysis: the verdict and its numbers.

Arrays over the data have one row per condition and one column per observable, in the order of ``Data``; NaN
means not measured (or, for p values, not tested). Parameters and sizes are in natural units.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np
from scipy import stats

from doe.discrepancy.contest.gap import Answer, holm
from doe.discrepancy.contest.power import Power
from doe.discrepancy.contest.slips import Slip
from doe.discrepancy.fitting.model_fit import Interval
from doe.discrepancy.verdict.before_after import BeforeAfter
from doe.discrepancy.verdict.next_experiment import NextExperiment


class Verdict(StrEnum):
    """Verdict of an analysis."""

    NONE = "none"
    """The calibrated model agrees with the data: they show no missing effect."""
    NAMED = "named"
    """One mechanism, or one pair, explains the disagreement, and no other does."""
    TIE = "tie"
    """Several mechanisms explain it equally well."""
    UNKNOWN = "unknown"
    """The model disagrees with the data, and nothing in the library explains it."""
    NOT_IDENTIFIABLE = "not_identifiable"
    """The data have fewer independent observables than the model has free parameters."""


@dataclass(frozen=True, eq=False)
class Data:
    """Measured means that were compared with the model."""

    conditions: tuple[str, ...]
    observables: tuple[str, ...]
    """Rows and columns of every array of a discovery."""
    held_out: tuple[bool, ...]
    """True where a condition took no part in any fit."""
    means: np.ndarray
    standard_errors: np.ndarray
    """Means and their standard errors in natural units, (conditions, observables)."""
    replicates: np.ndarray
    """Number of measurements behind each mean, (conditions, observables)."""


@dataclass(frozen=True)
class CalibrationUse:
    """Calibration error of one observable that a model needs."""

    observable: str
    offset: float
    scale: float
    """Declared standard deviations: in the natural unit, and as a share of the value."""
    used_offset: float
    used_scale: float
    """Likeliest values of both, measured less true."""
    deviations: float
    """Length of the two in their standard deviations."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Model with its best fit to the training conditions."""

    mechanisms: tuple[str, ...]
    """Additions to the base; empty for the base itself."""
    theta: tuple[float, ...]
    theta_se: tuple[float, ...]
    """Factors and their standard errors."""
    sizes: tuple[Interval, ...]
    """Size of each mechanism."""
    at_bounds: tuple[str, ...]
    """Factors and mechanisms at an end of their range."""
    q: float
    degrees_of_freedom: int
    q_limit: float
    p_value: float
    """Sum of squares of the whitened residuals of all conditions (held-out ones: errors of the forecast), its
    degrees of freedom, the point that the bootstrap exceeds at the level of the rules, and the p value of the
    whole disagreement, of which Q is one part."""
    clearest: Answer
    """Answer with the smallest p value under noise alone."""
    predicted: np.ndarray
    predicted_se: np.ndarray
    """Means by the model, held-out conditions included, and their standard errors, (conditions, observables).
    """
    residuals: np.ndarray
    """Measured less predicted over the standard deviation of that difference, (conditions, observables)."""
    calibration: tuple[CalibrationUse, ...] = ()
    """Declared calibration errors, and the used part of each."""
    heading: float | None = None
    """Azimuth of its directed mechanisms [deg]; None without them."""

    @property
    def excess(self) -> float:
        """Part of Q that the noise does not account for."""
        return max(self.q - self.degrees_of_freedom, 0.0)

    @cached_property
    def adjusted_p(self) -> np.ndarray:
        """P values of the residuals after Holm, (conditions, observables)."""
        found, seen = self.residuals.copy(), np.isfinite(self.residuals)
        found[seen] = holm(2.0 * stats.norm.sf(np.abs(found[seen])))
        return found


@dataclass(frozen=True)
class Gap:
    """Disagreement of the calibrated base with the data beyond the noise."""

    found: bool
    """True if the base disagrees by its Q, by the largest drop, or by all its scores together."""
    largest_drop: float
    drop_limit: float
    """Largest fall of Q by a mechanism of the library, and the point that 2.5 % of the bootstrap exceeds."""
    drop_mechanism: str
    """The mechanism of that drop."""


@dataclass(frozen=True)
class Drift:
    """A factor fitted to one training condition at a time (Box and Hunter 1962): a true constant stays."""

    factor: str
    conditions: tuple[str, ...]
    values: tuple[float, ...]
    standard_errors: tuple[float, ...]
    p_value: float
    """P value of the hypothesis that the values are equal."""


@dataclass(frozen=True)
class Candidate:
    """A mechanism (or a pair) of the library, as an explanation of the gap."""

    mechanisms: tuple[str, ...]
    """One name, or two."""
    score: float
    """z of its signature in the residuals that calibration cannot take up."""
    visible_share: float
    """Share of its signature that calibration cannot take up, in [0, 1]."""
    sizes: tuple[Interval, ...]
    """Size of each mechanism in the joint refit."""
    size_over_se: tuple[float, ...]
    """Sizes over the standard errors that absent mechanisms would have."""
    q: float
    degrees_of_freedom: int
    p_value: float
    """P value of the joint refit, as in ``Fit``."""
    explained: float
    """Removed share of the base's excess."""
    held_out_gain: Interval | None
    """Gain of the log score of the held-out conditions over the base; None without such conditions."""
    simulated: bool
    """True if these are figures of fresh runs around its optimum, False if they are the emulator's."""
    admitted: bool
    """True if it passes every rule."""
    objection: str
    """The first rule that it fails, as a sentence; empty if admitted."""
    heading: float | None = None
    """Azimuth of its directed mechanisms [deg]; None without them."""


@dataclass(frozen=True, eq=False)
class Confounding:
    """Similarity of mechanisms after calibration: correlations of their visible signatures."""

    mechanisms: tuple[str, ...]
    correlations: np.ndarray
    """(mechanisms, mechanisms), in [-1, 1]."""


@dataclass(frozen=True)
class Effort:
    """Cost of the analysis, and its settings before the data were opened."""

    seed: int
    settings_sha256: str
    bank_cases: int
    fresh_cases: int


@dataclass(frozen=True, eq=False)
class Discovery:
    """Findings of an analysis."""

    verdict: Verdict
    reason: str
    """Rule behind the verdict, with its numbers, as a sentence."""
    named: tuple[str, ...]
    """Mechanisms of the verdict: one or two if named, all of them in a tie, else empty."""
    factors: tuple[str, ...]
    """Names of theta."""
    data: Data
    notes: tuple[str, ...]
    """Faults of the data or the runs, and their treatment."""
    effort: Effort
    base: Fit | None = None
    chosen: Fit | None = None
    """Calibrated base, and model with the mechanism; None without a fit. In a tie, ``chosen`` has the lowest
    Q."""
    gap: Gap | None = None
    drifts: tuple[Drift, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    """Best first."""
    power: tuple[Power, ...] = ()
    """Power for each mechanism of the library."""
    confounding: Confounding | None = None
    before_after: tuple[BeforeAfter, ...] = ()
    """Training conditions, then held-out ones if measured; empty without a chosen model."""
    next_experiment: NextExperiment | None = None
    closest: Fit | None = None
    """First of the candidates, where no model was chosen."""
    slips: tuple[Slip, ...] = ()
    """Likely slips in the data of this verdict."""
    without_slips: Discovery | None = None
    """The same analysis without their values; None without slips."""

    def __post_init__(self) -> None:
        shape = (len(self.data.conditions), len(self.data.observables))
        _check("data", self.data, shape, ("means", "standard_errors", "replicates"))
        for name, fit in (("base", self.base), ("chosen", self.chosen), ("closest", self.closest)):
            if fit is not None:
                _check(name, fit, shape, ("predicted", "predicted_se", "residuals"))


def _check(name: str, tables: Data | Fit, shape: tuple[int, int], fields: tuple[str, ...]) -> None:
    for field in fields:
        if getattr(tables, field).shape != shape:
            received = getattr(tables, field).shape
            raise ValueError(
                f"Discovery.{name}.{field} needs a row a condition and a column an observable, {shape}"
                f", got {received}"
            )
