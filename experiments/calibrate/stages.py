"""The campaign: the stages in their order, each on the results of those before it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, TypeVar

import pandas as pd

from doe import Design
from experiments.calibrate.campaign import Campaign
from experiments.calibrate.cases import Runner, StageEnd, with_combinations
from experiments.calibrate.checks import check_calibration
from experiments.calibrate.climb_stage import climb, require_crossing
from experiments.calibrate.directions import with_directions
from experiments.calibrate.fidelity_stage import carry_surface, with_carried
from experiments.calibrate.noise_stage import analyse_noise_floor, plan_noise_floor
from experiments.calibrate.optimum_stage import find_optimum
from experiments.calibrate.results import (
    NoiseFloorResult,
    OptimumResult,
    Outcome,
    ScreeningResult,
    StageResult,
    TargetResult,
    VerificationResult,
)
from experiments.calibrate.screening_stage import analyse_screening, plan_screening, screening_design
from experiments.calibrate.selection_stage import require_kept, select_factors
from experiments.calibrate.surface_stage import (
    Box,
    climbed_box,
    explore_surface,
    fixed_box,
    plan_surface,
    require_slope,
)
from experiments.calibrate.target_stage import plan_target, settle_target
from experiments.calibrate.values import p_text, quantity, worded
from experiments.calibrate.verification_stage import plan_verification, verify
from experiments.calibrate.worth import useless_tests
from experiments.studyfile import Study
from experiments.studyfile.campaign import Response

Found = TypeVar("Found", bound=StageResult)

StageHook = Callable[[str, StageResult], None]
"""Called with the name and the result of every stage as it is finished."""


def calibrate(study: Study, runner: Runner, on_stage: StageHook | None = None) -> Campaign:
    """Run a calibration campaign.

    Parameters
    ----------
    runner
        Simulates all rows of a table at once, each in its ``scene``, and returns them with ``status``,
        ``reason`` and observables, NaN where there is no value; a case that fails is a row,
        never an exception. Called once for the target, the noise floor and the screening together, then once
        for each batch of the climb, for the surface and for the verification. Where the study fixes the
        design, cases of later stages come with an earlier call too, and again with their own: a runner
        remembers what it simulated.
    on_stage
        Called with the name and the result of every finished stage.

    Returns
    -------
    Campaign
        The results of every stage that was reached, and the outcome: a campaign that cannot go on ends with a
        stated outcome, not with an exception.

    Raises
    ------
    ValueError
        When a setting does not fit the study's factors; nothing is simulated then.
    """
    check_calibration(study)
    record = _Record(runner, on_stage, study.target.responses)
    try:
        outcome, reason = _run(study, record)
    except StageEnd as end:
        outcome, reason = end.outcome, end.reason
    cases, target = pd.concat(record.tables, ignore_index=True), record.responses
    return Campaign(
        tuple(study.factors),
        target,
        study.campaign,
        outcome,
        reason,
        cases,
        **record.stages,
        direct=study.direct,
    )


class _Record:
    """Cases and results of a campaign so far."""

    def __init__(self, runner: Runner, on_stage: StageHook | None, responses: Sequence[Response]) -> None:
        self.stages: dict[str, Any] = {}
        self.tables: list[pd.DataFrame] = []
        self.ahead: list[pd.DataFrame] = []
        """Cases of later stages that the next batch simulates too."""
        self.responses = tuple(responses)
        """Responses that are matched."""
        self._runner, self._on_stage = runner, on_stage

    def run(self, table: pd.DataFrame) -> pd.DataFrame:
        """Simulate a table of cases, and those ahead with it, and remember the table's."""
        if self.ahead:
            self._runner(pd.concat([table, *self.ahead], ignore_index=True))
            self.ahead = []
        self.tables.append(self.look(table))
        return self.tables[-1]

    def look(self, table: pd.DataFrame) -> pd.DataFrame:
        """Simulate a table of cases before their stage."""
        return with_combinations(self._runner(table), self.responses)

    def match(self, responses: Sequence[Response]) -> pd.DataFrame:
        """Match other responses from now on; return the cases of the last table with their columns."""
        self.responses = tuple(responses)
        self.tables = [with_combinations(cases, self.responses) for cases in self.tables]
        return self.tables[-1]

    def keep(self, name: str, result: Found) -> Found:
        """Remember the result of a stage, report it and hand it back."""
        self.stages[name] = result
        if self._on_stage is not None:
            self._on_stage(name, result)
        return result


