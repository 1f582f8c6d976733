"""The record of what further responses buy: gathered from campaigns' folders, its page written anew.

    dem-warp calibrate experiments/studies/buckwheat/curve_to_point.toml --scale paper --out out/point
    python -m experiments.evidence.studies.buckwheat.records.point_record --from paper=out/point

Without a folder it writes the page again from the cases of the record, which lies in
``experiments/evidence/studies/buckwheat/point``: the campaign's statistics are repeated on them.
"""

import json
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from doe.plots.joint_plots import joint_plot
from experiments.calibrate import Campaign, calibrate
from experiments.evidence.page_figures import save_figure
from experiments.evidence.record_page import (
    WALL_TIMES,
    facts_list,
    markdown_table,
    wall_times_table,
    write_page,
)
from experiments.io.errors import InputError
from experiments.io.files import copy_file, existing, write_text
from experiments.report.kit.numbers import prose
from experiments.report.response_tables import response_tables
from experiments.runs.run_folder import WALL_TIMES_FILE
from experiments.studies.buckwheat import paper
from experiments.studyfile import Study, load_study

STUDY = Path(paper.__file__).with_name("curve_to_point.toml")
FOLDER = Path(__file__).parents[1] / "point"
CASES, PROVENANCE, PAGE = "cases.csv", "provenance.json", "README.md"
KEY = ["stage", "scene", "run", "replicate", "seed"]
"""Columns that name a case."""

LAST_DIGITS = 1e-8
"""Relative difference of two settings that are the same: where climbs and optima end, the linear algebra of
another machine finds other last digits."""


class KeptCases:
    """A runner that hands out the cases of an earlier campaign; error messages name their source."""

    def __init__(self, cases: pd.DataFrame, source: str) -> None:
        self.cases, self.source = cases.set_index(KEY), source

    def __call__(self, table: pd.DataFrame) -> pd.DataFrame:
        """Find the rows of a table; one not simulated, or with other settings, is an `InputError`."""
        wanted = table.set_index(KEY)
        missing = wanted.index.difference(self.cases.index)
        if len(missing):
            rule = "kept cases must be those that the study's campaign asks for; gather them anew"
            raise InputError(self.source, rule, dict(zip(KEY, missing[0], strict=True)))
        found = self.cases.loc[wanted.index]
        if not np.allclose(found[wanted.columns], wanted, rtol=LAST_DIGITS, atol=0.0):
            raise InputError(self.source, "kept cases must have the study's settings", "others")
        # An empty reason is read back as no number.
        found = found.assign(reason=found["reason"].astype(object).fillna(""))
        return found.reset_index()[[*table.columns, *found.columns.drop(wanted.columns)]]


def gather(scale: str, source: Path, record: Path, commit: str | None = None) -> None:
    """Take over the cases of a campaign's folder, and what made them.

    Where the machine that made them had no repository, the commit is given.
    """
    results, times = existing(source / "results.json"), existing(source / WALL_TIMES_FILE)
    copy_file(source / "tables" / CASES, record / scale / CASES)
    made_by = json.loads(results.read_text(encoding="utf-8"))["provenance"]
    facts = made_by | ({"commit": commit} if commit else {})
    facts[WALL_TIMES] = pd.read_csv(times).to_dict("records")
    write_text(record / scale / PROVENANCE, json.dumps(facts, indent=1) + "\n")


def write_record_page(record: Path = FOLDER, study_file: Path = STUDY) -> Path:
    """Write the page, and a picture for every scale that was gathered."""
    parts = [
        "# From a curve to a point",
        "One repose angle leaves a curve of frictions. Here the density of the filled tube and the flow out "
        "of a hopper are added to it, in a twin experiment: all three come from simulations with hidden "
        f"frictions. The study is [{study_file.name}](../{study_file.name}); this page is made from the "
        "cases next to it by `python -m experiments.evidence.studies.buckwheat.records.point_record`.",
    ]
    for folder in sorted(path.parent for path in record.glob(f"*/{CASES}")):
        study = load_study(study_file, folder.name)
        campaign = kept_campaign(study, folder)
        facts = json.loads((folder / PROVENANCE).read_text(encoding="utf-8"))
        parts += [f"## Scale: {folder.name}", study.note, *_findings(campaign, study, folder)]
        parts += [facts_list(facts), wall_times_table(facts, "cases")]
    return write_page(record / PAGE, *parts)


def kept_campaign(study: Study, folder: Path) -> Campaign:
    """Repeat a campaign's statistics on its cases."""
    return calibrate(study, KeptCases(pd.read_csv(folder / CASES), str(folder / CASES)))


def _findings(campaign: Campaign, study: Study, folder: Path) -> list[str]:
    outcome = f"Outcome: {campaign.outcome}. {campaign.reason}"
    if campaign.optimum is None or campaign.optimum.joint is None:
        return [prose(outcome)]
    optimum, joint = campaign.optimum, campaign.optimum.joint
    decisions = [decision.outcome for decision in optimum.decisions if "Chosen" not in decision.outcome]
    picture, hidden = [], campaign.target.truth if campaign.target else None
    if len(joint.factors) > 1:
        save_figure(joint_plot(joint, hidden), folder / "joint.png", dpi=130)
        picture = [
            f"![Where each response agrees, and where all do]({folder.name}/joint.png)",
            "Each panel is a cut through the point of the smallest chi². The hidden truth may lie in the "
            "compatible region and yet outside it in a cut.",
        ]
    tables = response_tables(campaign)
    return [
        prose(outcome),
        *picture,
        "\n".join(f"- {prose(text)}" for text in decisions),
        *map(markdown_table, tables.values()),
    ]


def main(
    sources: Annotated[
        list[str] | None, typer.Option("--from", metavar="SCALE=FOLDER", help="Folder of a campaign.")
    ] = None,
    commit: Annotated[str | None, typer.Option(help="Commit that made the campaigns.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the record.")] = FOLDER,
) -> None:
    """Gather the record and write its page."""
    for text in sources or []:
        scale, _, source = text.partition("=")
        gather(scale, Path(source), out, commit)
    print(write_record_page(out))


if __name__ == "__main__":
    typer.run(main)
