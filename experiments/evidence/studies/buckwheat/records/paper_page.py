"""The record of the paper's runs simulated again: a folder whose page is made from its tables.

This module as a command writes the page in the tree anew.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from doe.plots import agreement_plot
from experiments.calibrate.campaign import Campaign
from experiments.evidence.page_figures import save_figure
from experiments.evidence.record_page import facts_list, markdown_page, markdown_table, wall_times_table
from experiments.evidence.studies.buckwheat.replay.replay import Replay
from experiments.evidence.studies.buckwheat.replay.replay_tables import replay_tables
from experiments.evidence.studies.buckwheat.replay.runs import DESIGNS, TABLES
from experiments.io.files import write_text
from experiments.io.plain_data import jsonable
from experiments.report.material_card import CARD

PAGE, RUNS, PROVENANCE, CAMPAIGN = "README.md", "runs.csv", "provenance.json", "campaign.json"
RECORD = "record"
"""Folder of the page in that of the runs."""
FOLDER = Path(__file__).parents[1] / RECORD
SCATTER, NOTES = "agreement.png", "notes.md"
SIDE_STUDIES = "side_studies.md"
"""Chapters on steel, variants of the model and other bases, as earlier code wrote them."""
READ = (".md", ".json")
"""Files of a record that are read as text."""


def write_record(
    folder: Path, cases: pd.DataFrame, provenance: Mapping[str, Any], campaign: Campaign | None = None
) -> Path:
    """Write the tables of a record of the paper's runs, and its page; return the page."""
    write_text(folder / RUNS, cases.to_csv(index=False))
    write_text(folder / PROVENANCE, _json(provenance))
    if campaign is not None:
        write_text(folder / CAMPAIGN, _json(campaign_facts(campaign)))
    return write_record_page(folder)


def write_record_page(folder: Path) -> Path:
    """Write the page of a record, and its plot, again from its tables."""
    replay = Replay(pd.read_csv(folder / RUNS))
    runs = replay.runs[lambda runs: runs["stage"].isin(DESIGNS) & runs["angle"].notna()]
    groups = [TABLES[stage] for stage in runs["stage"]]
    figure = agreement_plot(replay.agreement(), groups, "simulated angle [°]", "published angle [°]")
    save_figure(figure, folder / SCATTER, dpi=130)
    write_text(folder / PAGE, record_page(folder))
    return folder / PAGE


def campaign_facts(campaign: Campaign) -> dict[str, Any]:
    """Keep of a campaign what a record shows: outcome, reason, effects of its screening."""
    facts: dict[str, Any] = {"outcome": campaign.outcome.value, "reason": campaign.reason}
    if campaign.screening is not None:
        effects = campaign.screening.leading.screen.table[["effect", "p", "rank"]]
        facts["effects"] = {str(name): dict(row) for name, row in effects.iterrows()}
    return facts


def campaign_effects(campaign: Mapping[str, Any] | None) -> pd.DataFrame | None:
    """Effects of a campaign's screening by factor, from what `campaign_facts` keeps."""
    if campaign is None or "effects" not in campaign:
        return None
    return pd.DataFrame.from_dict(campaign["effects"], orient="index")


def record_page(folder: Path) -> str:
    """Write the page of a record as Markdown."""
    texts = {
        path.name: path.read_text(encoding="utf-8") for path in folder.glob("*.*") if path.suffix in READ
    }
    facts, campaign = json.loads(texts[PROVENANCE]), json.loads(texts.get(CAMPAIGN, "null"))
    laid_out = replay_tables(Replay(pd.read_csv(folder / RUNS)), campaign_effects(campaign))
    tables = {name: markdown_table(table) for name, table in laid_out.items()}
    return markdown_page(
        "# The paper's runs, simulated again",
        "Every run of Tables 3, 5 and 6 of the paper and its verification, with the published angles. This "
        "page is made from the files next to it: "
        "`python -m experiments.evidence.studies.buckwheat.records.paper_page`.",
        facts_list(facts),
        wall_times_table(facts, "heaps"),
        "## Agreement",
        tables["agreement"],
        f"![Simulated against published angles]({SCATTER})",
        texts.get(NOTES, ""),
        "## Screening",
        tables["effects"],
        "## Response surface",
        tables["anova"],
        tables["coefficients"],
        "## Verification",
        tables["verification"],
        *_campaign(campaign, (folder / CARD).is_file()),
        texts.get(SIDE_STUDIES, ""),
        "## Every run",
        tables["runs"],
        f"Every heap, with its seed, stands in [{RUNS}]({RUNS}).",
    )


def _campaign(campaign: Mapping[str, Any] | None, card: bool) -> list[str]:
    if campaign is None:
        return []
    outcome = f"Outcome: {campaign['outcome']}. {campaign['reason']}"
    link = f"The material, and all settings that are as good: [{CARD}]({CARD})." if card else ""
    return ["## Our own campaign", outcome, link]


def _json(value: Mapping[str, Any]) -> str:
    return json.dumps(jsonable(value), indent=1, allow_nan=False) + "\n"


if __name__ == "__main__":
    print(write_record_page(FOLDER))
