"""Stage (b): which factors move the angle, by a Plackett-Burman design."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from doe import Design, DesignError, Factor, ScreenResult, plackett_burman, screen
from experiments.calibrate.cases import (
    failure_summary,
    measured,
    plan_cases,
    response_table,
    scene_cases,
    too_many_failed,
)
from experiments.calibrate.responses import each_response, scenes_of
from experiments.calibrate.results import Decision, ScreeningResult
from experiments.calibrate.settings import ANGLE, Response, ScreeningSettings, SeedSettings
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
    factors: Sequence[Factor],
    design: Design,
    settings: ScreeningSettings,
    seeds: SeedSettings,
    responses: Sequence[Response] = (),
) -> pd.DataFrame:
    """Lay out every run and replicate of the design."""
    scenes = scenes_of(responses)
    return plan_cases(factors, STAGE, design.natural, settings.replicates, seeds.campaign, scenes)


def analyse_screening(
    design: Design, cases: pd.DataFrame, responses: Sequence[Response] = ()
) -> ScreeningResult:
    """Estimate and test the effects on every response from the cases that gave it.

    Raises
    ------
    StageEnd
        When too few runs are left to tell the factors apart.
    """
    heaps = scene_cases(cases)
    result = _screen(design, heaps, ANGLE)
    others = each_response(responses, cases, lambda found, column: _screen(design, found, column))
    response = response_table(heaps, design.coded.index.tolist())
    decisions = [_decision(design, heaps, result)]
    if others:
        decisions.append(_responses(others))
    return ScreeningResult(heaps, design, response, result, tuple(decisions), others)


def _screen(design: Design, cases: pd.DataFrame, observable: str) -> ScreenResult:
    """Test against the dummies; where there are none, against Lenth's pseudo error."""
    used = measured(cases, observable)
    try:
        run = design.select(used["run"].tolist())
        return screen(run, used[observable].to_numpy())
    except DesignError as error:
        need = f"cannot be analysed any more ({error})"
        raise too_many_failed(cases, STAGE, need, observable) from error


def _responses(screens: dict[str, ScreenResult]) -> Decision:
    """Say what moves every further response most."""
    strongest = []
    for name, result in screens.items():
        first = result.table.sort_values("rank").iloc[0]
        strongest.append(
            f"{name}: {first.name} ({first['effect']:+.4g} from low to high, {p_text(first['p'])})"
        )
    return Decision(
        STAGE,
        "The effects on every further response are tested on the same design, each against its own error.",
        {f"error sd of {name}": result.error_ms**0.5 for name, result in screens.items()},
        f"What moves them most: {'; '.join(strongest)}.",
    )


def _decision(design: Design, cases: pd.DataFrame, result: ScreenResult) -> Decision:
    ranked = result.table.sort_values("rank")
    strongest = ranked.index[0]
    replicates = int(cases["replicate"].max())
    against = {
        "dummies": "the dummy columns, which hold interactions as the factors' columns do",
        "lenth": "Lenth's pseudo standard error, the design having no dummies",
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
