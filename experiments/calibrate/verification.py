"""Stage (h): fresh heaps at the chosen point against the target."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from doe import Comparison, Sample, compare_means
from experiments.calibrate.cases import (
    Runner,
    failure_summary,
    plan_cases,
    scene_cases,
    simulate,
    values_of,
)
from experiments.calibrate.responses import scenes_of
from experiments.calibrate.results import Decision, OptimumResult, TargetResult, VerificationResult
from experiments.calibrate.settings import CampaignStudy, Response, VerificationSettings
from experiments.calibrate.values import p_text, quantity

STAGE = "verification"


def verify(
    study: CampaignStudy, optimum: OptimumResult, target: TargetResult, runner: Runner
) -> VerificationResult:
    """Simulate the chosen point with fresh seeds; test every response for a difference and for equivalence.

    The level of the tests is shared among the responses (Bonferroni).

    Raises
    ------
    StageEnd
        When fewer than two cases gave a response.
    """
    settings, responses = study.campaign.verification, study.target.responses
    point, seed = pd.DataFrame([optimum.settings], index=[1]), study.campaign.seeds.campaign
    plan = plan_cases(study.factors, STAGE, point, settings.replicates, seed, scenes_of(responses))
    finished = simulate(runner, plan)[0]
    cases, sample = scene_cases(finished), target.sample
    angles = values_of(cases, STAGE)
    margin = settings.margin if settings.margin is not None else settings.margin_sds * sample.sd
    alpha = settings.alpha / (1 + len(responses))
    comparison = compare_means(angles, sample, margin=margin, alpha=alpha)
    others = {}
    for response in responses:
        values = values_of(scene_cases(finished, response.scene), STAGE, response.observable)
        aim = target.responses[response.name]
        others[response.name] = compare_means(values, aim, margin=settings.margin_sds * aim.sd, alpha=alpha)
    decisions = [_difference(comparison, sample, cases), _equivalence(comparison, settings)]
    if others:
        decisions.append(_responses(responses, others))
    verified = all(_verified(test, settings) for test in (comparison, *others.values()))
    return VerificationResult(cases, angles, comparison, margin, verified, tuple(decisions), others)


def _verified(test: Comparison, settings: VerificationSettings) -> bool:
    """Whether fresh cases show no difference and, where the study asks for it, equivalence."""
    return not test.different and (bool(test.equivalent) or not settings.require_equivalence)


def _responses(responses: Sequence[Response], tests: dict[str, Comparison]) -> Decision:
    """Say how the further responses compare with their targets."""
    said: list[str] = []
    numbers: dict[str, float | None] = {}
    for response in responses:
        test, name = tests[response.name], response.name
        found = "differs" if test.different else "does not differ"
        aim = test.b.mean if isinstance(test.b, Sample) else test.b
        said.append(
            f"{name} {found} ({quantity(test.a.mean, response.unit)} against "
            f"{quantity(aim, response.unit)}, {p_text(test.p)})"
        )
        numbers |= {f"p of {name}": test.p, f"p of equivalence of {name}": test.equivalence_p}
    level = next(iter(tests.values())).alpha
    return Decision(
        STAGE,
        f"Fresh cases of every scene against the other responses' targets, each test at {level:.3g}: the "
        "level is shared among all responses.",
        numbers,
        f"At the chosen point {'; '.join(said)}.",
    )


def _difference(comparison: Comparison, target: Sample, cases: pd.DataFrame) -> Decision:
    low, high = comparison.interval
    found = "A difference is found" if comparison.different else "No difference is found"
    return Decision(
        STAGE,
        f"Welch's two-sample t-test of fresh heaps against the target at {comparison.alpha:g}.",
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
