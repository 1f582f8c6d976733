"""Stages (e) and (f): the composite design around the crossing, the full and the reduced surface."""

from __future__ import annotations

import math
from dataclasses import dataclass

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
    scene_cases,
    simulate,
    too_many_failed,
)
from experiments.calibrate.responses import each_response, scenes_of
from experiments.calibrate.results import ClimbResult, Decision, Outcome, ResponseSurface, SurfaceResult
from experiments.calibrate.values import (
    UNLIMITED,
    fixed_values,
    kept_factors,
    listed,
    numbered_values,
    p_text,
)
from experiments.studyfile.campaign import ANGLE, CampaignStudy, SurfaceSettings

STAGE = "surface"

ROUNDING = 1e-12
"""A shrunk design keeps this share of its half-range away from a limit, so that rounding cannot cross it."""


@dataclass(frozen=True)
class _Placement:
    """Where a composite design stands and how wide it is."""

    center: dict[str, float]
    half_range: dict[str, float]
    decisions: tuple[Decision, ...]

    def factors(self, kept: tuple[Factor, ...]) -> tuple[Factor, ...]:
        """Return the factors in the design's own coding."""
        return tuple(
            Factor.around(f.name, self.center[f.name], self.half_range[f.name], f.unit) for f in kept
        )


def explore_surface(study: CampaignStudy, climb: ClimbResult, runner: Runner) -> SurfaceResult:
    """Simulate the composite design and fit the surfaces of every response.

    Raises
    ------
    StageEnd
        When too few runs are left for a quadratic surface.
    """
    settings = study.campaign.surface
    placement = _place(study, climb)
    design = _composite(placement.factors(kept_factors(study, climb.kept)), settings)
    finished = simulate(runner, _plan(study, design))[0]
    cases = scene_cases(finished)
    full = _fit(design, cases, ANGLE)
    reduced, reduction = _reduce(full, settings)
    others = each_response(
        study.target.responses, finished, lambda found, column: _fits(design, found, column, settings)
    )
    outside = _outside_ranges(study, design)
    decisions = (
        *placement.decisions,
        _design_decision(design, settings, outside, cases),
        _full_decision(full, settings),
        reduction,
        *([_responses_decision(others, settings)] if others else []),
    )
    response = _run_means(response_table(cases, design.coded.index.tolist()))
    return SurfaceResult(
        cases,
        design,
        response,
        placement.center,
        placement.half_range,
        full,
        reduced,
        outside,
        decisions,
        others,
    )


def require_slope(result: SurfaceResult) -> None:
    """Go on when the reduced surface has a term left.

    Raises
    ------
    StageEnd
        When nothing moves the angle there beyond the noise.
    """
    if not result.reduced.terms:
        raise StageEnd(
            Outcome.PLATEAU,
            f"Around {listed(result.center)} no term of the surface is significant: the angle does not "
            f"depend on {', '.join(result.center)} beyond the noise. Widen surface.half_range or add "
            "replicates.",
        )


def _place(study: CampaignStudy, climb: ClimbResult) -> _Placement:
    """Choose centre and half-ranges, then fit the design into the hard physical limits."""
    settings = study.campaign.surface
    center, center_rule = _center(settings, climb)
    half_range, half_rule = _half_range(study, climb)
    reach = _axial_reach(kept_factors(study, climb.kept), settings)
    fitted = {
        name: fit_inside(center[name], half_range[name], reach, *study.limits.get(name, UNLIMITED))
        for name in climb.kept
    }
    new_center = {name: value for name, (value, _) in fitted.items()}
    new_half = {name: value for name, (_, value) in fitted.items()}
    moved = [
        n for n in climb.kept if not math.isclose(new_center[n], center[n], abs_tol=1e-9 * half_range[n])
    ]
    shrunk = [n for n in climb.kept if not math.isclose(new_half[n], half_range[n])]
    note = f" Moved into the physical limits: {', '.join(moved)}." if moved else ""
    shrink = f" Shrunk to stay inside the physical limits: {', '.join(shrunk)}." if shrunk else ""
    decisions = (
        Decision(
            STAGE, center_rule, numbered_values("center", new_center), f"Centre: {listed(new_center)}.{note}"
        ),
        Decision(
            STAGE,
            half_rule,
            numbered_values("half-range", new_half),
            f"Half-ranges: {listed(new_half)}.{shrink}",
        ),
    )
    return _Placement(new_center, new_half, decisions)


