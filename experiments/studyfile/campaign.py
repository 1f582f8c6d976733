"""Decisions of a calibration campaign, and the part of a study that a campaign knows.

Every number that a stage decides with is a field here, so that the study file can fix it. Factor values
(``start``, ``step``, ``center``, ``half_range``, ``point``, ``truth``) are in each factor's natural unit;
angles and margins are in degrees. "Coded" is the screening design's coding: -1 at a factor's low level, +1
at its high level.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from experiments.studyfile.schema import Angle, Section, nested_error

if TYPE_CHECKING:
    from doe import Factor, Sample


def _in_natural_units(values: object, info: ValidationInfo) -> object:
    """Turn quantities of a study file into natural units; plain numbers of a program are so already."""
    natural_value = (info.context or {}).get("natural_value")
    if natural_value is None or not isinstance(values, Mapping):
        return values
    natural, errors = {}, []
    for name, value in values.items():
        try:
            natural[name] = natural_value(name, value)
        except ValueError as error:
            errors.append({"type": "value_error", "loc": (name,), "msg": str(error)})
    if errors:
        raise nested_error(errors)
    return natural


FactorValues = Annotated[dict[str, float], BeforeValidator(_in_natural_units)]
"""Values by factor name."""


MOST = 1000
"""Most of whatever a campaign counts: replicates, steps, runs."""


class SeedSettings(Section):
    """Roots of the seeds of all cases; each case has its own."""

    campaign: int = Field(default=1, ge=0)
    """Root of the seeds of every stage's cases."""
    target: int = Field(default=2, ge=0)
    """Root of the seeds of a twin study's target heaps."""

    @model_validator(mode="after")
    def _roots_differ(self) -> SeedSettings:
        if self.campaign == self.target:
            raise ValueError(f"seeds.campaign and seeds.target must differ, got {self.campaign} twice")
        return self


class NoiseFloorSettings(Section):
    """Stage (a): replicates with every factor at its middle."""

    replicates: int = Field(default=5, ge=2, le=MOST)
    """Cases at the centre."""
    confidence: float = Field(default=0.95, gt=0.0, lt=1.0)
    """Level of the interval of the standard deviation."""


class ScreeningSettings(Section):
    """Stage (b): the screening design."""

    design: str = "plackett-burman"
    """Name of the design; packages from outside add further ones."""
    runs: int | None = Field(default=None, ge=4, le=MOST)
    """Runs of the design. Default: the fewest that leave ``dummies`` columns free."""
    dummies: int = Field(default=3, ge=0, le=MOST)
    """Dummy columns wanted when ``runs`` is omitted: each is one degree of freedom of the error."""
    replicates: int = Field(default=1, ge=1, le=MOST)
    """Cases of each run."""

    @field_validator("runs")
    @classmethod
    def _runs_of_the_design(cls, runs: int | None, info: ValidationInfo) -> int | None:
        if runs and runs % 4 and info.data.get("design") == "plackett-burman":
            raise ValueError("must be a multiple of 4")
        return runs


class SelectionSettings(Section):
    """Stage (c): which factors are kept."""

    keep: tuple[str, ...] | None = Field(default=None, min_length=1)
    """Names of the factors to keep. Default: by the rule below."""
    alpha: float = Field(default=0.10, gt=0.0, lt=1.0)
    """A factor is kept when its p value is below this."""
    at_least: int = Field(default=0, ge=0)
    """Keep this many even when fewer are significant, strongest first."""
    at_most: int = Field(default=3, ge=1)
    """Keep no more than this many, strongest first."""
    power: float = Field(default=0.80, gt=0.0, lt=1.0)
    """Power at which the smallest visible effect is stated."""

    @model_validator(mode="after")
    def _limits_in_order(self) -> SelectionSettings:
        if self.at_least > self.at_most:
            raise ValueError(f"selection.at_least ({self.at_least}) must not exceed at_most ({self.at_most})")
        return self


