"""A cheaper scale: how far it is from the study's own, and the surface moved there by a few runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from doe import (
    DesignError,
    Goal,
    JointFit,
    Sample,
    Surface,
    TargetError,
    Transfer,
    joint_fit,
    spread_points,
    transfer,
)
from experiments.calibrate.cases import (
    Runner,
    failure_summary,
    measured,
    middle,
    plan_cases,
    too_many_failed,
    values_of,
)
from experiments.calibrate.results import (
    Decision,
    FidelityResult,
    NoiseFloorResult,
    SurfaceResult,
    TargetResult,
)
from experiments.calibrate.values import interval_text, key_of, quantity
from experiments.studyfile import Study
from experiments.studyfile.campaign import FidelitySettings, Response

STAGE = "fidelity"

LEAST = 4
"""Fewest runs of the first round, apart from one a factor: shift, scale and noise need them."""

MIDDLE = 1000
"""Number of the run with every factor at its middle."""


OWN_SCALE = ("target", "verification", "fidelity")
"""Stages whose cases have the study's own scale where the design has a cheaper one."""


def measure_shifts(
    study: Study, settings: FidelitySettings, noise: NoiseFloorResult, runner: Runner
) -> FidelityResult:
    """Run the middle at the study's own scale, and compare it with the noise floor of the cheaper one."""
    responses = study.target.fitted
    center = pd.DataFrame([middle(study.factors)], index=[MIDDLE])
    cases = runner(plan_cases(study, STAGE, center, settings.middle, responses))
    shifts = {
        r.name: float(values_of(cases, STAGE, r).mean()) - noise.responses[r.name].mean for r in responses
    }
    said = [f"{r.name} {quantity(shifts[r.name], r.unit, '+')}" for r in responses]
    decision = Decision(
        STAGE,
        "The climb's target is moved by the difference of the two scales with every factor at its middle.",
        {key_of("difference", r): shifts[r.name] for r in responses},
        f"From the scale {settings.scale} to this one: {', '.join(said)}.",
    )
    return FidelityResult({}, settings.scale, shifts, cases, (decision,))


def moved_target(target: TargetResult, middles: FidelityResult) -> TargetResult:
    """Return the target as the cheaper scale is expected to give it."""
    moved = {
        name: Sample(sample.mean - middles.shifts.get(name, 0.0), sample.sd, sample.n)
        for name, sample in target.responses.items()
    }
    return replace(target, responses=moved)


def carry_surface(
    study: Study,
    settings: FidelitySettings,
    surface: SurfaceResult,
    target: TargetResult,
    middles: FidelityResult,
    runner: Runner,
) -> FidelityResult:
    """Move the surfaces to the study's own scale, by runs in two rounds; StageEnd where too few give a value.

    The first runs are chosen for the whole region of the design, the second for what is compatible then.
    """
    factors, responses = surface.design.factors, study.target.fitted
    sources = {
        name: found.reduced if found.reduced.terms else found.full
        for name, found in surface.responses.items()
    }
    joint = _joint(sources, target)
    first = max(settings.runs - settings.runs // 2, LEAST + len(factors))
    cells, made, cases = joint.cells[joint.explored], np.zeros((0, len(factors))), pd.DataFrame()
    for count in (first, max(settings.runs - first, 1)):
        points = spread_points(surface.leading.full, cells, count, made)
        natural = {f.name: f.to_natural(column) for f, column in zip(factors, points.T, strict=True)}
        runs = pd.DataFrame(natural, index=range(len(made) + 1, len(made) + count + 1))
        cases = pd.concat([cases, runner(plan_cases(study, STAGE, runs, 1, responses))], ignore_index=True)
        made, carried = np.vstack([made, points]), _carried(sources, target, cases, responses)
        joint = _joint(carried, target)
        mask = joint.region().mask
        cells = joint.cells[mask if mask.any() else joint.explored]
    said = [_decision(carried[r.name], target.responses[r.name], cases, r) for r in responses]
    whole = pd.concat([middles.cases, cases], ignore_index=True)
    return replace(middles, responses=carried, cases=whole, decisions=(*middles.decisions, *said))


def with_carried(surface: SurfaceResult, result: FidelityResult) -> SurfaceResult:
    """Return the surfaces with what they are at the study's own scale."""
    found = {name: replace(one, carried=result.responses[name]) for name, one in surface.responses.items()}
    return replace(surface, responses=found)


def _carried(
    sources: Mapping[str, Surface], target: TargetResult, cases: pd.DataFrame, responses: Iterable[Response]
) -> dict[str, Transfer]:
    """Move the surface of each response by the runs that gave it; StageEnd with too few."""
    found = {}
    for response in responses:
        runs = measured(cases, response)
        fit, level = sources[response.name], target.responses[response.name].mean
        try:
            found[response.name] = transfer(
                fit, runs, runs[response.observable].to_numpy(dtype=float), level, slopes=True
            )
        except DesignError as error:
            raise too_many_failed(cases, STAGE, f"cannot move the surface ({error})", response) from error
    return found


def _joint(fits: Mapping[str, Surface | Transfer], target: TargetResult) -> JointFit:
    return joint_fit({name: Goal(fit, target.responses[name]) for name, fit in fits.items()})


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
