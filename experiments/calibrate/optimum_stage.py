"""Stage (g): the chosen point of the target contour, and everything that is as good."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress

import numpy as np
import pandas as pd

from doe import FactorSurface, Goal, JointFit, Region, Sample, Surface, TargetError, Transfer, joint_fit
from experiments.calibrate.cases import StageEnd, middle
from experiments.calibrate.direct_checks import check_direct
from experiments.calibrate.joint import choose_jointly, direct_decision, joint_decisions, ranges_of
from experiments.calibrate.results import (
    Decision,
    FittedResponse,
    OptimumResult,
    Outcome,
    SurfaceResult,
    TargetResult,
    TruthCheck,
)
from experiments.calibrate.values import (
    fixed_values,
    interval_text,
    key_of,
    listed,
    numbered_values,
    quantity,
    worded,
)
from experiments.studyfile import Study
from experiments.studyfile.campaign import OptimumSettings, Response

STAGE = "optimum"


def find_optimum(study: Study, surface: SurfaceResult, target: TargetResult) -> OptimumResult:
    """Choose a point on the target contour, or else nearest to the target, and map the compatible region.

    StageEnd where the surface of a single response contradicts the target in all that the design explored.
    """
    settings, fit, sample = study.campaign.optimum, surface.leading.final, target.leading
    reach = float(surface.design.coded.abs().to_numpy().max())
    response = study.target.leading
    goals = {name: Goal(found.final, target.responses[name]) for name, found in surface.responses.items()}
    goals |= {
        direct.name: Goal(FactorSurface(fit.design, direct.factor, direct.model_sd), direct.measured)
        for direct in study.direct
        if direct.factor in fit.design.names
    }
    joint = joint_fit(goals, alpha=1.0 - settings.confidence) if len(goals) > 1 else None
    alpha, radius = 1.0 - settings.confidence, _radius(surface)
    if joint is None:
        # The box of the two-level part first: inside it the fit is at its best. Axial points reach further.
        point, rule = _choose(study, surface, sample, sorted({1.0, reach}))
        region = fit.compatible_region(sample, alpha=alpha, extent=reach, radius=radius)
    else:
        (point, rule), region = choose_jointly(joint, settings), joint.region()
    prediction = fit.predict(point, alpha=1.0 - settings.confidence).iloc[0]
    # the full model's intervals are symmetric about its mean
    prediction["full_mean"] = float(prediction["confidence_low"] + prediction["confidence_high"]) / 2.0
    ranges = ranges_of(region, joint, study.limits)
    unidentified = _unidentified(settings, region, ranges)
    truth = (
        None
        if target.truth is None
        else _check_truth(fit, target, settings.confidence, (reach, radius), joint)
    )
    numbers = numbered_values("chosen", point) | {key_of("prediction", response): prediction["mean"]}
    if fit.dropped:
        numbers |= {key_of("prediction of the full model", response): prediction["full_mean"]}
    numbers |= {key_of("se of the fit", response): prediction["se"]}
    decisions = [
        Decision(
            STAGE,
            rule,
            numbers,
            f"Chosen: {listed(point)}; the {_predicted(surface.leading, prediction, response)}.",
        ),
        _region_decision(settings, region, ranges, unidentified, joint),
    ]
    if joint is not None:
        decisions += joint_decisions(joint, point, settings)
    checks = check_direct(study, joint, 1.0 - settings.confidence)
    if checks:
        decisions.append(direct_decision(checks))
    if truth is not None:
        decisions.append(
            _truth_decision(truth, sample.mean, response, "reduced surface" if fit.dropped else "surface")
        )
    return OptimumResult(
        point=point,
        settings=middle(study.factors, point),
        prediction=prediction,
        extent=region.extent,
        contour=fit.contour(sample.mean, region.extent),
        region=region,
        ranges=ranges,
        unidentified=unidentified,
        truth=truth,
        decisions=tuple(decisions),
        joint=joint,
        direct=checks,
    )


def _predicted(found: FittedResponse, prediction: pd.Series, response: Response) -> str:
    """Write what the surface predicts, with the model that each number comes from."""
    unit, mean = response.unit, quantity(prediction["mean"], response.unit)
    interval = interval_text((prediction["confidence_low"], prediction["confidence_high"]), unit)
    if not found.final.dropped:
        return f"surface of the {response.name} predicts {mean} ({interval})"
    full = f"the full one, whose errors count, {quantity(prediction['full_mean'], unit)} ({interval})"
    return f"reduced surface of the {response.name} predicts {mean}; {full}"


def _choose(
    study: Study, surface: SurfaceResult, target: Sample, extents: list[float]
) -> tuple[dict[str, float], str]:
    """Return the chosen point, and the rule that chose it."""
    fit = surface.leading.final
    fixed = fixed_values(study.campaign.optimum.point, surface.center)
    if fixed is not None:
        return fixed, "The study fixes the chosen point."
    rule = "The chosen point is the one of the target contour nearest to the design's centre, in coded units."
    radius = _radius(surface)
    for extent in extents:
        try:
            point = {
                str(name): float(value) for name, value in fit.nearest(target.mean, extent=extent).items()
            }
        except TargetError as error:
            missed = str(error)
            continue
        if np.linalg.norm(_coded(fit, point)) <= radius:
            return point, rule
        missed = f"the target contour lies beyond the design's runs, nearest at {worded(study, point)}"
    alpha = 1.0 - study.campaign.optimum.confidence
    if closest := _closest(fit, target, extents[-1], radius, alpha):
        rule = (
            "No point of the design's region gives the target: the chosen one comes closest, by no more than "
            "the errors of fit and target together explain."
        )
        return closest, rule
    raise StageEnd(
        Outcome.NO_CONTOUR,
        f"No point of the composite design's region gives the target: {missed}. Fix surface.center nearer to "
        "the contour, widen surface.half_range, or replicate the climb so that its crossing is better known.",
    )


def _radius(surface: SurfaceResult) -> float:
    """Return the coded distance of the farthest run from the centre: that run itself is inside."""
    return float(np.linalg.norm(surface.design.points.to_numpy(), axis=1).max()) * (1.0 + 1e-9)


def _closest(
    fit: Surface | Transfer, target: Sample, extent: float, radius: float, alpha: float
) -> dict[str, float] | None:
    """Return the compatible point among the runs whose fit is closest to the target, None where none is."""
    region = fit.compatible_region(target, alpha=alpha, extent=extent, radius=radius)
    distance = np.linalg.norm(region.coded.to_numpy(), axis=1)
    cells = np.flatnonzero(region.mask)
    if not len(cells):
        return None
    gap = np.abs(fit.evaluate(region.coded.iloc[cells].to_numpy())[0] - target.mean)
    # of cells that are as close, the one nearest to the centre
    best = cells[np.lexsort((distance[cells], gap.round(9)))[0]]
    return {str(name): float(value) for name, value in region.natural.iloc[best].items()}


def _coded(fit: Surface | Transfer, point: Mapping[str, float]) -> np.ndarray:
    return np.array([float(factor.to_coded(point[factor.name])) for factor in fit.design.factors])


def _reach(fit: Surface | Transfer, point: Mapping[str, float]) -> float:
    """Return the largest coded coordinate of a point, by size."""
    return float(np.abs(_coded(fit, point)).max())


def _unidentified(settings: OptimumSettings, region: Region, ranges: pd.DataFrame) -> tuple[str, ...]:
    """Return the factors whose ranges span too much of the design's region."""
    if not region.mask.any():
        return ()
    explored = {factor.name: 2.0 * region.extent * factor.half_range for factor in region.factors}
    share = (ranges["high"] - ranges["low"]) / pd.Series(explored)
    return tuple(str(name) for name in share.index[share > settings.unidentified_span])


