"""Proof that a card travels: heaps here and in other codes, compared.

    python -m experiments.evidence.accuracy.travel ours --device cuda --out out/travel
    python -m experiments.evidence.accuracy.travel theirs --code liggghts --workers 16 --out out/travel
    python -m experiments.evidence.accuracy.travel page --out out/travel

The page of the last recorded run is record/README.md. Every heap is stored as it ends, those of the record
are taken up, and any part may be run anywhere: what was made from the same input is not made again.
"""

from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import clear_errors
from experiments.commands.options import OneDevice
from experiments.evidence.accuracy.travel.cards import CARDS, CODES, FRESH_SEEDS, OWN_SEEDS, SEEDS
from experiments.evidence.accuracy.travel.travel_heaps import run_theirs, simulate_ours, stored_heaps, take_up
from experiments.evidence.accuracy.travel.travel_page import write_page

app = typer.Typer(add_completion=False, help=__doc__)

RECORD = Path(__file__).parent / "record"

Out = Annotated[Path, typer.Option(help="Folder of the stored heaps.")]
Cards = Annotated[list[str] | None, typer.Option("--card", help="A card; may be repeated. Left out: all.")]
Seeds = Annotated[int | None, typer.Option(min=1, help="How many seeds. Left out: all.")]


@app.command()
def ours(
    out: Out,
    code: Annotated[list[str] | None, typer.Option(help="Code whose laws hold; may be repeated.")] = None,
    card: Cards = None,
    seeds: Seeds = None,
    device: OneDevice = "cpu",
    workers: Annotated[int | None, typer.Option(min=1, help="Processes on the CPU.")] = None,
) -> None:
    """Simulate the cards here, under the laws of each code."""
    take_up(RECORD, out)
    simulate_ours(out, _known(code, CODES), _known(card, CARDS), OWN_SEEDS[:seeds], device, workers)


@app.command()
def theirs(
    out: Out,
    code: Annotated[list[str], typer.Option(help="Code to run; may be repeated.")],
    card: Cards = None,
    seeds: Seeds = None,
    fresh: Annotated[
        bool, typer.Option(help="Fresh seeds, of a cell that the first have not shown.")
    ] = False,
    workers: Annotated[int, typer.Option(min=1, help="Runs at once.")] = 1,
    programs: Annotated[Path | None, typer.Option(help="Folder with its programs, before the PATH.")] = None,
) -> None:
    """Run the exported cards in other codes, all cards of a seed before the next."""
    take_up(RECORD, out)
    with clear_errors():
        run_theirs(
            out,
            _known(code, CODES),
            _known(card, CARDS),
            (FRESH_SEEDS if fresh else SEEDS)[:seeds],
            workers,
            programs,
        )


@app.command()
def page(
    out: Out, record: Annotated[Path, typer.Option(help="Folder of the page and its tables.")] = RECORD
) -> None:
    """Compare what is stored and write the page."""
    take_up(record, out)
    print(write_page(stored_heaps(out), record))


def _known(names: list[str] | None, known: dict) -> list[str]:
    """Names that were asked for, all of them where none was."""
    if strange := sorted(set(names or ()) - set(known)):
        raise typer.BadParameter(f"must be one of {', '.join(known)}, got {', '.join(strange)}")
    return list(names or known)


if __name__ == "__main__":
    app()
