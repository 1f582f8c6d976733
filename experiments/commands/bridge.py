"""``dem-warp bridge``: a card is corrected for another solver."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import FAILED_RUN, Attempt, clear_errors, messages
from experiments.commands.options import AsJson, Live, options_of, with_request
from experiments.live.server import live_page
from experiments.runs.request import RunRequest

BRIDGE_EXAMPLE = "Example: [bold]dem-warp bridge out/mygrain/material.toml --engine liggghts[/]"


@with_request("scale", "device")
def bridge(
    card: Annotated[Path, typer.Argument(metavar="CARD", help="Material card of dem-warp calibrate.")],
    command: Annotated[
        str | None,
        typer.Option(help="Command of the other solver, in place of --engine; it keeps docs/engine.md."),
    ] = None,
    runs: Annotated[int, typer.Option(help="Runs that the correction is made from, six or more.")] = 12,
    fresh: Annotated[int, typer.Option(help="Fresh runs that verify it.")] = 5,
    margin: Annotated[
        float | None,
        typer.Option(help="Difference that does not matter, in the target's unit. Default: 0.5 degrees."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Root of the seeds of all runs.")] = 1,
    time_limit: Annotated[
        str | None, typer.Option(help='Wall time of a run, e.g. "10 min". Default: no limit.')
    ] = None,
    approximate: Annotated[
        bool, typer.Option("--approximate", help="Take the nearest for what the other code lacks.")
    ] = False,
    live: Live = False,
    as_json: AsJson = False,
    *,
    asked: RunRequest,
) -> None:
    """Correct a card for another solver: a few runs there shift and scale its surface, fresh ones verify."""
    with clear_errors():
        from experiments.runs.bridging import BridgeOrder, prepare_bridge, run_bridge

        order = BridgeOrder(
            command=command, runs=runs, fresh=fresh, margin=margin, seed=seed, time_limit=time_limit,
            approximate=approximate,
        )  # fmt: skip
        prepared = prepare_bridge(card, asked, order)
    options = options_of(prepared.run) | vars(order) | {"engine": asked.engine, "scale": None}
    advice = Attempt.of("bridge", card, **options, live=live, json=as_json)
    with clear_errors(advice), live_page(prepared.run.folder, live, messages.print):
        ended = run_bridge(prepared)
    if as_json:
        typer.echo(json.dumps(ended.to_dict(), allow_nan=False))
    for sentence in ended.crossing.sentences():
        messages.print(sentence)
    messages.print(f"Card: {ended.card}" if ended.card else f"Files: {ended.folder}")
    if ended.failed:
        raise typer.Exit(FAILED_RUN)
