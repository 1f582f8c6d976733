"""Stage (h): fresh cases at the chosen point against the target."""

from __future__ import annotations

import pandas as pd

from doe import Comparison, compare_means
from experiments.calibrate.cases import Runner, failure_summary, plan_cases, values_of
from experiments.calibrate.results import Decision, OptimumResult, TargetResult, VerificationResult
from experiments.calibrate.values import interval_text, key_of, p_text, quantity
from experiments.studyfile import Study
from experiments.studyfile.campaign import Response

STAGE = "verification"


def plan_verification(study: Study, optimum: OptimumResult) -> pd.DataFrame:
    """Lay out fresh cases at the chosen point, in every scene that measures a response."""
    point, count = pd.DataFrame([optimum.settings], index=[1]), study.campaign.verification.replicates
    return plan_cases(study, STAGE, point, count, study.target.responses)


def verify(study: Study, optimum: OptimumResult, target: TargetResult, runner: Runner) -> VerificationResult:
    """Simulate the chosen point with fresh seeds; test every response for a difference and for equivalence.

    The level of the tests for a difference is shared among the responses (Bonferroni). That of equivalence is
    not: all must show it. StageEnd with fewer than two values.
    """
    settings, responses = study.campaign.verification, study.target.responses
    cases = runner(plan_verification(study, optimum))
    alpha = settings.alpha / len(responses)
    tests = {}
    for response in responses:
        aim = target.responses[response.name]
        margin = settings.margin if response is responses[0] else None
        margin = settings.margin_sds * aim.sd if margin is None else margin
        values = values_of(cases, STAGE, response)
        tests[response.name] = compare_means(
            values, aim, margin=margin, alpha=alpha, equivalence_alpha=settings.alpha
        )
    verified = all(test.equivalent and not test.different for test in tests.values())
    decisions = [_decision(response, tests[response.name], cases) for response in responses]
    return VerificationResult(tests, cases, verified, tuple(decisions))


def _decision(response: Response, test: Comparison, cases: pd.DataFrame) -> Decision:
    """Say how fresh cases compare with the target of a response."""
    found = "A difference is found" if test.different else "No difference is found"
    shown = "is shown" if test.equivalent else "is not shown"
    unit = response.unit
    held_out = ", which took no part in the fit" if response.held_out else ""
    margin, smallest = (quantity(value, unit) for value in (test.margin or 0.0, test.smallest_margin))
    return Decision(
        STAGE,
        f"Welch's two-sample t-test of fresh cases against the target of the {response.name}{held_out}, at "
        f"{test.alpha:.3g}, and two one-sided tests (TOST) of equivalence within {margin}, at "
        f"{test.equivalence_alpha:.3g}.",
        {
            key_of("mean", response): test.a.mean,
            key_of("sd", response): test.a.sd,
            "cases": test.a.n,
            key_of("target", response): test.a.mean - test.difference,
            "t": test.t,
            "df": test.df,
            "p": test.p,
            key_of("margin", response): test.margin,
            "p of equivalence": test.equivalence_p,
            key_of("smallest margin shown", response): test.smallest_margin,
        },
        f"{found} ({p_text(test.p)}): {quantity(test.difference, unit, '+')}, "
        f"{100.0 * (1.0 - test.alpha):.3g} % interval {interval_text(test.interval, unit, '+')}. "
        f"Equivalence {shown} ({p_text(test.equivalence_p)}); these cases show it from a margin of "
        f"{smallest} on. {failure_summary(cases, response)}".strip(),
    )
