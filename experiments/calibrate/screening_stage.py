"""Stage (b): the factors that move the responses, found by a screening design."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pandas as pd

from dem_warp.registry import Registry
from doe import Design, DesignError, Factor, ScreenResult, plackett_burman, screen
from experiments.calibrate.cases import failure_summary, measured, plan_cases, response_table, too_many_failed
from experiments.calibrate.results import Decision, Screened, ScreeningResult
from experiments.calibrate.values import key_of, p_text, quantity
from experiments.io.errors import InputError, shortened
from experiments.io.plug_ins import calling, made_in
from experiments.studyfile import Study
from experiments.studyfile.campaign import Response, ScreeningSettings

STAGE = "screening"


def _check(name: str, design: object, known: object) -> None:
    if not callable(design):
        raise TypeError(f"must be a function of factors and a number of runs, got {shortened(repr(design))}")


DESIGNS: Registry[Callable[[Sequence[Factor], int], Design]] = Registry(
    "dem_warp.designs", {"plackett-burman": plackett_burman}, _check
)
"""Screening designs of two levels by name, each made for some factors in a number of runs."""

LEAST_RUNS = 8
"""Runs of the smallest design that is chosen unasked: with 4, interactions fall wholly onto the factors."""


def screening_design(factors: Sequence[Factor], settings: ScreeningSettings) -> Design:
    """Make the design: as many runs as asked for, or the fewest with the wanted number of dummies."""
    if settings.design not in DESIGNS:
        raise ValueError(f"design must be one of {', '.join(DESIGNS)}, got {settings.design!r}")
    fewest = max(LEAST_RUNS, 4 * -(-(len(factors) + settings.dummies + 1) // 4))
    make, place = DESIGNS[settings.design], "campaign.screening.design"
    with calling(make, place):
        design = make(factors, settings.runs or fewest)
    if not isinstance(design, Design) or design.factors != tuple(factors):
        raise InputError(place, f"{made_in(make)} must return a doe.Design of the study's factors", design)
    return design


def plan_screening(study: Study, design: Design) -> pd.DataFrame:
    """Lay out every run and replicate of the design."""
    replicates = study.campaign.screening.replicates
    return plan_cases(study, STAGE, design.natural, replicates, study.target.fitted)


def analyse_screening(
    design: Design, cases: pd.DataFrame, responses: Sequence[Response], name: str = "plackett-burman"
) -> ScreeningResult:
    """Estimate and test the effects on every response from the cases that gave it, in a design of a name.

    StageEnd where too few runs are left to tell the factors apart.
    """
    runs = design.coded.index.tolist()
    found = {r.name: Screened(response_table(cases, r, runs), _screen(design, cases, r)) for r in responses}
    decisions = [_decision(name, design, cases, r, found[r.name].screen) for r in responses]
    return ScreeningResult(found, cases, design, tuple(decisions))


def _screen(design: Design, cases: pd.DataFrame, response: Response) -> ScreenResult:
    """Test against the dummies; where there are no dummies, against Lenth's pseudo error."""
    used = measured(cases, response)
    try:
        run = design.select(used["run"].tolist())
        return screen(run, used[response.observable].to_numpy())
    except DesignError as error:
        raise too_many_failed(cases, STAGE, f"cannot be analysed any more ({error})", response) from error


def _decision(
    name: str, design: Design, cases: pd.DataFrame, response: Response, result: ScreenResult
) -> Decision:
    first = result.table.sort_values("rank").iloc[0]
    replicates = int(cases["replicate"].max())
    against = {
        "dummies": "the dummy columns, which hold interactions as the factors' columns do",
        "lack of fit": "what the factors leave of the runs' means, the design having no dummy columns",
        "lenth": "Lenth's pseudo standard error, the design having no dummies",
    }[result.error_rule]
    return Decision(
        STAGE,
        f"A {name.title()} design of {len(design.coded)} runs, {replicates} "
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
        f"low to high ({p_text(first['p'])}). {failure_summary(cases, response)}".strip(),
    )
