"""The paper's 31 angles under every base that the study may stand on: law, clump and plate together.

    python -m experiments.evidence.studies.buckwheat.bases simulate --modulus-scale 10 --out out/bases
    python -m experiments.evidence.studies.buckwheat.bases measure --out out/bases
    python -m experiments.evidence.studies.buckwheat.bases choose --out out/bases

The first keeps the heaps of every base, 31 runs times the replicates, and needs the time; the second reads
them by every estimator, and the third chooses by leaving tables out. What is there is not made again. With
--base, several times if you like, only those are simulated.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.options import OneDevice
from experiments.evidence.record_page import markdown_table
from experiments.evidence.studies.buckwheat.bases.base_heaps import Folder, measure_bases, simulate_bases
from experiments.evidence.studies.buckwheat.bases.choice import BaseChoice, written
from experiments.evidence.studies.buckwheat.bases.choice_tables import choice_tables
from experiments.evidence.studies.buckwheat.bases.grid import chosen_bases
from experiments.evidence.studies.buckwheat.sensitivity.sensitivity_folder import open_settings

Out = Annotated[Path, typer.Option(help="Folder of the results.")]
Names = Annotated[list[str] | None, typer.Option("--base", help="Name of a base; left out: all.")]

app = typer.Typer(help=__doc__, no_args_is_help=True)


@app.command("simulate")
def simulate_command(
    base: Names = None,
    scale: Annotated[str, typer.Option(help="Scale of the buckwheat study.")] = "paper",
    modulus_scale: Annotated[
        float | None, typer.Option(min=1.0, help="What the shear modulus is divided by.")
    ] = None,
    replicates: Annotated[int, typer.Option(min=1, help="Heaps of each run.")] = 1,
    device: OneDevice = None,
    out: Out = Path("out/bases"),
) -> None:
    """Simulate the 31 runs of bases that are not there yet, and keep their heaps."""
    wanted = chosen_bases(base or [])
    settings = {"scale": scale, "modulus_scale": modulus_scale, "replicates": replicates}
    open_settings(out, settings)
    simulate_bases(wanted, Folder(out), settings, device)


@app.command("measure")
def measure_command(
    workers: Annotated[int | None, typer.Option(min=1, help="Processes; by default one a core.")] = None,
    out: Out = Path("out/bases"),
) -> None:
    """Read the heaps by every estimator."""
    measure_bases(chosen_bases([]), Folder(out), workers)


@app.command("choose")
def choose_command(out: Out = Path("out/bases")) -> None:
    """Choose a base and an estimator by leaving tables out, and say how it does there."""
    found = BaseChoice.read(out)
    if found is None:
        print(
            f"nothing to choose from: {written().base.name} is missing, not measured, or lacks a run's angle"
        )
        return
    for table in choice_tables(found).values():
        print(markdown_table(table))


if __name__ == "__main__":
    app()
