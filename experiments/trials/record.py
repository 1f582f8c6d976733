"""Reveal the labels, score the findings, and write the record of the trials.

    python -m experiments.trials.record out/trials --out experiments/trials/record/first
    python -m experiments.trials.record --page-only --out experiments/trials/record/first

The first takes over what was published, found and, now, hidden; the second writes the page again from the
files of the record.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import clear_errors
from experiments.errors import InputError
from experiments.files import copy_file
from experiments.trials.folder import DECLARED, FINDINGS, LABELS, REALITY, RUNS, SEALED, Folder
from experiments.trials.trials_page import write_trials_page


def gather(folder: Folder, record: Path) -> None:
    """Take a folder's files over into a record, the labels among them.

    Raises
    ------
    InputError
        When one is missing.
    """
    files = [*(folder.record / name for name in (DECLARED, SEALED, FINDINGS, RUNS)), folder.hidden / LABELS]
    if (reality := folder.record / REALITY).is_file():
        files.append(reality)
    for source in files:
        if not source.is_file():
            raise InputError("trials that are revealed have run", "no such file", str(source))
    for source in files:
        copy_file(source, record / source.name)


def main(
    out: Annotated[Path, typer.Option(help="The record.")],
    folder: Annotated[Path | None, typer.Argument(help="Folder of the trials.")] = None,
    page_only: Annotated[bool, typer.Option("--page-only", help="Write the page again.")] = False,
) -> None:
    """Write the record of the trials."""
    if (folder is None) != page_only:
        raise typer.BadParameter("give the folder of the trials, or --page-only")
    with clear_errors():
        if folder is not None:
            gather(Folder(folder), out)
        print(write_trials_page(out))


if __name__ == "__main__":
    typer.run(main)
