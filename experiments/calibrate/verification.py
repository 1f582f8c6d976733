"""Stage (h): fresh heaps at the chosen point against the target."""

from __future__ import annotations

import pandas as pd

from doe import Comparison, Sample, compare_means
from experiments.calibrate.cases import Runner, angles_of, failure_summary, plan_cases, simulate
from experiments.calibrate.results import Decision, OptimumResult, VerificationResult
from experiments.calibrate.settings import CampaignStudy, VerificationSettings
from experiments.calibrate.values import p_text

STAGE = "verification"


def verify(
    study: CampaignStudy, optimum: OptimumResult, target: Sample, runner: Runner
) -> VerificationResult:
    """Simulate the chosen point with fresh seeds; test for a difference and for equivalence.

    Raises
    ------
    StageEnd
        When fewer than two cases gave an angle.
    """
    settings = study.campaign.verification
    point = pd.DataFrame([optimum.settings], index=[1])
    plan = plan_cases(study.factors, STAGE, point, settings.replicates, study.campaign.seeds.campaign)
    cases = simulate(runner, plan)[0]
    angles = angles_of(cases, STAGE)
    margin = settings.margin if settings.margin is not None else settings.margin_sds * target.sd
    comparison = compare_means(angles, target, margin=margin, alpha=settings.alpha)
    verified = not comparison.different and (bool(comparison.equivalent) or not settings.require_equivalence)
    decisions = (_difference(comparison, target, cases), _equivalence(comparison, settings))
    return VerificationResult(cases, angles, comparison, margin, verified, decisions)


def _difference(comparison: Comparison, target: Sample, cases: pd.DataFrame) -> Decision:
    low, high = comparison.interval
    found = "A difference is found" if comparison.different else "No difference is found"
    return Decision(
        STAGE,
        f"Pooled two-sample t-test of fresh heaps against the target at {comparison.alpha:g}.",
        {
            "mean of the heaps [deg]": comparison.a.mean,
            "sd of the heaps [deg]": comparison.a.sd,
            "heaps": comparison.a.n,
            "target [deg]": target.mean,
            "t": comparison.t,
            "df": comparison.df,
            "p": comparison.p,
        },
        f"{found} ({p_text(comparison.p)}): {comparison.difference:+.2f} deg, {1.0 - comparison.alpha:.0%} "
        f"interval {low:+.2f} to {high:+.2f} deg. {failure_summary(cases)}".strip(),
    )


def _equivalence(comparison: Comparison, settings: VerificationSettings) -> Decision:
    source = "the study" if settings.margin is not None else f"{settings.margin_sds:g} sd of the target"
    shown = "is shown" if comparison.equivalent else "is not shown"
    return Decision(
        STAGE,
        f"Two one-sided tests (TOST) of equivalence within {comparison.margin:.2f} deg ({source}).",
        {
            "margin [deg]": comparison.margin,
            "p of equivalence": comparison.equivalence_p,
            "smallest margin shown [deg]": comparison.smallest_margin,
        },
        f"Equivalence {shown} ({p_text(comparison.equivalence_p)}); these heaps show it from a margin of "
        f"{comparison.smallest_margin:.2f} deg on.",
    )
