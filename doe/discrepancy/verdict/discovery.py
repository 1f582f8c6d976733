"""The record of an analysis: the verdict and every number that it rests on.

Arrays over the data have one row a condition and one column an observable, in the order of ``Data``; NaN
stands where nothing was measured (or, for p values, tested). Parameters and sizes are in natural units.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from doe.discrepancy.contest.gap import Answer
from doe.discrepancy.contest.power import Power
from doe.discrepancy.contest.slips import Slip
from doe.discrepancy.fitting.model_fit import Interval
from doe.discrepancy.verdict.before_after import BeforeAfter
from doe.discrepancy.verdict.next_experiment import NextExperiment


class Verdict(StrEnum):
    """Endings of an analysis."""

    NONE = "none"
    """The calibrated model agrees with the data: nothing is missing that they could show."""
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
    """The measured means that were compared with the model."""

    conditions: tuple[str, ...]
    observables: tuple[str, ...]
    """Rows and columns of every array of a discovery."""
    held_out: tuple[bool, ...]
    """True where a condition took no part in any fit."""
    means: np.ndarray
    standard_errors: np.ndarray
    """In natural units, (conditions, observables)."""
    replicates: np.ndarray
    """Measurements that each mean is made of, (conditions, observables)."""


@dataclass(frozen=True)
class CalibrationUse:
    """The calibration error of one observable that a model asks for."""

    observable: str
    offset: float
    scale: float
    """Standard deviations that were allowed: in its natural unit, and as a share of the value."""
    used_offset: float
    used_scale: float
    """Likeliest values of both, measured less true."""
    deviations: float
    """Length of the two in their standard deviations."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A model as close to the training conditions as it comes."""

    mechanisms: tuple[str, ...]
    """Additions to the base; empty for the base itself."""
    theta: tuple[float, ...]
    theta_se: tuple[float, ...]
    """The factors and their standard errors."""
    sizes: tuple[Interval, ...]
    """Size of each mechanism."""
    at_bounds: tuple[str, ...]
    """Factors and mechanisms that ended at an end of their range."""
    q: float
    degrees_of_freedom: int
    q_limit: float
    p_value: float
    """Sum of squares of the whitened residuals of all conditions (of those held out: by how far the forecast
    misses them), its degrees of freedom, the point that the bootstrap exceeds at the level of the rules, and
    the p value of the whole disagreement, of which Q is one part."""
    clearest: Answer
    """Of the questions that the p value is made of, the one that noise alone answers so most seldom."""
    predicted: np.ndarray
    predicted_se: np.ndarray
    """Means as the model has them, held-out conditions included, and how well they are known, (conditions,
    observables)."""
    residuals: np.ndarray
    adjusted_p: np.ndarray
    """Measured less predicted over the standard deviation of that difference, and its p value after Holm,
    (conditions, observables)."""
    calibration: tuple[CalibrationUse, ...] = ()
    """Calibration errors that were allowed, and how much of each it uses."""
    heading: float | None = None
    """Azimuth of its directed mechanisms [deg]; None without one."""

    @property
    def excess(self) -> float:
        """Part of Q that the noise does not account for."""
        return max(self.q - self.degrees_of_freedom, 0.0)


@dataclass(frozen=True)
class Gap:
    """Disagreement of the calibrated base with the data beyond the noise."""

    found: bool
    """True if the base disagrees by its Q, by the largest drop, or by all its scores together."""
    largest_drop: float
    drop_limit: float
    """Largest fall of Q that a mechanism of the library brings, and the point that 2.5 % of the bootstrap
    exceeds."""
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
    """Of the hypothesis that the values are one."""


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
    """Each size over the standard error that it would have if there were none."""
    q: float
    degrees_of_freedom: int
    p_value: float
    """Of the joint refit, as in ``Fit``."""
    explained: float
    """Share of the base's excess that it removes."""
    held_out_gain: Interval | None
    """Gain of the log score of the held-out conditions over the base; None where none was measured."""
    simulated: bool
    """True if these are figures of fresh runs around its optimum, False if the emulator's."""
    admitted: bool
    """True if it passes every rule."""
    objection: str
    """The first rule that it fails, as a sentence; empty if admitted."""
    heading: float | None = None
    """As in ``Fit``."""


@dataclass(frozen=True, eq=False)
class Confounding:
    """Likeness of mechanisms after calibration: correlations of their visible signatures."""

    mechanisms: tuple[str, ...]
    correlations: np.ndarray
    """(mechanisms, mechanisms), in [-1, 1]."""


@dataclass(frozen=True)
class Effort:
    """Cost of the analysis, and what fixed it before the data were opened."""

    seed: int
    settings_sha256: str
    bank_cases: int
    fresh_cases: int


@dataclass(frozen=True, eq=False)
class Discovery:
    """Everything that an analysis found."""

    verdict: Verdict
    reason: str
    """The rule that gave the verdict, with its numbers, as a sentence."""
    named: tuple[str, ...]
    """The mechanisms of the verdict: one or two if named, all of them in a tie, else none."""
    factors: tuple[str, ...]
    """Names of theta."""
    data: Data
    base: Fit | None
    chosen: Fit | None
    """The calibrated base, and the model with the mechanism. None where there was nothing to fit; of a tie,
    ``chosen`` is the one of lowest Q."""
    gap: Gap | None
    drifts: tuple[Drift, ...]
    candidates: tuple[Candidate, ...]
    """Best first."""
    power: tuple[Power, ...]
    """One a mechanism of the library."""
    confounding: Confounding | None
    before_after: tuple[BeforeAfter, ...]
    """Training conditions, then held-out ones if measured; empty where no model was chosen."""
    next_experiment: NextExperiment | None
    notes: tuple[str, ...]
    """Faults of the data or the runs, and what was done about them."""
    effort: Effort
    closest: Fit | None = None
    """The first of the candidates, where none was chosen."""
    slips: tuple[Slip, ...] = ()
    """Likely slips, which this verdict was given with."""
    without_slips: Discovery | None = None
    """The same analysis without their values; None without slips."""

    def __post_init__(self) -> None:
        shape = (len(self.data.conditions), len(self.data.observables))
        _check("data", self.data, shape, ("means", "standard_errors", "replicates"))
        for name, fit in (("base", self.base), ("chosen", self.chosen), ("closest", self.closest)):
            if fit is not None:
                _check(name, fit, shape, ("predicted", "predicted_se", "residuals", "adjusted_p"))


def _check(name: str, tables: Data | Fit, shape: tuple[int, int], fields: tuple[str, ...]) -> None:
    for field in fields:
        if getattr(tables, field).shape != shape:
            received = getattr(tables, field).shape
            raise ValueError(
                f"Discovery.{name}.{field} needs a row a condition and a column an observable, {shape}"
                f", got {received}"
            )
