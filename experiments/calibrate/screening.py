"""Stage (b): which factors move the angle, by a Plackett-Burman design."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from doe import Design, DesignError, Factor, ScreenResult, plackett_burman, screen
from experiments.calibrate.cases import failure_summary, measured, plan_cases, response_table, too_many_failed
from experiments.calibrate.results import Decision, ScreeningResult
from experiments.calibrate.settings import ScreeningSettings, SeedSettings
from experiments.calibrate.values import p_text

STAGE = "screening"

LEAST_RUNS = 8
"""Runs of the smallest design that is chosen unasked: with 4, interactions fall wholly onto the factors."""


def screening_design(factors: Sequence[Factor], settings: ScreeningSettings) -> Design:
    """Return the design: as many runs as asked for, or the fewest with the wanted number of dummies."""
    if settings.runs is not None:
        return plackett_burman(factors, settings.runs)
    runs = max(LEAST_RUNS, 4 * -(-(len(factors) + settings.dummies + 1) // 4))
    return plackett_burman(factors, runs)


def plan_screening(
    factors: Sequence[Factor], design: Design, settings: ScreeningSettings, seeds: SeedSettings
) -> pd.DataFrame:
    """Lay out every run and replicate of the design."""
    return plan_cases(factors, STAGE, design.natural, settings.replicates, seeds.campaign)


def analyse_screening(design: Design, cases: pd.DataFrame) -> ScreeningResult:
    """Estimate and test the effects from the cases that gave an angle.

    Raises
    ------
    StageEnd
        When too few runs are left to tell the factors apart.
    """
    used = measured(cases)
    try:
        result = _screen(design.select(used["run"].tolist()), used["angle"])
    except DesignError as error:
        raise too_many_failed(cases, STAGE, f"cannot be analysed any more ({error})") from error
    response = response_table(cases, design.coded.index.tolist())
    return ScreeningResult(cases, design, response, result, (_decision(design, cases, result),))


def _screen(design: Design, angles: pd.Series) -> ScreenResult:
    """Test against dummies and replicates together; where there is neither, against Lenth's pseudo error."""
    spare = len(design.coded) - len(design.factors) - 1
    return screen(design, angles.to_numpy(), error="pooled" if spare > 0 else "lenth")


def _decision(design: Design, cases: pd.DataFrame, result: ScreenResult) -> Decision:
    ranked = result.table.sort_values("rank")
    strongest = ranked.index[0]
    replicates = int(cases["replicate"].max())
    against = {
        "pooled": "what the factors leave unexplained (dummy columns and replicates)",
        "lenth": "Lenth's pseudo standard error, the design having neither dummies nor replicates",
    }[result.error_rule]
    return Decision(
        STAGE,
        f"A Plackett-Burman design of {len(design.coded)} runs, {replicates} "
        f"{'case' if replicates == 1 else 'cases'} each; effects are tested against {against}.",
        {
            "runs": len(design.coded),
            "dummy columns": len(design.dummies),
            "error df": result.error_df,
            "error sd [deg]": result.error_ms**0.5,
            "critical |t| at 0.10": result.critical_t(0.10),
            "critical |t| at 0.05": result.critical_t(0.05),
            "critical |t| at 0.05, Bonferroni": result.critical_t(0.05, bonferroni=True),
        },
        f"{strongest} moves the angle most: {ranked['effect'].iloc[0]:+.2f} deg from low to high "
        f"({p_text(ranked['p'].iloc[0])}). {failure_summary(cases)}".strip(),
    )
