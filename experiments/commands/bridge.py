"""``dem-warp bridge``: a card is corrected for another solver."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import FAILED_RUN, CaseProgress, clear_errors, messages
from experiments.commands.options import AsJson, Cluster, Out, Resume, Scheduler

BRIDGE_EXAMPLE = "Example: [bold]dem-warp bridge out/mygrain/material.toml --engine liggghts[/]"


def bridge(
    card: Annotated[Path, typer.Argument(metavar="CARD", help="Material card of dem-warp calibrate.")],
    engine: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="The other solver: liggghts, lammps, yade, a plug-in."),
    ] = None,
    command: Annotated[
        str | None,
        typer.Option(help="Or the command of any program that keeps docs/engine.md."),
    ] = None,
    runs: Annotated[int, typer.Option(help="Runs that the correction is made from, six or more.")] = 12,
    fresh: Annotated[int, typer.Option(help="Fresh runs that verify it.")] = 5,
    margin: Annotated[
        float | None,
        typer.Option(help="Difference that does not matter, in the target's unit. Left out: 0.5 degrees."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Root of the seeds of all runs.")] = 1,
    workers: Annotated[int | None, typer.Option(min=1, help="Runs at once. Left out: one a core.")] = None,
    scheduler: Scheduler = None,
    cluster: Cluster = None,
    time_limit: Annotated[
        str | None, typer.Option(help='Wall time of a run, as "10 min". Left out: none.')
    ] = None,
    approximate: Annotated[
        bool, typer.Option("--approximate", help="Take the nearest for what the other code lacks.")
    ] = False,
    out: Out = None,
    resume: Resume = False,
    as_json: AsJson = False,
) -> None:
    """Correct a card for another solver: a few runs there shift and scale its surface, fresh ones verify."""
    with clear_errors():
        from experiments import api

        ended = api.bridge(
            card,
            out,
            engine=engine,
            command=command,
            runs=runs,
            fresh=fresh,
            margin=margin,
            seed=seed,
            workers=workers,
            scheduler=scheduler,
            cluster=cluster,
            time_limit=time_limit,
            approximate=approximate,
            resume=resume,
            watch=CaseProgress,
        )
    if as_json:
        typer.echo(json.dumps(ended.to_dict(), allow_nan=False))
    for sentence in ended.crossing.sentences():
        messages.print(sentence)
    messages.print(f"Card: {ended.card}" if ended.card else f"Files: {ended.folder}")
    if ended.crossing.outcome == "too-many-failed-runs":
        raise typer.Exit(FAILED_RUN)
