"""Stages (e) and (f): the composite design around the crossing, the full and the reduced surface."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import pandas as pd

from doe import Design, DesignError, Factor, Surface, central_composite, fit_surface
from experiments.calibrate.cases import (
    Runner,
    StageEnd,
    failure_summary,
    measured,
    plan_cases,
    response_table,
    too_many_failed,
)
from experiments.calibrate.results import (
    ClimbEnd,
    ClimbResult,
    Decision,
    FittedResponse,
    Outcome,
    SurfaceResult,
)
from experiments.calibrate.values import (
    UNLIMITED,
    fixed_values,
    kept_factors,
    listed,
    numbered_values,
    p_text,
    quantity,
    worded,
)
from experiments.studyfile import Study
from experiments.studyfile.campaign import Response, SurfaceSettings

STAGE = "surface"

FIXED = "The study fixes the {} of the composite design."
"""Rule of a centre or half-ranges that the study fixes."""

LEAST_FREEDOM = 3
"""Degrees of freedom from which on an error says something: with 1 and 2 the 95 % limits of Student's t are
12.7 and 4.3 standard errors."""

ROUNDING = 1e-12
"""A shrunk design keeps this share of its half-range away from a limit, so that rounding cannot cross it."""


_Chosen: TypeAlias = tuple[dict[str, float], str]
"""Values by factor, and the rule that chose them."""


@dataclass(frozen=True)
class Box:
    """Centre and half-ranges of the composite design, in natural units, and the decisions for them."""

    center: dict[str, float]
    half_range: dict[str, float]
    decisions: tuple[Decision, ...]


def fixed_box(study: Study, kept: Iterable[str]) -> Box | None:
    """Return the box of kept factors if the study fixes all of it, so that it needs no climb; else None."""
    settings = study.campaign.surface
    center, half_range = (fixed_values(each, kept) for each in (settings.center, settings.half_range))
    if not (center and half_range):
        return None
    return _place(study, (center, FIXED.format("centre")), (half_range, FIXED.format("half-ranges")))


def climbed_box(study: Study, climb: ClimbResult) -> Box:
    """Place the box by the climb, or by what the study fixes of it."""
    settings, kept = study.campaign.surface, kept_factors(study, climb.kept)
    return _place(study, _center(settings, climb), _half_range(settings, climb, kept))


def plan_surface(study: Study, box: Box) -> tuple[Design, pd.DataFrame]:
    """Make the composite design in a box, and lay out its cases."""
    settings, kept = study.campaign.surface, kept_factors(study, box.center)
    factors = tuple(Factor.around(f.name, box.center[f.name], box.half_range[f.name], f.unit) for f in kept)
    design = central_composite(factors, settings.alpha, settings.center_points)
    # The centre is replicated by its own rows.
    at_center = (design.coded == 0.0).all(axis=1)
    replicates = {int(run): 1 if central else settings.replicates for run, central in at_center.items()}
    return design, plan_cases(study, STAGE, design.natural, replicates, study.target.fitted)


def explore_surface(study: Study, box: Box, runner: Runner) -> SurfaceResult:
    """Simulate the composite design and fit every response's surfaces; StageEnd with too few runs left."""
    settings, responses = study.campaign.surface, study.target.fitted
    design, table = plan_surface(study, box)
    cases = runner(table)
    outside = _outside_ranges(kept_factors(study, box.center), design)
    decisions = [*box.decisions, _design_decision(design, settings, outside, cases, responses)]
    found = {}
    for response in responses:
        full = _fit(design, cases, response)
        reduced, rule = _reduce(full, settings, leads=response is responses[0])
        table = response_table(cases, response, design.coded.index.tolist())
        count = np.isfinite(table).sum(axis=1)
        # the mean of each row over what was measured
        values = np.where(count > 0, np.nansum(table, axis=1) / np.maximum(count, 1), np.nan)
        found[response.name] = FittedResponse(values, full, reduced)
        decisions.append(_fit_decision(response, full, reduced, rule, settings))
    return SurfaceResult(found, cases, design, box.center, box.half_range, outside, tuple(decisions))