def _center(settings: SurfaceSettings, climb: ClimbResult) -> tuple[dict[str, float], str]:
    fixed = fixed_values(settings.center, climb.kept)
    if fixed is not None:
        return fixed, "The study fixes the centre of the composite design."
    if settings.center_rule == "smallest-error" or climb.crossing is None:
        return climb.best, "The composite design is centred at the climb's step with the smallest error."
    return (
        climb.crossing,
        "The composite design is centred where the climb crosses the target (interpolated).",
    )


def _half_range(study: CampaignStudy, climb: ClimbResult) -> tuple[dict[str, float], str]:
    settings = study.campaign.surface
    fixed = fixed_values(settings.half_range, climb.kept)
    if fixed is not None:
        return fixed, "The study fixes the half-ranges of the composite design."
    least = settings.half_range_least
    values = {
        factor.name: max(abs(climb.step[factor.name]), least * factor.half_range)
        for factor in kept_factors(study, climb.kept)
    }
    rule = f"A half-range is one climb step, at least {least:g} of the factor's screening half-range."
    return values, rule


def fit_inside(
    center: float, half_range: float, reach: float, low: float, high: float
) -> tuple[float, float]:
    """Fit a factor's axial points (center +- reach * half_range) between its hard limits.

    The half-range shrinks, but not below half of itself while moving the centre inward can avoid that.

    Returns
    -------
    tuple of float
        Centre and half-range.
    """
    least = min(0.5 * half_range, (high - low) / (2.0 * reach))
    center = min(max(center, low + reach * least), high - reach * least)
    room = (1.0 - ROUNDING) * min(center - low, high - center) / reach
    return center, min(half_range, room)


def _axial_reach(factors: tuple[Factor, ...], settings: SurfaceSettings) -> float:
    """Return the largest coded value of the design."""
    return float(_composite(factors, settings).coded.abs().to_numpy().max())


def _composite(factors: tuple[Factor, ...], settings: SurfaceSettings) -> Design:
    return central_composite(factors, settings.alpha, settings.center_points)


def _plan(study: CampaignStudy, design: Design) -> pd.DataFrame:
    """Lay out the runs; the centre is replicated by its own rows."""
    settings = study.campaign
    at_center = (design.coded == 0.0).all(axis=1)
    replicates = {int(run): 1 if center else settings.surface.replicates for run, center in at_center.items()}
    scenes = scenes_of(study.target.responses)
    return plan_cases(study.factors, STAGE, design.natural, replicates, settings.seeds.campaign, scenes)


def _fit(design: Design, cases: pd.DataFrame, observable: str) -> Surface:
    """Fit the full quadratic to an observable of the cases of its scene."""
    used = measured(cases, observable)
    try:
        return fit_surface(design.select(used["run"].tolist()), used[observable].to_numpy(dtype=np.float64))
    except DesignError as error:
        need = f"cannot be fitted any more ({error})"
        raise too_many_failed(cases, STAGE, need, observable) from error


def _fits(design: Design, cases: pd.DataFrame, observable: str, settings: SurfaceSettings) -> ResponseSurface:
    """Fit and reduce the surface of a further response; terms that the study names are the angle's."""
    full = _fit(design, cases, observable)
    return ResponseSurface(full, full.reduce(settings.reduce_alpha))


def _responses_decision(fits: dict[str, ResponseSurface], settings: SurfaceSettings) -> Decision:
    """Say what the further responses depend on, and how well a quadratic describes them."""
    said = []
    for name, fit in fits.items():
        terms = ", ".join(fit.reduced.coded_coefficients.index[1:]) or "nothing here"
        p_lack = fit.full.anova["p"]["lack of fit"]
        lack = ", with significant lack of fit" if p_lack < settings.lack_of_fit_alpha else ""
        said.append(f"{name} on {terms} (predicted R2 {fit.reduced.r2_predicted:.2f}{lack})")
    return Decision(
        STAGE,
        "Every further response has a surface of its own over the same design, reduced by the same rule.",
        {f"p of the model of {name}": fit.full.anova["p"]["model"] for name, fit in fits.items()},
        f"They depend on: {'; '.join(said)}.",
    )


