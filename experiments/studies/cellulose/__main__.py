"""Microcrystalline cellulose in a drum: calibrated on two surfaces, two others predicted.

    python -m experiments.studies.cellulose run --out out/cellulose                 one GPU: a quarter of an hour
    python -m experiments.studies.cellulose run --scale bench --out out/cellulose   two cores: a coarse slice
    python -m experiments.studies.cellulose page --out out/cellulose                the page, from what was written

What is there is not simulated again, so that a stopped run goes on.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

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

    run_study(scale, out, device, workers)


@app.command()
def page(out: Out = Path("out/cellulose")) -> None:
    """Write the page of a finished run."""
    from experiments.studies.cellulose.page import write_record

    print(write_record(out))


if __name__ == "__main__":
    app()
