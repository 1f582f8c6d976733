"""Reveal the labels, score the findings, and write the record of the trials.

    python -m experiments.evidence.trials.record_trials out/trials --out RECORD
    python -m experiments.evidence.trials.record_trials --page-only --out RECORD

The second writes the page again from the files of the record. The measured heaps of another code are copied
to the record, as they took hours; those of the engine with ``--heaps``, so that other methods can use them.
"""

from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import clear_errors
from experiments.evidence.trials.findings import read_findings
from experiments.evidence.trials.trial_heaps import pack_heaps
from experiments.evidence.trials.trials_folder import (
    DECLARED,
    FINDINGS,
    HEAPS,
    LABELS,
    REALITY,
    RUNS,
    SEALED,
    Folder,
)
from experiments.evidence.trials.trials_page import write_trials_page
from experiments.evidence.trials.truth import opened, read_labels, read_sealed, revealed, write_labels
from experiments.io.errors import InputError
from experiments.io.files import copy_file


def gather(folder: Folder, record: Path, heaps: bool = False) -> None:
    """Take a folder's files over into a record, with the labels of the trials that have been analysed.

    The measured heaps go with them where another code made them, or where they are asked for.
    """
    files = [folder.record / name for name in (DECLARED, SEALED, FINDINGS, RUNS)]
    reality = folder.record / REALITY
    files += [reality] if reality.is_file() else []
    for source in (*files, folder.hidden_labels):
        if not source.is_file():
            raise InputError(str(source), "the trials have not run yet")
    analysed = opened(read_sealed(folder.sealed), read_findings([folder.findings])["trial"])
    labels = revealed(read_labels(folder.hidden_labels), analysed)
    for source in files:
        copy_file(source, record / source.name)
    write_labels(record / LABELS, list(labels.values()))
    if heaps or reality.is_file():
        pack_heaps(folder, record / HEAPS)


def main(
    out: Annotated[Path, typer.Option(help="The record.")],
    folder: Annotated[Path | None, typer.Argument(help="Folder of the trials.")] = None,
    page_only: Annotated[bool, typer.Option("--page-only", help="Write the page again.")] = False,
    heaps: Annotated[bool, typer.Option("--heaps", help="Keep the engine's measured heaps, too.")] = False,
) -> None:
    """Write the record of the trials."""
    if (folder is None) != page_only:
        raise typer.BadParameter("give the folder of the trials, or --page-only")
    with clear_errors():
        if folder is not None:
            gather(Folder(folder), out, heaps)
        print(write_trials_page(out))


if __name__ == "__main__":
    typer.run(main)
