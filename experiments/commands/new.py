"""``dem-warp new``: files to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import clear_errors, plain, shell_line

NEW_EXAMPLE = "Example: [bold]dem-warp new mygrain[/] writes mygrain.toml"


def new(
    name: Annotated[str, typer.Argument(help="Name of the grain, and of the file.")],
    measured: Annotated[
        bool,
        typer.Option(
            "--measured", help="Write NAME-measured.csv instead: room for heaps measured for the study NAME."
        ),
    ] = False,
    test: Annotated[
        str,
        typer.Option(
            metavar="TEST",
            help="Test of the study, e.g. poured-heap, ledge, compression, shear, penetration, drum or drop.",
        ),
    ] = "lifted-cylinder",
) -> None:
    """Write a commented study file to start from, or a file for the measured heaps of a study."""
    with clear_errors():
        if measured:
            from experiments.measurement.measured_template import write_measured_template
            from experiments.studyfile import load_study

            study = Path(name) if name.endswith(".toml") else Path(f"{name}.toml")
            path, words = write_measured_template(load_study(study)), ["discover", str(study)]
        else:
            from experiments.studyfile import write_template

            path, words = write_template(name, test=test), ["calibrate"]
    then = shell_line(["dem-warp", *words, str(path)])
    typer.echo(plain(f"Wrote {path}. Fill it in, then: {then}"))
