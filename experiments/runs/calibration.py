"""A calibration in a folder: cases are stored as they finish, and the report ends it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

from experiments.calibrate import Campaign, calibrate
from experiments.calibrate.fidelity_stage import OWN_SCALE
from experiments.calibrate.results import Outcome, StageResult, TargetResult
from experiments.calibrate.stages import StageHook
from experiments.report import heap_pictures, verified_heap, write_report
from experiments.report.study_companion import companion_of
from experiments.report.verdict import verdict_sentence
from experiments.runs.choices import Prepared, with_pictures
from experiments.runs.run_folder import Run, open_run
from experiments.studyfile import cheaper_study


@dataclass(frozen=True)
class Calibration:
    """A calibration that has ended."""

    folder: Path
    """Folder of everything that it wrote."""
    campaign: Campaign
    """Results of every stage."""

    def __str__(self) -> str:
        return f"{verdict_sentence(self.campaign)} {self.report}"

    @property
    def report(self) -> Path:
        """Page of the campaign."""
        return self.folder / "report.html"

    @property
    def failed(self) -> bool:
        """True if too many runs failed for a result."""
        return self.campaign.outcome is Outcome.TOO_MANY_FAILED_RUNS

    def to_dict(self) -> dict[str, Any]:
        """Everything that was found as JSON-able data."""
        return self.campaign.to_dict()


def run_calibration(prepared: Prepared, on_stage: StageHook | None = None) -> Calibration:
    """Calibrate a study, and write its report, its tables and its material card.

    Raise InputError when the study's companion or target, or the folder, cannot be used; nothing is written
    then.
    """
    prepared = with_pictures(prepared)
    companion_of(prepared.study)  # one that is missing is refused now
    cheaper_study(prepared.study)
    with open_run("calibrate", prepared) as run:
        return Calibration(run.folder, run_campaign(run, on_stage))


def run_campaign(run: Run, on_stage: StageHook | None = None) -> Campaign:
    """Run the campaign of an open run, and publish its report."""
    cheaper = replace(run, study=cheaper_study(run.study), measured={})

    def simulate(table: pd.DataFrame) -> pd.DataFrame:
        own = table["stage"].isin(OWN_SCALE) if run.study.campaign.fidelity else table["stage"].notna()
        parts = [
            one.run_cases(rows, ", ".join(str(each).replace("_", " ") for each in rows["stage"].unique()))
            for one, rows in ((run, table[own]), (cheaper, table[~own]))
            if len(rows)
        ]
        return pd.concat(parts).loc[table.index]

    def note(name: str, result: StageResult) -> None:
        responses = result.responses if isinstance(result, TargetResult) else None
        run.journal.stage(name, result.decisions, result.tables(), responses)
        if on_stage:
            on_stage(name, result)

    campaign = calibrate(run.study, simulate, note)
    key = campaign.cases["case_key"].iloc[0]
    engine = run.store.load(key).provenance if run.store.has(key) else {}
    provenance = run.provenance | {"engine": engine}
    with run.publishing() as drafts:
        pictures = [] if run.is_by_hand else heap_pictures(campaign, run.study, run.store.load)
        solid = None if run.is_by_hand else verified_heap(campaign, run.store.load)
        write_report(campaign, run.study, drafts, pictures, provenance, solid=solid)
    return campaign
