"""``dem-warp discover``: the effect that a model lacks."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import Attempt, clear_errors, messages
from experiments.commands.options import AsJson, DryRun, Live, options_of, with_request
from experiments.commands.plans import show_plan
from experiments.commands.results import print_study
from experiments.live.server import live_page
from experiments.runs.request import RunRequest

DISCOVER_EXAMPLE = "Example: [bold]dem-warp discover mygrain.toml mygrain-measured.csv --out out/lacks[/]"


@with_request()
def discover(
    study: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Study file with its conditions.")],
    measured: Annotated[
        Path | None,
        typer.Argument(metavar="MEASURED.csv", help="Measured heaps. Default: only make the bank."),
    ] = None,
    bank: Annotated[
        Path | None, typer.Option(help="Bank made earlier for this study. Default: simulate it now.")
    ] = None,
    photographs_only: Annotated[
        bool, typer.Option("--photographs-only", help="Look only at what photographs show.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the bootstraps and of the fresh runs.")] = 1,
    dry_run: DryRun = False,
    live: Live = False,
    as_json: AsJson = False,
    *,
    asked: RunRequest,
) -> None:
    """Find the effect that a model lacks: calibrate, test the gap, name what explains it, show it closed."""
    with clear_errors():
        from experiments.runs.choices import prepare

        prepared = prepare(study, asked, what="discover")
        from experiments.runs.search import SearchData, run_search

        given = SearchData(measured, bank, photographs_only, seed)
        if dry_run:
            from experiments.runs.plan import plan_search

            show_plan(plan_search(prepared, given), as_json)
    advice = Attempt.of(
        "discover", study, measured, **options_of(prepared), bank=bank, photographs_only=photographs_only,
        seed=seed, live=live, json=as_json,
    )  # fmt: skip
    with clear_errors(advice), live_page(prepared.folder, live, messages.print):
        print_study(prepared.study, prepared.resources)
        ended = run_search(prepared, given)
    if not ended.verdict:
        messages.print(f"Bank: {ended.page}")
        return
    if as_json:
        typer.echo(json.dumps(ended.to_dict(), allow_nan=False))
    messages.print(ended.verdict)
    messages.print(f"Report: {ended.page}")
