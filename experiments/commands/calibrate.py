"""``dem-warp calibrate``: a whole calibration."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Annotated

import typer

from experiments.commands.console import FAILED_RUN, Attempt, clear_errors, messages
from experiments.commands.options import AsJson, DryRun, Live, StudyFile, options_of, with_request
from experiments.commands.plans import show_plan
from experiments.commands.results import print_study, show_stage
from experiments.live.server import live_page
from experiments.runs.request import RunRequest

CALIBRATE_EXAMPLE = "Example: [bold]dem-warp calibrate mygrain.toml --out out/mygrain[/]"


@with_request()
def calibrate(
    study: StudyFile = None,
    dry_run: DryRun = False,
    live: Live = False,
    by_hand: Annotated[
        bool,
        typer.Option(
            "--by-hand",
            help="Write sheets of runs to simulate in another program, and wait for the results.",
        ),
    ] = False,
    budget: Annotated[
        str | None,
        typer.Option(
            metavar="TIME",
            help='Wall time, such as "30 min": the design is run at a cheaper scale of the study, and a few '
            "runs move its surface to the scale that is asked for.",
        ),
    ] = None,
    as_json: AsJson = False,
    *,
    asked: RunRequest,
) -> None:
    """Run a whole calibration: noise floor, screening, climb, surface, optimum, verification, report."""
    with clear_errors():
        from experiments.runs.choices import check_campaign, prepare

        asked = replace(asked, engine="hand") if by_hand else asked
        prepared = prepare(study, asked, check_campaign)
        if budget is not None:
            from experiments.runs.fidelity import with_budget

            prepared = with_budget(prepared, budget)
        if dry_run:
            from experiments.runs.plan import plan_calibration

            show_plan(plan_calibration(prepared), as_json)
    advice = Attempt.of("calibrate", study, **options_of(prepared), live=live, budget=budget, json=as_json)
    with clear_errors(advice), live_page(prepared.folder, live, messages.print):
        from experiments.runs.calibration import run_calibration

        print_study(prepared.study, prepared.resources)
        if fidelity := prepared.study.campaign.fidelity:
            messages.print(
                f"The design at the scale {fidelity.scale}, {fidelity.runs} runs at the study's own."
            )
        ended = run_calibration(prepared, show_stage)
    if as_json:
        typer.echo(json.dumps(ended.to_dict(), allow_nan=False))
    messages.print(f"{ended.campaign.outcome}: {ended.campaign.reason}")
    messages.print(f"Report: {ended.report}")
    if ended.failed:
        raise typer.Exit(FAILED_RUN)