class ClimbSettings(Section):
    """Stage (d): the path of steepest ascent in the kept factors."""

    replicates: int = Field(default=2, ge=1, le=MOST)
    """Cases of each step."""
    steps: int = Field(default=6, ge=2, le=MOST)
    """Points of the first batch."""
    start: FactorValues | None = None
    """First point. Default: the low end of the line through the centre along the effects."""
    step: FactorValues | None = None
    """Move per step. Default: along the effects, so that ``steps`` points span the stated range."""
    extensions: int = Field(default=1, ge=0, le=MOST)
    """Further batches of up to ``steps`` points when the target was not crossed."""
    reach: float = Field(default=2.0, ge=1.0)
    """Farthest that the climb may go from the middle, in half-ranges (hard limits hold in any case)."""
    alpha: float = Field(default=0.05, gt=0.0, lt=1.0)
    """A fall from the best step, or any change along the path, counts when significant at this level."""

    @model_validator(mode="after")
    def _start_with_step(self) -> ClimbSettings:
        if (self.start is None) != (self.step is None):
            raise ValueError("climb.start and climb.step must be given together")
        if self.start is not None and self.step is not None and set(self.start) != set(self.step):
            raise ValueError(
                f"climb.start and climb.step must name the same factors, got {sorted(self.start)} "
                f"and {sorted(self.step)}"
            )
        return self


class SurfaceSettings(Section):
    """Stages (e) and (f): the composite design and the fitted surface."""

    center_rule: Literal["crossing", "smallest-error"] = "crossing"
    """Centre where the climb crosses the target (interpolated), or at its step nearest to the target."""
    center: FactorValues | None = None
    """Centre of the design. Default: by ``center_rule``."""
    half_range: FactorValues | None = None
    """Coded unit of each factor. Default: one climb step, at least ``half_range_least``."""
    half_range_least: float = Field(default=0.4, gt=0.0)
    """Least half-range as a fraction of the factor's screening half-range (a step along a weak factor is
    too short to fit a slope)."""
    alpha: Literal["rotatable", "spherical", "face"] | float = "rotatable"
    """Distance of the axial points in half-ranges."""
    center_points: int = Field(default=5, ge=2, le=MOST)
    """Replicates at the centre: the pure error."""
    replicates: int = Field(default=1, ge=1, le=MOST)
    """Cases of each factorial and axial run."""
    drop: tuple[str, ...] | None = None
    """Terms to leave out of the reduced surface ("F^2", "E:F"). Default: backward elimination."""
    reduce_alpha: float = Field(default=0.05, gt=0.0, lt=1.0)
    """Backward elimination drops a term whose p value is above this."""
    lack_of_fit_alpha: float = Field(default=0.05, gt=0.0, lt=1.0)
    """Lack of fit is called significant below this."""


class OptimumSettings(Section):
    """Stage (g): the chosen point and the compatible region."""

    point: FactorValues | None = None
    """The chosen point. Default: the point of the target contour nearest to the centre (coded units), or,
    without a contour, the compatible point that comes closest to the target."""
    confidence: float = Field(default=0.95, gt=0.0, lt=1.0)
    """Level of the compatible region."""
    unidentified_span: float = Field(default=0.5, gt=0.0, le=1.0)
    """A factor whose compatible values span more than this share of the design's range is unidentified."""


class VerificationSettings(Section):
    """Stage (h): fresh cases at the optimum against the target."""

    replicates: int = Field(default=5, ge=2, le=MOST)
    """Fresh cases at the chosen point."""
    margin: Angle | None = Field(default=None, gt=0.0)
    """Equivalence margin of the leading response, an angle. Default: by ``margin_sds``."""
    margin_sds: float = Field(default=2.0, gt=0.0)
    """Margin in standard deviations of the target; of the leading response when ``margin`` is omitted."""
    alpha: float = Field(default=0.05, gt=0.0, lt=1.0)
    """Level of the t-test and of each one-sided test."""


class FidelitySettings(Section):
    """A cheaper scale at which the design is run; a few runs move its surface to the study's own scale."""

    scale: str
    """Name of the cheaper ``[scale.NAME]``."""
    runs: int = Field(default=12, ge=8, le=MOST)
    """Runs at the study's own scale before the verification: those of the climb, then those that move the
    surface, at least four and one a factor."""


