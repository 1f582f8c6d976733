"""Contacts in DEM-Engine: written here, run where there is a GPU, read from the record.

    python -m experiments.verification.codes.deme FOLDER

writes the program and its cases; there, `python3 contacts.py` leaves `trajectories.json`, which

    python -m experiments.verification.codes.deme FOLDER --keep

puts into the record.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dem_warp import laws_named
from experiments.export.deme import contact_terms, material_terms
from experiments.verification.codes.contact_cases import CASES
from experiments.verification.codes.driver import (
    OUTPUT,
    CodeRun,
    case_numbers,
    read_run,
    write_cases,
    write_run,
)

PROGRAM, LAWS = "deme_contacts.txt", "deme"

STORED = "deme_trajectories.json"
"""Trajectories of the record, beside this file."""


def stored_run() -> CodeRun:
    """Trajectories of the record."""
    return read_run(Path(__file__).with_name(STORED))


def main(
    folder: Annotated[Path, typer.Argument(help="Folder of the program and its cases; made when missing.")],
    keep: Annotated[bool, typer.Option("--keep", help="Put its trajectories into the record.")] = False,
) -> None:
    """Write the contacts as a program of DEM-Engine, or keep what it found."""
    if keep:
        write_run(read_run(folder / OUTPUT), Path(__file__).with_name(STORED))
        return
    laws = laws_named(LAWS)
    write_cases(folder, PROGRAM, [case_numbers(case, laws, material_terms, contact_terms) for case in CASES])


if __name__ == "__main__":
    typer.run(main)
