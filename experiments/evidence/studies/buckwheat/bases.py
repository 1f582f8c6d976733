"""The paper's 31 angles under ten bases that the study may have, and the choice of one.

    python -m experiments.evidence.studies.buckwheat.bases simulate --out out/bases --device cuda:0
    python -m experiments.evidence.studies.buckwheat.bases choose --phase 1 --out out/bases
    python -m experiments.evidence.studies.buckwheat.bases page --out out/bases --made "DATE, MACHINE"

`simulate` goes on where it was stopped; several may work in one folder, each with bases of its own. `choose`
prints the choice, with --phase 1 the bases of which --replicates 3 are wanted. `page` keeps the record.
"""

from pathlib import Path
from typing import Annotated

import typer

from experiments.cases import OwnWorkers
from experiments.commands.console import clear_errors
from experiments.commands.options import OneDevice
from experiments.evidence.studies.buckwheat.replay.base_choice import (
    GO_ON,
    first_phase,
    read_heaps,
    second_phase,
)
from experiments.evidence.studies.buckwheat.replay.base_heaps import BASES, simulate_base
from experiments.io.errors import InputError
from experiments.io.texts import nearest_name

Out = Annotated[Path, typer.Option(help="Folder of the heaps.")]

app = typer.Typer(help=__doc__, no_args_is_help=True)


@app.command()
def simulate(
    base: Annotated[list[str] | None, typer.Option(help="Name of a base. Default: all.")] = None,
    replicates: Annotated[int, typer.Option(min=1, help="Heaps of each run.")] = 1,
    scale: Annotated[str, typer.Option(help="Scale of the study.")] = "printed",
    modulus_scale: Annotated[
        float | None, typer.Option(min=1.0, help="Divisor of the shear modulus. Default: the scale's.")
    ] = None,
    device: OneDevice = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes that read heaps, and on a CPU simulate.")
    ] = None,
    out: Out = Path("out/bases"),
) -> None:
    """Simulate and read the heaps that the folder lacks."""
    with clear_errors("What is stored is not simulated again."):
        for name in set(base or ()) - set(BASES):
            raise InputError("--base", f"must name a base, {nearest_name(name, list(BASES))}", name)
        for name in base or BASES:
            table = simulate_base(name, out, replicates, scale, modulus_scale, OwnWorkers(device, workers))
            print(f"{name}: {table['flank'].notna().sum()} of {len(table)} heaps have an angle", flush=True)


@app.command()
def choose(
    phase: Annotated[int, typer.Option(min=1, max=2, help="1: name the bases that go on.")] = 2,
    out: Out = Path("out/bases"),
) -> None:
    """Choose by the rule of `replay/base_choice.py`."""
    with clear_errors():
        heaps = read_heaps(out)
        if phase == 1:
            print(*(each.base for each in first_phase(heaps).best_of_bases[:GO_ON]))
        else:
            best = second_phase(heaps).best()
            print(best.base, best.estimator)


@app.command()
def page(
    made: Annotated[str, typer.Option(help="Date, machine and wall time, for the page.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder of new heaps. Default: those of the record.")
    ] = None,
) -> None:
    """Keep the heaps in the record and write its page."""
    # loads matplotlib, which a machine that simulates may lack
    from experiments.evidence.studies.buckwheat.records.base_page import keep_heaps, write_base_page

    with clear_errors():
        if out is not None:
            keep_heaps(read_heaps(out))
        print(write_base_page(made))


if __name__ == "__main__":
    app()