def require_slope(study: Study, result: SurfaceResult, climb: ClimbResult) -> None:
    """Go on when the leading response's reduced surface has a term left; else StageEnd."""
    if not result.leading.reduced.terms:
        response = study.target.leading
        noise = quantity(result.leading.full.residual_ms**0.5, response.unit)
        crossed = ", although the climb crossed the target" if climb.end is ClimbEnd.CROSSED else ""
        raise StageEnd(
            Outcome.BOX_TOO_SMALL,
            f"Around {worded(study, result.center)} no term of the surface is significant{crossed}: the box "
            f"of the design ({listed(result.half_range)} to each side) is too small for the noise of the "
            f"{response.name} ({noise} from case to case). Widen [campaign.surface] half_range, or raise its "
            "replicates.",
        )


def _place(study: Study, placed: _Chosen, sized: _Chosen) -> Box:
    """Fit centre and half-ranges into the hard physical limits, and say why they were chosen."""
    (center, center_rule), (half_range, half_rule) = placed, sized
    settings, kept = study.campaign.surface, kept_factors(study, center)
    coded = central_composite(kept, settings.alpha, settings.center_points).coded
    reach = float(coded.abs().to_numpy().max())
    fitted = {
        name: fit_inside(center[name], half_range[name], reach, *study.limits.get(name, UNLIMITED))
        for name in center
    }
    new_center = {name: value for name, (value, _) in fitted.items()}
    new_half = {name: value for name, (_, value) in fitted.items()}
    moved = [n for n in center if not math.isclose(new_center[n], center[n], abs_tol=1e-9 * half_range[n])]
    shrunk = [n for n in center if not math.isclose(new_half[n], half_range[n])]
    note = f" Moved into the physical limits: {', '.join(moved)}." if moved else ""
    shrink = f" Shrunk to stay inside the physical limits: {', '.join(shrunk)}." if shrunk else ""
    centers, halves = numbered_values("center", new_center), numbered_values("half-range", new_half)
    decisions = (
        Decision(STAGE, center_rule, centers, f"Centre: {listed(new_center)}.{note}"),
        Decision(STAGE, half_rule, halves, f"Half-ranges: {listed(new_half)}.{shrink}"),
    )
    return Box(new_center, new_half, decisions)


def _center(settings: SurfaceSettings, climb: ClimbResult) -> _Chosen:
    fixed = fixed_values(settings.center, climb.kept)
    if fixed is not None:
        return fixed, FIXED.format("centre")
    if settings.center_rule == "smallest-error" or climb.crossing is None:
        return climb.best, "The composite design is centred at the climb's step with the smallest error."
    return (
        climb.crossing,
        "The composite design is centred where the climb crosses the target (interpolated).",
    )


def _half_range(settings: SurfaceSettings, climb: ClimbResult, kept: tuple[Factor, ...]) -> _Chosen:
    fixed = fixed_values(settings.half_range, climb.kept)
    if fixed is not None:
        return fixed, FIXED.format("half-ranges")
    least = settings.half_range_least
    values = {factor.name: max(abs(climb.step[factor.name]), least * factor.half_range) for factor in kept}
    rule = f"A half-range is one climb step, at least {least:g} of the factor's screening half-range."
    return values, rule


def fit_inside(
    center: float, half_range: float, reach: float, low: float, high: float
) -> tuple[float, float]:
    """Fit a factor's axial points (center +- reach * half_range) between its hard limits.

    The half-range shrinks, but not below half of itself while moving the centre inward can avoid that.
    """
    least = min(0.5 * half_range, (high - low) / (2.0 * reach))
    center = min(max(center, low + reach * least), high - reach * least)
    room = (1.0 - ROUNDING) * min(center - low, high - center) / reach
    return center, min(half_range, room)


