"""The target of a campaign: what was measured, or in a twin study the cases of hidden settings."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from doe import Sample
from experiments.calibrate.cases import failure_summary, middle, plan_cases, values_of
from experiments.calibrate.results import Decision, TargetResult
from experiments.calibrate.values import key_of, numbered_values, quantity
from experiments.studyfile import Study
from experiments.studyfile.campaign import Response

STAGE = "target"


def plan_target(study: Study) -> pd.DataFrame:
    """Lay out the cases of a twin study's target, with seeds that no case of the campaign has."""
    target = study.target
    if target.twin is None:
        raise ValueError("a measured target has no cases")
    hidden = pd.DataFrame([middle(study.factors, target.twin.truth)], index=[1])
    return plan_cases(study, STAGE, hidden, target.twin.replicates, target.responses)


def settle_target(
    study: Study, cases: pd.DataFrame | None = None, samples: Mapping[str, Sample] | None = None
) -> TargetResult:
    """Take what was measured, or in a twin study what its cases give; StageEnd with fewer than two values.

    Some ``samples`` of a twin study may be known already: of directions of a profile.
    """
    target, known = study.target, samples or {}
    samples = {r.name: known[r.name] if r.name in known else _sample(r, cases) for r in target.responses}
    numbers: dict[str, float] = {}
    for response, sample in zip(target.responses, samples.values(), strict=True):
        for what in ("mean", "sd", "se"):
            numbers[key_of(what, response)] = getattr(sample, what)
        numbers[f"n of {response.name}"] = sample.n
    aims = [
        f"{r.name} {quantity(s.mean, r.unit)}, known to {quantity(s.se, r.unit)}"
        for r, s in zip(target.responses, samples.values(), strict=True)
    ]
    outcome = f"To be matched: {'; '.join(aims)} (standard error)."
    rule, truth = "The target is the mean of the physical measurements.", None
    if target.twin is not None and cases is not None:
        truth = middle(study.factors, target.twin.truth)
        numbers |= numbered_values("hidden", target.twin.truth)
        hidden = ", ".join(f"{name} = {value:g}" for name, value in target.twin.truth.items())
        rule = (
            f"A twin study: the target is the mean of {len(cases)} cases simulated with settings that the "
            "later stages do not see."
        )
        outcome = f"{outcome} Hidden: {hidden}. {failure_summary(cases, *target.responses)}".strip()
    return TargetResult(samples, truth, cases, (Decision(STAGE, rule, numbers, outcome),))


def _sample(response: Response, cases: pd.DataFrame | None) -> Sample:
    if response.measured is not None:
        return response.measured
    if cases is None:
        raise ValueError("a twin study's target needs its cases")
    return Sample.of(values_of(cases, STAGE, response))