def _check_truth(
    fit: Surface | Transfer,
    target: TargetResult,
    confidence: float,
    reach: tuple[float, float],
    joint: JointFit | None,
) -> TruthCheck:
    """Say where the hidden settings lie; factors that were not kept are at their middle in the fit."""
    truth, sample = target.truth or {}, target.leading
    values = {name: truth[name] for name in fit.design.names}
    coded, far = _coded(fit, values), _reach(fit, values)
    distance = None
    with suppress(TargetError):  # a point fixed in the study needs no contour
        nearest = fit.nearest(sample.mean, to=values, extent=max(reach[0], far))
        distance = float(np.linalg.norm(_coded(fit, dict(nearest)) - coded))
    predicted = fit.predict(values).iloc[0]
    inside = far <= reach[0] and float(np.linalg.norm(coded)) <= reach[1]
    agrees = joint.agrees(values) if joint else fit.agrees(values, sample, 1.0 - confidence)
    compatible = agrees if inside else None
    return TruthCheck(values, inside, compatible, distance, float(predicted["mean"]))


def _region_decision(
    settings: OptimumSettings,
    region: Region,
    ranges: pd.DataFrame,
    unidentified: tuple[str, ...],
    joint: JointFit | None,
) -> Decision:
    numbers = {"share of the region": region.fraction, "extent, coded": region.extent}
    for name, ends in ranges.iterrows():
        for end in ("low", "high"):
            numbers[f"{end} of {name}" + ", not explored beyond" * bool(ends[f"{end}_open"])] = ends[end]
    outcome = f"{region.fraction:.0%} of the design region is compatible with the target."
    if len(region.factors) > 1 and joint is None:
        outcome += " The target is one equation: the factors trade off along its contour."
    opened = ranges[["low_open", "high_open"]].set_axis(["low", "high"], axis=1).astype(bool)
    ends = [f"{name} ({end})" for name, row in opened.iterrows() for end in row.index[row]]
    if ends:
        outcome += f" Ranges that end at the edge of what was explored: {', '.join(ends)}."
    if unidentified:
        alone = "by this target alone" if joint is None else "by these responses"
        outcome += f" Not pinned down {alone}: {', '.join(unidentified)}."
    of_each, its = "", "its compatible values span"
    if joint is not None:
        of_each = " for each of the responses, the level shared among them"
        its = f"its interval ({settings.confidence:.0%}, the others free) spans"
    return Decision(
        STAGE,
        f"A setting is compatible when fit and target differ by no more than their errors together explain "
        f"({settings.confidence:.0%}){of_each}; a factor is pinned down when {its} at "
        f"most {settings.unidentified_span:.0%} of the region.",
        numbers,
        outcome,
    )


def _truth_decision(truth: TruthCheck, target: float, response: Response, model: str) -> Decision:
    verdict = {
        True: "The hidden truth lies in the compatible region: recovered as far as the target can tell.",
        False: "The hidden truth lies outside the compatible region: it was not recovered.",
        None: "The hidden truth lies outside the region that the design explored: nothing can be said.",
    }[truth.compatible]
    distance = "The surface has no contour of the target"
    if truth.distance is not None:
        distance = f"It is {truth.distance:.2f} coded units from the contour"
    return Decision(
        STAGE,
        "A twin study: the hidden settings are looked up in the compatible region.",
        numbered_values("hidden", truth.values)
        | {"distance to the contour, coded": truth.distance}
        | {key_of("prediction at the truth", response): truth.predicted, key_of("target", response): target},
        f"{verdict} {distance}; the {model} predicts "
        f"{quantity(truth.predicted, response.unit)} there, the target is {quantity(target, response.unit)}.",
    )
