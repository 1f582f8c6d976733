"""A surface of a cheaper scale, moved to the study's own by the climb and a few further runs there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from doe import DesignError, Sample, Surface, TargetError, Transfer, spread_points, transfer
from experiments.calibrate.cases import Runner, failure_summary, measured, plan_cases, too_many_failed
from experiments.calibrate.results import ClimbResult, Decision, FidelityResult, SurfaceResult, TargetResult
from experiments.calibrate.values import interval_text, key_of, quantity
from experiments.studyfile import Study
from experiments.studyfile.campaign import FidelitySettings, Response

STAGE = "fidelity"

ROUNDING = 1e-9
"""Share of the design's reach by which a run of the climb may seem to be outside."""

LEAST = 4
"""Fewest further runs, apart from one a factor: shift, scale and noise need them."""

OWN_SCALE = ("target", "climb", "verification", "fidelity")
"""Stages whose cases have the study's own scale where the design has a cheaper one."""


def further_runs(settings: FidelitySettings, climbed: int, factors: int) -> int:
    """Return how many runs move the surface next to those of the climb."""
    return max(settings.runs - climbed, LEAST + factors)


def carry_surface(
    study: Study,
    settings: FidelitySettings,
    path: ClimbResult,
    surface: SurfaceResult,
    target: TargetResult,
    runner: Runner,
) -> FidelityResult:
    """Move the surfaces to the study's own scale by the climb's runs inside the design and some further ones.

    The further ones are chosen for where the cheaper surface is as at the crossing. The full surfaces are
    moved: terms that show nothing at one scale may show at the other. StageEnd where too few give a value.
    """
    design, responses, fit = surface.design, study.target.fitted, surface.leading.full
    climbed = np.column_stack([f.to_coded(path.cases[f.name].to_numpy()) for f in design.factors])
    reach = float(np.abs(design.points.to_numpy()).max())
    radius = float(np.linalg.norm(design.points, axis=1).max()) * (1.0 + ROUNDING)
    inside = np.linalg.norm(climbed, axis=1) <= radius
    level = float(fit.predict(path.crossing or surface.center)["mean"].iloc[0])
    near = fit.compatible_region(replace(target.leading, mean=level), extent=reach, radius=radius)
    count = further_runs(settings, len(climbed), len(design.names))
    cells = near.coded[near.mask] if near.mask.any() else design.points
    points = spread_points(fit, cells, count, climbed[inside])
    natural = {f.name: f.to_natural(column) for f, column in zip(design.factors, points.T, strict=True)}
    runs = pd.DataFrame(natural, index=range(1, count + 1))
    fresh = runner(plan_cases(study, STAGE, runs, 1, responses))
    cases = pd.concat([path.cases[inside], fresh], ignore_index=True)
    carried = {r.name: _carried(surface.responses[r.name].full, target, cases, r) for r in responses}
    decisions = [_decision(carried[r.name], target.responses[r.name], cases, r) for r in responses]
    return FidelityResult(carried, settings.scale, cases, tuple(decisions))


def with_carried(surface: SurfaceResult, result: FidelityResult) -> SurfaceResult:
    """Return the surfaces with what they are at the study's own scale."""
    found = {name: replace(one, carried=result.responses[name]) for name, one in surface.responses.items()}
    return replace(surface, responses=found)


def _carried(full: Surface, target: TargetResult, cases: pd.DataFrame, response: Response) -> Transfer:
    """Move the surface of a response by the runs that gave it; StageEnd with too few."""
    runs, level = measured(cases, response), target.responses[response.name].mean
    try:
        return transfer(full, runs, runs[response.observable].to_numpy(dtype=float), level, slopes=True)
    except DesignError as error:
        raise too_many_failed(cases, STAGE, f"cannot move the surface ({error})", response) from error


def _decision(carried: Transfer, target: Sample, cases: pd.DataFrame, response: Response) -> Decision:
    """Say how far apart the scales are, and what the errors were before and after."""
    unit, ends = response.unit, carried.intervals()
    slopes = dict(zip(carried.design.names, carried.slope_values, strict=True))
    try:
        at = dict(carried.nearest(target.mean, extent=float(np.abs(carried.points).max())))
    except TargetError:
        at = {factor.name: factor.center for factor in carried.design.factors}
    before, after = (float(fit.predict(at)["se"].iloc[0]) for fit in (carried.source, carried))
    numbers = {
        key_of("shift", response): carried.shift,
        f"scale of {response.name}": carried.scale,
        **{key_of(f"slope along {name}, coded,", response): value for name, value in slopes.items()},
        key_of("noise of a run", response): carried.noise,
        key_of("se before", response): before,
        key_of("se after", response): after,
    }
    return Decision(
        STAGE,
        "The runs at this scale move the surface of the cheaper one by a shift, a scale and a slope along "
        "each factor (generalised least squares; the noise by restricted likelihood).",
        numbers,
        f"The {response.name} is shifted by {quantity(carried.shift, unit, '+')} (95 % "
        f"{interval_text(ends['shift'], unit, '+')}) and scaled by {carried.scale:.3g} at the target. "
        f"The standard error there was {quantity(before, unit)} before and is {quantity(after, unit)} after. "
        f"{failure_summary(cases, response)}".strip(),
    )