def _run(study: Study, record: _Record) -> tuple[Outcome, str]:
    """Run the stages one after another and return the outcome; StageEnd where the campaign cannot go on."""
    study, target, noise, screening = _open(study, record)
    settings, response = study.campaign.selection, study.target.leading
    selection = select_factors(settings, screening, noise, response)
    useless = useless_tests(study, selection.kept, target, noise, screening) if selection.kept else ()
    record.keep("selection", replace(selection, decisions=(*selection.decisions, *useless)))
    require_kept(study, selection)
    box = fixed_box(study, selection.kept)
    early = _early_optimum(study, box, target, record)
    record.ahead = [plan_verification(study, early)] if early else []
    path = climb(study, screening, selection.kept, noise, target, record.run)
    require_crossing(study, record.keep("climb", path), target)
    box = box or climbed_box(study, path)
    surface = record.keep("surface", explore_surface(study, box, record.run))
    require_slope(study, surface, path)
    if fidelity := study.campaign.fidelity:
        moved = carry_surface(study, fidelity, path, surface, target, record.run)
        surface = record.stages["surface"] = with_carried(surface, record.keep("fidelity", moved))
    optimum = record.keep("optimum", early or find_optimum(study, surface, target))
    verification = record.keep("verification", verify(study, optimum, target, record.run))
    return _verdict(study, optimum, verification)


def _early_optimum(
    study: Study, box: Box | None, target: TargetResult, record: _Record
) -> OptimumResult | None:
    """Find the optimum before the climb where it needs none, so that both stages simulate together.

    None where it needs the climb, or where the campaign ends before it, as it will say in its order.
    """
    if box is None or study.campaign.fidelity:
        return None
    with suppress(StageEnd):
        surface = explore_surface(study, box, record.look)
        if surface.leading.reduced.terms:
            return find_optimum(study, surface, target)
    return None


def _open(study: Study, record: _Record) -> tuple[Study, TargetResult, NoiseFloorResult, ScreeningResult]:
    """Run the stages that wait for nothing, in one batch: a twin's target, the noise floor, the screening.

    With them run the cases of a surface that the study fixes. They are in no result if a stage before the
    surface ends the campaign, for which these stages or the climb must lack nearly all their values.

    The study goes on with fewer responses where it has a profile.
    """
    design = screening_design(study.factors, study.campaign.screening)
    record.ahead = plan_ahead(study)
    *hidden, _, screening_cases = _by_stage(record.run(plan_opening(study, design)))
    study, samples = with_directions(study, design, screening_cases, hidden)
    *hidden, noise_cases, screening_cases = _by_stage(record.match(study.target.responses))
    target = record.keep("target", settle_target(study, next(iter(hidden), None), samples))
    noise = record.keep("noise_floor", analyse_noise_floor(study, noise_cases))
    name = study.campaign.screening.design
    screening = analyse_screening(design, screening_cases, study.target.fitted, name)
    return study, target, noise, record.keep("screening", screening)


def _by_stage(cases: pd.DataFrame) -> list[pd.DataFrame]:
    return [found.reset_index(drop=True) for _, found in cases.groupby("stage", sort=False)]


def plan_opening(study: Study, design: Design) -> pd.DataFrame:
    """Lay out the cases of the stages that wait for nothing."""
    plans = [plan_noise_floor(study), plan_screening(study, design)]
    if study.target.twin is not None:
        plans = [plan_target(study), *plans]
    return pd.concat(plans, ignore_index=True)


def plan_ahead(study: Study) -> list[pd.DataFrame]:
    """Lay out the cases of the surface if the study fixes its factors, centre and half-ranges."""
    keep = study.campaign.selection.keep or ()
    kept = [factor.name for factor in study.factors if factor.name in keep]
    box = fixed_box(study, kept)
    return [plan_surface(study, box)[1]] if box else []


def _verdict(study: Study, optimum: OptimumResult, verification: VerificationResult) -> tuple[Outcome, str]:
    """Say how a campaign that reached its last stage ended."""
    tests = [(response, verification.responses[response.name]) for response in study.target.responses]
    gave = [
        f"{r.name} {quantity(test.a.mean, r.unit)} against {quantity(test.a.mean - test.difference, r.unit)} "
        f"(difference {quantity(test.difference, r.unit, '+')}, {p_text(test.p)})"
        for r, test in tests
    ]
    found = f"At {worded(study, optimum.point)} fresh cases gave {'; '.join(gave)}"
    if missed := [r.name for r, test in tests if test.different]:
        return Outcome.MISSED, f"{found}: the chosen point misses the target of {', '.join(missed)}."
    shown, unproven = (
        [f"{r.name} within {quantity(test.margin or 0.0, r.unit)}" for r, test in tests if equal(test)]
        for equal in (lambda test: test.equivalent, lambda test: not test.equivalent)
    )
    said = f"; equivalence is shown for {', '.join(shown)}" if shown else ""
    as_good = f"{optimum.region.fraction:.0%} of the settings that the surface covers are compatible with it."
    if optimum.pins_nothing:
        as_good += " None of the values is pinned down."
    if verification.verified:
        return Outcome.CALIBRATED, f"{found}{said}. {as_good}"
    said += f"{', but not' if shown else ', but equivalence is not shown'} for {', '.join(unproven)}"
    return Outcome.UNDECIDED, f"{found}: no difference is found{said}: add replicates. {as_good}"
