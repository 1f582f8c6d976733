"""The campaign: the stages in their order, each on the results of those before it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import pandas as pd

from doe import Sample
from experiments.calibrate.cases import Runner, StageEnd, simulate
from experiments.calibrate.checks import check_study
from experiments.calibrate.climb import climb, require_crossing
from experiments.calibrate.noise_floor import analyse_noise_floor, plan_noise_floor
from experiments.calibrate.optimum import find_optimum
from experiments.calibrate.results import (
    Campaign,
    NoiseFloorResult,
    OptimumResult,
    Outcome,
    ScreeningResult,
    StageResult,
    TargetResult,
    VerificationResult,
)
from experiments.calibrate.screening import analyse_screening, plan_screening, screening_design
from experiments.calibrate.selection import require_kept, select_factors
from experiments.calibrate.surface import explore_surface, require_slope
from experiments.calibrate.target import measured_target, plan_target, twin_target
from experiments.calibrate.values import listed, p_text
from experiments.calibrate.verification import verify
from experiments.studyfile.campaign import CampaignStudy, MeasuredTarget

Found = TypeVar("Found", bound=StageResult)

StageHook = Callable[[str, StageResult], None]
"""Called with the name and the result of every stage as it is finished."""


def calibrate(study: CampaignStudy, runner: Runner, on_stage: StageHook | None = None) -> Campaign:
    """Run a calibration campaign.

    Parameters
    ----------
    study
        Factors, limits, target and decisions.
    runner
        Simulates all rows of a table at once, each in its ``scene``, and returns them with ``status``,
        ``reason``, ``angle`` [deg] (NaN where there is none) and observables; a case that fails is a row,
        never an exception. Called once for the target, the noise floor and the screening together, then once
        for each batch of the climb, for the surface and for the verification.
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
    check_study(study)
    record = _Record(runner, on_stage)
    try:
        outcome, reason = _run(study, record)
    except StageEnd as end:
        outcome, reason = end.outcome, end.reason
    cases = pd.concat(record.tables, ignore_index=True)
    return Campaign(tuple(study.factors), study.campaign, outcome, reason, cases, **record.stages)


class _Record:
    """What a campaign has simulated and found so far."""

    def __init__(self, runner: Runner, on_stage: StageHook | None) -> None:
        self.stages: dict[str, Any] = {}
        self.tables: list[pd.DataFrame] = []
        self._runner = runner
        self._on_stage = on_stage

    def run(self, table: pd.DataFrame) -> pd.DataFrame:
        """Simulate a table of cases and remember them."""
        cases = self._runner(table)
        self.tables.append(cases)
        return cases

    def keep(self, name: str, result: Found) -> Found:
        """Remember the result of a stage, report it and hand it back."""
        self.stages[name] = result
        if self._on_stage is not None:
            self._on_stage(name, result)
        return result


def _run(study: CampaignStudy, record: _Record) -> tuple[Outcome, str]:
    """Run the stages one after another and return the outcome; StageEnd where the campaign cannot go on."""
    settings = study.campaign
    target, noise, screening = _open(study, record)
    selection = record.keep("selection", select_factors(settings.selection, screening, noise))
    require_kept(settings.selection, selection)
    path = climb(study, screening.screen, selection.kept, noise.floor, target.sample, record.run)
    require_crossing(study, record.keep("climb", path), target.sample)
    surface = record.keep("surface", explore_surface(study, path, record.run))
    require_slope(surface)
    optimum = record.keep("optimum", find_optimum(study, surface, target))
    verification = record.keep("verification", verify(study, optimum, target, record.run))
    return _verdict(optimum, verification, target.sample)


def _open(study: CampaignStudy, record: _Record) -> tuple[TargetResult, NoiseFloorResult, ScreeningResult]:
    """Run the stages that wait for nothing, in one batch: a twin's target, the noise floor, the screening."""
    factors, settings, target = study.factors, study.campaign, study.target
    design = screening_design(factors, settings.screening)
    plans = [
        plan_noise_floor(factors, settings.noise_floor, settings.seeds, target.responses),
        plan_screening(factors, design, settings.screening, settings.seeds, target.responses),
    ]
    if isinstance(target, MeasuredTarget):
        noise_cases, screening_cases = simulate(record.run, *plans)
        aim = measured_target(target)
    else:
        heaps, noise_cases, screening_cases = simulate(
            record.run, plan_target(factors, target, settings.seeds), *plans
        )
        aim = twin_target(study, target, heaps)
    screened = analyse_screening(design, screening_cases, target.responses, settings.screening.design)
    return (
        record.keep("target", aim),
        record.keep("noise_floor", analyse_noise_floor(settings.noise_floor, noise_cases, target.responses)),
        record.keep("screening", screened),
    )


def _verdict(optimum: OptimumResult, verification: VerificationResult, target: Sample) -> tuple[Outcome, str]:
    """Say how a campaign that reached its last stage ended."""
    comparison = verification.comparison
    found = (
        f"At {listed(optimum.point)} fresh heaps gave {comparison.a.mean:.2f} deg against the target's "
        f"{target.mean:.2f} deg (difference {comparison.difference:+.2f}, {p_text(comparison.p)})"
    )
    if comparison.different:
        return Outcome.NOT_VERIFIED, f"{found}: the chosen point does not give the target."
    if missed := [name for name, test in verification.responses.items() if test.different]:
        return Outcome.NOT_VERIFIED, f"{found}, but it does not give the target of {', '.join(missed)}."
    within = "shown" if comparison.equivalent else "not shown"
    equivalence = f"equivalence within {verification.margin:.2f} deg is {within}"
    others = (
        f"; no difference in {', '.join(verification.responses)} either" if verification.responses else ""
    )
    if verification.verified:
        return Outcome.CALIBRATED, f"{found}; {equivalence}{others}."
    unproven = [name for name, test in verification.responses.items() if not test.equivalent]
    if comparison.equivalent:
        equivalence = f"equivalence is not shown for {', '.join(unproven)}"
    return Outcome.NOT_VERIFIED, f"{found}, but {equivalence}, which the study requires: add replicates."