def _fit(design: Design, cases: pd.DataFrame, response: Response) -> Surface:
    """Fit the full quadratic to a response."""
    used = measured(cases, response)
    try:
        values = used[response.observable].to_numpy(dtype=np.float64)
        return fit_surface(design.select(used["run"].tolist()), values)
    except DesignError as error:
        raise too_many_failed(cases, STAGE, f"cannot be fitted any more ({error})", response) from error


def _reduce(full: Surface, settings: SurfaceSettings, leads: bool) -> tuple[Surface, str]:
    """Drop the terms that the study names for the leading response, or those found insignificant."""
    if leads and settings.drop is not None:
        present = full.coded_coefficients.index
        reduced = full.drop(*[term for term in settings.drop if term in present])
        return reduced, "the study names the terms to leave out"
    return full.reduce(settings.reduce_alpha), (
        f"backward elimination: the least significant term with p above {settings.reduce_alpha:g} goes, one "
        "by one, while no higher term needs it"
    )


def _fit_decision(
    response: Response, full: Surface, reduced: Surface, rule: str, settings: SurfaceSettings
) -> Decision:
    """Say how well a quadratic describes a response, and which of its terms matter."""
    p_model, p_lack = full.anova["p"]["model"], full.anova["p"]["lack of fit"]
    if math.isnan(p_lack):
        fit = "Lack of fit cannot be tested."
    elif p_lack < settings.lack_of_fit_alpha:
        fit = f"Lack of fit is significant ({p_text(p_lack)}): a quadratic is too simple; shrink the design."
    else:
        fit = f"No lack of fit is found ({p_text(p_lack)})."
    if (left := round(full.anova["df"]["residual"])) < LEAST_FREEDOM:
        fit += f" Degrees of freedom for its errors: {left}; it hardly rules anything out."
    numbers = {"p of the model": p_model, "p of lack of fit": p_lack}
    numbers |= {"R2": full.r2, "adjusted R2": full.r2_adjusted}
    numbers |= {f"p of {term}": full.anova["p"][term] for term in full.coded_coefficients.index[1:]}
    numbers |= {"predicted R2, full": full.r2_predicted, "predicted R2, reduced": reduced.r2_predicted}
    gone = ", ".join(reduced.dropped) if reduced.dropped else "nothing"
    return Decision(
        STAGE,
        "A full quadratic; lack of fit is tested against the replicates at "
        f"{settings.lack_of_fit_alpha:g}. Then {rule}.",
        numbers,
        f"The model of the {response.name} has {p_text(p_model)}. {fit} Left out: {gone}.",
    )


def _outside_ranges(kept: tuple[Factor, ...], design: Design) -> pd.DataFrame:
    """List the runs outside the ranges that the study states."""
    rows = [
        {"run": run, "factor": factor.name, "value": value, "low": factor.low, "high": factor.high}
        for factor in kept
        for run, value in design.natural[factor.name].items()
        if not factor.low - 1e-9 * factor.half_range <= value <= factor.high + 1e-9 * factor.half_range
    ]
    return pd.DataFrame(rows, columns=["run", "factor", "value", "low", "high"])


def _design_decision(
    design: Design,
    settings: SurfaceSettings,
    outside: pd.DataFrame,
    cases: pd.DataFrame,
    responses: Sequence[Response],
) -> Decision:
    points = [f"run {row.run} ({row.factor} = {row.value:.4g})" for row in outside.itertuples()]
    where = (
        f"Outside the stated ranges: {', '.join(points)}." if points else "All lie inside the stated ranges."
    )
    return Decision(
        STAGE,
        "A central composite design, inside the hard physical limits; it may leave the stated ranges.",
        {
            "runs": len(design.coded),
            "centre points": settings.center_points,
            "alpha": float(design.coded.abs().to_numpy().max()),
            "runs outside the stated ranges": int(outside["run"].nunique()),
        },
        f"{len(design.coded)} runs. {where} {failure_summary(cases, *responses)}".strip(),
    )
