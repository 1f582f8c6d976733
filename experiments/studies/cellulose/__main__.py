"""Microcrystalline cellulose in a drum: calibrated on two surfaces, two others predicted.

    python -m experiments.studies.cellulose run --out out/cellulose
    python -m experiments.studies.cellulose run --scale bench --device cpu --out out/cellulose-bench
    python -m experiments.studies.cellulose page --out out/cellulose

The first needs a GPU, and a quarter of an hour on an H200; the second is a coarse slice for two cores; the
third writes the page of a run. What a folder holds is not simulated again: a run that was stopped goes on.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import clear_errors

Out = Annotated[Path, typer.Option(help="Folder of the results.")]

app = typer.Typer(help=__doc__, no_args_is_help=True)


@app.command()
def run(
    scale: Annotated[str, typer.Option(help="h200 or bench.")] = "h200",
    device: Annotated[str | None, typer.Option(help="cpu, cuda or cuda:N.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes on a CPU.")] = None,
    out: Out = Path("out/cellulose"),
) -> None:
    """Simulate, calibrate, predict."""
    from experiments.studies.cellulose.campaign import run_study

    with clear_errors("What is stored is not simulated again."):
        run_study(scale, out, device, workers)


@app.command()
def page(out: Out = Path("out/cellulose")) -> None:
    """Write the page of a finished run."""
    from experiments.studies.cellulose.page import write_record

    with clear_errors():
        print(write_record(out))


if __name__ == "__main__":
    app()
