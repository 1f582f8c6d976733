"""Stage (b): which factors move the responses, by a Plackett-Burman design."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from doe import Design, DesignError, Factor, ScreenResult, plackett_burman, screen
from experiments.calibrate.cases import (
    failure_summary,
    measured,
    plan_cases,
    response_table,
    too_many_failed,
)
from experiments.calibrate.results import Decision, Screened, ScreeningResult
from experiments.calibrate.values import key_of, p_text, quantity
from experiments.studyfile.campaign import CampaignStudy, Response, ScreeningSettings, scenes_of

STAGE = "screening"

LEAST_RUNS = 8
"""Runs of the smallest design that is chosen unasked: with 4, interactions fall wholly onto the factors."""


def screening_design(factors: Sequence[Factor], settings: ScreeningSettings) -> Design:
    """Return the design: as many runs as asked for, or the fewest with the wanted number of dummies."""
    if settings.runs is not None:
        return plackett_burman(factors, settings.runs)
    runs = max(LEAST_RUNS, 4 * -(-(len(factors) + settings.dummies + 1) // 4))
    return plackett_burman(factors, runs)


def plan_screening(study: CampaignStudy, design: Design) -> pd.DataFrame:
    """Lay out every run and replicate of the design."""
    settings, scenes = study.campaign, scenes_of(study.target.fitted)
    replicates, seed = settings.screening.replicates, settings.seeds.campaign
    return plan_cases(study.factors, STAGE, design.natural, replicates, seed, scenes)


def analyse_screening(design: Design, cases: pd.DataFrame, responses: Sequence[Response]) -> ScreeningResult:
    """Estimate and test the effects on every response from the cases that gave it.

    Raises
    ------
    StageEnd
        When too few runs are left to tell the factors apart.
    """
    runs = design.coded.index.tolist()
    found = {r.name: Screened(response_table(cases, r, runs), _screen(design, cases, r)) for r in responses}
    decisions = [_decision(design, cases, r, found[r.name].screen) for r in responses]
    return ScreeningResult(found, cases, design, tuple(decisions))


def _screen(design: Design, cases: pd.DataFrame, response: Response) -> ScreenResult:
    """Test against dummies and replicates together; where there is neither, against Lenth's pseudo error."""
    used = measured(cases, response)
    try:
        run = design.select(used["run"].tolist())
        spare = len(run.coded) - len(run.factors) - 1
        return screen(run, used[response.observable].to_numpy(), error="pooled" if spare > 0 else "lenth")
    except DesignError as error:
        raise too_many_failed(cases, STAGE, f"cannot be analysed any more ({error})", response) from error


def _decision(design: Design, cases: pd.DataFrame, response: Response, result: ScreenResult) -> Decision:
    first = result.table.sort_values("rank").iloc[0]
    replicates = int(cases["replicate"].max())
    against = {
        "pooled": "what the factors leave unexplained (dummy columns and replicates)",
        "lenth": "Lenth's pseudo standard error, the design having neither dummies nor replicates",
    }[result.error_rule]
    own = cases[cases["scene"] == response.scene]
    return Decision(
        STAGE,
        f"A Plackett-Burman design of {len(design.coded)} runs, {replicates} "
        f"{'case' if replicates == 1 else 'cases'} each; effects are tested against {against}.",
        {
            "runs": len(design.coded),
            "dummy columns": len(design.dummies),
            "error df": result.error_df,
            key_of("error sd", response): result.error_ms**0.5,
            "critical |t| at 0.10": result.critical_t(0.10),
            "critical |t| at 0.05": result.critical_t(0.05),
            "critical |t| at 0.05, Bonferroni": result.critical_t(0.05, bonferroni=True),
        },
        f"{first.name} moves the {response.name} most: {quantity(first['effect'], response.unit, '+')} from "
        f"low to high ({p_text(first['p'])}). {failure_summary(own, response)}".strip(),
    )