class CampaignSettings(Section):
    """The ``[campaign]`` section of a study."""

    seeds: SeedSettings = SeedSettings()
    noise_floor: NoiseFloorSettings = NoiseFloorSettings()
    screening: ScreeningSettings = ScreeningSettings()
    selection: SelectionSettings = SelectionSettings()
    climb: ClimbSettings = ClimbSettings()
    surface: SurfaceSettings = SurfaceSettings()
    optimum: OptimumSettings = OptimumSettings()
    verification: VerificationSettings = VerificationSettings()
    fidelity: FidelitySettings | None = None
    """Cheaper scale. Default: every case has the study's own scale."""

    @property
    def climb_replicates(self) -> int:
        """Cases of each step of the climb: one where only the climb has the study's own scale."""
        return 1 if self.fidelity else self.climb.replicates


TARGET_SCENE = "target"
"""Name of the study's own scene."""


@dataclass(frozen=True)
class Response:
    """A number that the cases must match."""

    name: str
    """Name, other than that of every other response."""
    observable: str
    """Column of the cases that holds it."""
    unit: str = "1"
    """Its unit; ``"1"``: a plain number."""
    scene: str = TARGET_SCENE
    """Name of the scene that measures it."""
    measured: Sample | None = None
    """Measurements of the physical test, in its unit; None where a twin study simulates them."""
    held_out: bool = False
    """Takes no part in any fit; only judges the chosen point."""
    weights: tuple[tuple[str, float], ...] = ()
    """Observables that its column is the weighted sum of; empty where an observable is its column."""
    part_of: str = ""
    """Profile that it is a height or a direction of; empty where it is a number of its own."""
    measurements: tuple[float, ...] = ()
    """Single measurements, of a direction of a profile."""


@dataclass(frozen=True)
class Direct:
    """A measurement of a factor itself: a response whose surface is the factor, without cases."""

    name: str
    """Name, other than that of every response."""
    factor: str
    """Factor that it is of."""
    measured: Sample
    """Measurements of the factor, in its natural unit."""
    model_sd: float
    """Standard deviation by which the model's parameter may differ from that of the real surface."""
    by: str
    """Method, e.g. ``incline``."""
    unit: str = "1"
    """Natural unit of the factor; ``"1"``: a plain number."""

    @property
    def title(self) -> str:
        """Method and factor in words."""
        return f"{self.by} of {self.factor}"


def near_readings(factors: Iterable[Factor], direct: Iterable[Direct]) -> tuple[Factor, ...]:
    """Narrow factors to three standard errors about their direct readings, as far as that leaves a range."""
    found = {factor.name: factor for factor in factors}
    for one in direct:
        if factor := found.get(one.factor):
            reach, middle = 3.0 * (one.measured.se**2 + one.model_sd**2) ** 0.5, one.measured.mean
            low, high = max(middle - reach, factor.low), min(middle + reach, factor.high)
            found[one.factor] = replace(factor, low=low, high=high) if low < high else factor
    return tuple(found.values())


@dataclass(frozen=True)
class Twin:
    """Hidden settings that the target is simulated with; the campaign does not see them."""

    truth: Mapping[str, float]
    """Values by factor; a factor that is not named is at its middle."""
    replicates: int = 5
    """Cases of the target in every scene."""


@dataclass(frozen=True)
class Target:
    """Responses that the cases must match; the climb follows the first."""

    responses: tuple[Response, ...]
    """The first takes part in the fit; all have measurements, or none of them."""
    twin: Twin | None = None
    """Settings that a twin study takes the measurements from; None where they were made."""

    def __post_init__(self) -> None:
        names = [response.name for response in self.responses]
        if not names or len(set(names)) < len(names):
            raise ValueError(f"Target.responses: must have names that differ, one or more, got {names}")
        if self.leading.held_out:
            raise ValueError(f"Target.responses: the first must not be held out, got {names[0]}")
        for response in self.responses:
            if (response.measured is None) != (self.twin is not None):
                rule = "must have measurements, unless a twin study simulates them"
                raise ValueError(f"response {response.name}: {rule}, got {response.measured}")

    @property
    def leading(self) -> Response:
        """The first response, which the climb follows."""
        return self.responses[0]

    @property
    def fitted(self) -> tuple[Response, ...]:
        """Responses that take part in the fit."""
        return tuple(response for response in self.responses if not response.held_out)


def scenes_of(responses: Iterable[Response]) -> tuple[str, ...]:
    """Names of the scenes that measure responses, in the order of use."""
    return tuple(dict.fromkeys(response.scene for response in responses))
