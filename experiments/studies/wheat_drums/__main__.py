"""Wheat in drums: one grain, five slopes, a friction for each wall, and the heap that they foretell.

    python -m experiments.studies.wheat_drums run --out out/wheat-drums
    python -m experiments.studies.wheat_drums run --scale bench --device cpu --out out/wheat-drums-bench
    python -m experiments.studies.wheat_drums page --out out/wheat-drums
    python -m experiments.studies.wheat_drums search --out out/wheat-drums

The first needs a GPU; the second has small drums for two cores; the third writes the page of a run, and the
fourth a study and a table for `dem-warp discover`. What a folder holds is not simulated again.
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
    out: Out = Path("out/wheat-drums"),
) -> None:
    """Simulate the drums, fit the slopes, simulate heaps."""
    from experiments.studies.wheat_drums.campaign import run_study

    with clear_errors("What is stored is not simulated again."):
        run_study(scale, out, device, workers)


@app.command()
def page(out: Out = Path("out/wheat-drums")) -> None:
    """Write the page of a finished run."""
    from experiments.studies.wheat_drums.page import write_record

    with clear_errors():
        print(write_record(out))


@app.command()
def search(out: Out = Path("out/wheat-drums")) -> None:
    """Write a study and a table for a search, and say how to run it."""
    from experiments.studies.wheat_drums.page import fit_of
    from experiments.studies.wheat_drums.search import write_search

    with clear_errors():
        study, fit, _ = fit_of(out)
        made, measured = write_search(out, study, fit)
    print(f"dem-warp discover {made} {measured} --out {out / 'search'}")


if __name__ == "__main__":
    app()
