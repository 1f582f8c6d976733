"""The target of a campaign: the measured angle, or in a twin study the heaps of hidden settings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import pandas as pd

from doe import Factor, Sample
from experiments.calibrate.cases import angles_of, failure_summary, middle, plan_cases
from experiments.calibrate.results import Decision, TargetResult
from experiments.calibrate.settings import MeasuredTarget, SeedSettings, TwinTarget

if TYPE_CHECKING:
    from experiments.calibrate.settings import CampaignStudy

STAGE = "target"


def plan_target(factors: Sequence[Factor], twin: TwinTarget, seeds: SeedSettings) -> pd.DataFrame:
    """Lay out the heaps of a twin study's target, with seeds that no case of the campaign has."""
    hidden = pd.DataFrame([middle(factors, twin.truth)], index=[1])
    return plan_cases(factors, STAGE, hidden, twin.replicates, seeds.target)


def measured_target(target: MeasuredTarget) -> TargetResult:
    """Take the measured angle as it is."""
    sample = Sample(target.mean, target.sd, target.n)
    decision = Decision(
        STAGE,
        "The target is the mean of the physical measurements.",
        _numbers(sample),
        f"The heaps must match {sample.mean:.2f} deg, known to {sample.se:.2f} deg (standard error).",
    )
    return TargetResult(sample, None, None, (decision,))


def twin_target(study: CampaignStudy, twin: TwinTarget, cases: pd.DataFrame) -> TargetResult:
    """Take the mean of simulated heaps as the target.

    Raises
    ------
    StageEnd
        When fewer than two heaps could be measured.
    """
    sample = Sample.of(angles_of(cases, STAGE))
    hidden = ", ".join(f"{name} = {value:g}" for name, value in twin.truth.items())
    decision = Decision(
        STAGE,
        f"A twin study: the target is the mean of {len(cases)} heaps simulated with settings that the later "
        "stages do not see.",
        _numbers(sample) | {f"hidden {name}": value for name, value in twin.truth.items()},
        f"The heaps must match {sample.mean:.2f} deg, known to {sample.se:.2f} deg (standard error); "
        f"hidden: {hidden}. {failure_summary(cases)}".strip(),
    )
    return TargetResult(sample, middle(study.factors, twin.truth), cases, (decision,))


def _numbers(sample: Sample) -> dict[str, float]:
    return {"mean [deg]": sample.mean, "sd [deg]": sample.sd, "n": sample.n, "se [deg]": sample.se}
