"""The target of a campaign: the measured angle, or in a twin study the heaps of hidden settings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import pandas as pd

from doe import Factor, Sample
from experiments.calibrate.cases import failure_summary, middle, plan_cases, scene_cases, values_of
from experiments.calibrate.responses import each_response, scenes_of
from experiments.calibrate.results import Decision, TargetResult
from experiments.calibrate.values import quantity
from experiments.studyfile.campaign import MeasuredTarget, Response, SeedSettings, TwinTarget

if TYPE_CHECKING:
    from experiments.studyfile.campaign import CampaignStudy

STAGE = "target"


def plan_target(factors: Sequence[Factor], twin: TwinTarget, seeds: SeedSettings) -> pd.DataFrame:
    """Lay out the cases of a twin study's target, with seeds that no case of the campaign has."""
    hidden = pd.DataFrame([middle(factors, twin.truth)], index=[1])
    return plan_cases(factors, STAGE, hidden, twin.replicates, seeds.target, scenes_of(twin.responses))


def measured_target(target: MeasuredTarget) -> TargetResult:
    """Take the measured angle, and what else was measured, as it is."""
    sample = Sample(target.mean, target.sd, target.n)
    decision = Decision(
        STAGE,
        "The target is the mean of the physical measurements.",
        _numbers(sample),
        f"The heaps must match {sample.mean:.2f} deg, known to {sample.se:.2f} deg (standard error).",
    )
    others = {r.name: Sample(r.mean, r.sd, r.n) for r in target.responses}
    return TargetResult(sample, None, None, (decision, *_responses(target.responses, others)), others)


def twin_target(study: CampaignStudy, twin: TwinTarget, cases: pd.DataFrame) -> TargetResult:
    """Take the mean of simulated heaps as the target.

    Raises
    ------
    StageEnd
        When fewer than two heaps could be measured.
    """
    heaps = scene_cases(cases)
    sample = Sample.of(values_of(heaps, STAGE))
    others = each_response(
        twin.responses, cases, lambda found, column: Sample.of(values_of(found, STAGE, column))
    )
    hidden = ", ".join(f"{name} = {value:g}" for name, value in twin.truth.items())
    decision = Decision(
        STAGE,
        f"A twin study: the target is the mean of {len(heaps)} heaps simulated with settings that the later "
        "stages do not see.",
        _numbers(sample) | {f"hidden {name}": value for name, value in twin.truth.items()},
        f"The heaps must match {sample.mean:.2f} deg, known to {sample.se:.2f} deg (standard error); "
        f"hidden: {hidden}. {failure_summary(heaps)}".strip(),
    )
    decisions = (decision, *_responses(twin.responses, others))
    return TargetResult(sample, middle(study.factors, twin.truth), heaps, decisions, others)


def _numbers(sample: Sample) -> dict[str, float]:
    return {"mean [deg]": sample.mean, "sd [deg]": sample.sd, "n": sample.n, "se [deg]": sample.se}


def _responses(responses: Sequence[Response], samples: dict[str, Sample]) -> list[Decision]:
    """Say what else must be matched; nothing where the angle is alone."""
    if not samples:
        return []
    aims = [
        f"{r.name} {quantity(samples[r.name].mean, r.unit)}, known to {quantity(samples[r.name].se, r.unit)}"
        for r in responses
    ]
    numbers: dict[str, float] = {}
    for r in responses:
        unit = "" if r.unit == "1" else f" [{r.unit}]"
        numbers |= {f"{r.name}{unit}": samples[r.name].mean, f"sd of {r.name}{unit}": samples[r.name].sd}
    return [
        Decision(
            STAGE,
            "Beside the angle stand further responses, each with its own measurements.",
            numbers,
            f"To be matched too: {'; '.join(aims)} (standard error).",
        )
    ]
