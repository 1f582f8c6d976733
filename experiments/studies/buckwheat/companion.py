"""Companion of the buckwheat study: the paper's numbers, its runs simulated again, its misprints."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd

from dem_warp import CaseResult
from doe import Sample
from experiments.calibrate.results import Campaign
from experiments.report.companion import Companion
from experiments.report.kit.html import Chapter
from experiments.report.kit.table import Table, make_table
from experiments.report.published import Published
from experiments.studies.buckwheat import paper
from experiments.studies.buckwheat.records.paper_page import draw_heaps, write_record
from experiments.studies.buckwheat.replay.replay import Replay
from experiments.studies.buckwheat.replay.replay_tables import replay_chart, replay_tables
from experiments.studies.buckwheat.replay.runs import STAGES, planned_cases
from experiments.studyfile import Study

REPLAY = (
    "The runs of the paper's own designs, simulated with the paper's settings, beside the angles that it "
    "prints: no decision of this campaign rests on them."
)
MISPRINTS = (
    "What this page calls the paper's is recomputed from the runs that the paper prints. Most printed "
    "results follow from them; these do not, or contradict the rest of the text."
)


class PaperReplay(Replay):
    """The paper's runs simulated again, with a chapter and a page."""

    def chapters(self, campaign: Campaign) -> list[Chapter]:
        """Chapter on every run beside its published angle, and on both analyses."""
        effects = campaign.screening.leading.screen.table if campaign.screening else None
        tables, title = replay_tables(self, effects), "The paper's runs, simulated again"
        return [Chapter("replay", title, tables, [replay_chart(self)], REPLAY)]

    def write_record(
        self,
        folder: Path,
        study: Study,
        load: Callable[[str], CaseResult],
        provenance: Mapping[str, Any],
        campaign: Campaign | None,
    ) -> Path:
        """Write the page on the runs, its tables and its picture; see `report.companion.Replay`."""
        draw_heaps(folder, study, self, load)
        return write_record(folder, self.cases, provenance, campaign)


class BuckwheatCompanion(Companion):
    """Numbers that the paper printed, and what follows from them."""

    def published(self) -> Published:
        """The paper's own results, recomputed from its printed runs."""
        climb = paper.published("steepest_climb").rename_axis("step")
        reduced = paper.surface("reduced")
        settings = paper.published("settings")["value"]
        return Published(
            screening=paper.screening().table,
            climb=climb.rename(columns={"repose_angle_deg": "angle", "relative_error_pct": "error_percent"}),
            surfaces={"full": paper.surface("quadratic"), "reduced": reduced},
            optimum={name: float(settings[name]) for name in reduced.design.names},
            heaps=Sample.of(paper.verification()),
            measured=paper.measured(),
        )

    def planned_runs(self, replicates: int) -> dict[str, pd.DataFrame]:
        """Every run of Tables 3, 5 and 6 and of the verification, a batch a stage."""
        return {f"paper, {stage}": planned_cases(replicates, [stage]) for stage in STAGES}

    def replay(self, cases: pd.DataFrame) -> PaperReplay:
        """Analyse simulated cases of `planned_runs`."""
        return PaperReplay(cases)

    def campaign_chapters(self, campaign: Campaign) -> Sequence[Chapter]:
        """Chapter on what the paper's own numbers contradict."""
        return [Chapter("paper", "The paper's numbers", {"misprints": misprints_table()}, text=MISPRINTS)]


def misprints_table() -> Table:
    """Lay out what the paper's own numbers contradict."""
    frame = pd.DataFrame([asdict(misprint) for misprint in paper.misprints()])
    return make_table("misprints", frame, list(frame), "Where the print and its own numbers differ.")


COMPANION = BuckwheatCompanion()
