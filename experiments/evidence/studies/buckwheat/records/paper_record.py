r"""The record of the paper's runs: gathered from the folders that made it, its page written anew.

    python -m experiments.evidence.studies.buckwheat --campaign --scale paper --out out/paper
    python -m experiments.evidence.studies.buckwheat.records.paper_record --paper out/paper

Without a folder it writes the page again from the tables of the record. The record lies in
``experiments/evidence/studies/buckwheat/record``.
"""

import json
from pathlib import Path
from typing import Annotated

import typer

from experiments.evidence.studies.buckwheat.records.paper_page import (
    CAMPAIGN,
    PROVENANCE,
    RECORD,
    RUNS,
    write_record_page,
)
from experiments.io.files import copy_file, write_text
from experiments.report.material_card import CARD

FOLDER = Path(__file__).parents[1] / RECORD


def gather_paper(source: Path, record: Path, commit: str | None = None) -> None:
    """Copy the paper's runs from the folder that they were simulated in.

    A `commit` is given when the machine that made them had no repository.
    """
    for name in (RUNS, PROVENANCE):
        copy_file(source / RECORD / name, record / name)
    if (source / RECORD / CAMPAIGN).is_file():
        copy_file(source / RECORD / CAMPAIGN, record / CAMPAIGN)
    # the card of the campaign with its clumps
    for path in source.glob(f"{Path(CARD).stem}*"):
        copy_file(path, record / path.name)
    if commit:
        made_by = json.loads((record / PROVENANCE).read_text(encoding="utf-8"))
        write_text(record / PROVENANCE, json.dumps(made_by | {"commit": commit}, indent=1) + "\n")


def main(
    paper_folder: Annotated[
        Path | None, typer.Option("--paper", help="Folder of a calibration with the paper's runs.")
    ] = None,
    commit: Annotated[str | None, typer.Option(help="Commit that made the paper's runs.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the record.")] = FOLDER,
) -> None:
    """Gather the record and write its page."""
    if paper_folder:
        gather_paper(paper_folder, out, commit)
    print(write_record_page(out))


if __name__ == "__main__":
    typer.run(main)
