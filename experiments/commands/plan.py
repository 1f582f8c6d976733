"""``dem-warp plan``: which of the tests that could be done are worth doing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from experiments.commands.console import Attempt, clear_errors, messages, plain
from experiments.commands.options import AsJson, DryRun, Live, options_of, with_request
from experiments.commands.plans import show_plan
from experiments.live.server import live_page
from experiments.runs.request import RunRequest

if TYPE_CHECKING:
    from experiments.runs.planning import TestPlan

PLAN_EXAMPLE = "Example: [bold]dem-warp plan mygrain.toml --after out/mygrain[/]"


@with_request()
def plan(
    study: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Study file with \\[\\[candidate]].")],
    after: Annotated[
        Path | None, typer.Option(help="Folder of a finished campaign, or its card, whose region is used.")
    ] = None,
    dry_run: DryRun = False,
    live: Live = False,
    as_json: AsJson = False,
    *,
    asked: RunRequest,
) -> None:
    """Choose the next tests: what each would buy, in laboratory minutes and computer time."""
    with clear_errors():
        from experiments.runs.planning import prepare_plan, run_plan

        prepared = prepare_plan(study, asked, after)
        if dry_run:
            from experiments.runs.plan import plan_tests

            show_plan(plan_tests(prepared.run, prepared.tables), as_json)
    advice = Attempt.of("plan", study, **options_of(prepared.run), after=after, live=live, json=as_json)
    with clear_errors(advice), live_page(prepared.run.folder, live, messages.print):
        found = run_plan(prepared)
    if as_json:
        typer.echo(json.dumps(found.to_dict(), allow_nan=False))
    else:
        _show(found)
    messages.print(f"{found.sentence}\nReport: {prepared.run.folder / 'report.html'}")


def _show(found: TestPlan) -> None:
    table = Table(title="95 % half widths over the values [%], which hold in 80 % of the cases")
    widths = {factor.name: ".1f" for factor in found.present.factors}
    forms = {"tests": "", "minutes": ".0f", "seconds": ".3g", **widths, "left": ".1f", "open": ""}
    for name, form in forms.items():
        table.add_column(name, justify="right" if form else "left", overflow="fold")
    for row in found.table.reset_index().to_dict("records"):
        table.add_row(*(plain(f"{row[name]:{form}}") for name, form in forms.items()))
    Console(markup=False).print(table)
    for note in found.notes:
        typer.echo(plain(note))