def _run_means(response: np.ndarray) -> np.ndarray:
    """Return the mean of each row over what was measured; NaN where nothing was."""
    count = np.isfinite(response).sum(axis=1)
    return np.where(count > 0, np.nansum(response, axis=1) / np.maximum(count, 1), np.nan)


def _reduce(full: Surface, settings: SurfaceSettings) -> tuple[Surface, Decision]:
    """Drop the terms that the study names, or those that backward elimination finds insignificant."""
    present = full.coded_coefficients.index
    if settings.drop is not None:
        reduced = full.drop(*[term for term in settings.drop if term in present])
        rule = "The study names the terms to leave out."
    else:
        reduced = full.reduce(settings.reduce_alpha)
        rule = (
            f"Backward elimination: the least significant term with p above {settings.reduce_alpha:g} goes, "
            "one by one, while no higher term needs it."
        )
    numbers = {f"p of {term}": full.anova["p"][term] for term in present[1:]}
    numbers |= {"predicted R2, full": full.r2_predicted, "predicted R2, reduced": reduced.r2_predicted}
    gone = ", ".join(reduced.dropped) if reduced.dropped else "nothing"
    return reduced, Decision(
        STAGE, rule, numbers, f"Left out: {gone}. Surface: {reduced.equation(digits=4)}."
    )


def _full_decision(full: Surface, settings: SurfaceSettings) -> Decision:
    p_model, p_lack = full.anova["p"]["model"], full.anova["p"]["lack of fit"]
    if math.isnan(p_lack):
        fit = "Lack of fit cannot be tested."
    elif p_lack < settings.lack_of_fit_alpha:
        fit = f"Lack of fit is significant ({p_text(p_lack)}): a quadratic is too simple; shrink the design."
    else:
        fit = f"No lack of fit is found ({p_text(p_lack)})."
    return Decision(
        STAGE,
        f"A full quadratic; lack of fit is tested against the replicates at {settings.lack_of_fit_alpha:g}.",
        {
            "p of the model": p_model,
            "p of lack of fit": p_lack,
            "R2": full.r2,
            "adjusted R2": full.r2_adjusted,
        },
        f"The model has {p_text(p_model)}. {fit}",
    )


def _outside_ranges(study: CampaignStudy, design: Design) -> pd.DataFrame:
    """List the runs outside the ranges that the study states."""
    rows = [
        {"run": run, "factor": factor.name, "value": value, "low": factor.low, "high": factor.high}
        for factor in kept_factors(study, design.names)
        for run, value in design.natural[factor.name].items()
        if not factor.low - 1e-9 * factor.half_range <= value <= factor.high + 1e-9 * factor.half_range
    ]
    return pd.DataFrame(rows, columns=["run", "factor", "value", "low", "high"])


def _design_decision(
    design: Design, settings: SurfaceSettings, outside: pd.DataFrame, cases: pd.DataFrame
) -> Decision:
    where = _outside_sentence(outside)
    return Decision(
        STAGE,
        "A central composite design, inside the hard physical limits; it may leave the stated ranges.",
        {
            "runs": len(design.coded),
            "centre points": settings.center_points,
            "alpha": float(design.coded.abs().to_numpy().max()),
            "runs outside the stated ranges": int(outside["run"].nunique()),
        },
        f"{len(design.coded)} runs. {where} {failure_summary(cases)}".strip(),
    )


def _outside_sentence(outside: pd.DataFrame) -> str:
    if outside.empty:
        return "All lie inside the stated ranges."
    points = [f"run {row.run} ({row.factor} = {row.value:.4g})" for row in outside.itertuples()]
    return f"Outside the stated ranges: {', '.join(points)}."
