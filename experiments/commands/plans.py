"""``--dry-run``: what a command would run, how long, and on what; no folder of results is touched."""

from __future__ import annotations

import json
from functools import partial
from typing import TYPE_CHECKING, NoReturn

import typer
from rich.console import Console
from rich.table import Table

from experiments.commands.console import duration, messages, plain

if TYPE_CHECKING:
    from collections.abc import Callable

    from dem_warp import Case
    from experiments.cases import Resources
    from experiments.cases.workers.speed import Speed
    from experiments.runs.plan import Plan
    from experiments.runs.search import Job
    from experiments.studyfile import Study


def show_calibration(
    study: Study, resources: Resources, published_replicates: int, campaign: bool, as_json: bool
) -> NoReturn:
    """Show the plan of a calibration, of published runs or of both, and end the command."""
    from experiments.runs.campaign import check_runs
    from experiments.runs.plan import plan_calibration

    study = check_runs(study, campaign, published_replicates > 0)
    planned = partial(
        plan_calibration, study, resources, published_replicates=published_replicates, campaign=campaign
    )
    show_plan(resources, planned, as_json)
    raise typer.Exit


def show_search(job: Job, resources: Resources, as_json: bool) -> NoReturn:
    """Show the plan of a search, and end the command; its data are read as a run reads them."""
    from experiments.discover.fresh_cases import cases_for
    from experiments.discover.search import Search
    from experiments.runs.plan import plan_search
    from experiments.runs.search import known_bank, read_data

    search, bank, measured = Search.of(job.study), known_bank(job), read_data(job)
    fresh = None if measured is None else cases_for(search, measured, bank, job.seed)
    planned = partial(plan_search, job.study, resources, has_bank=bank is not None, fresh=fresh)
    show_plan(resources, planned, as_json)
    raise typer.Exit


def show_heap(study: Study, resources: Resources, case: Case, as_json: bool) -> NoReturn:
    """Show the plan of one case, and end the command."""
    from experiments.runs.plan import plan_heap

    show_plan(resources, partial(plan_heap, study, resources, case=case), as_json)
    raise typer.Exit


def show_plan(resources: Resources, planned: Callable[[Speed], Plan], as_json: bool) -> None:
    """Show the plan of a command on some workers, whose speed is measured where it never was."""
    from experiments.cases.workers.speed import SPEEDS, stored_speed, user_folder
    from experiments.runs.plan import measured_speed

    measures = stored_speed(resources.machine) is None and not resources.submits_jobs
    if measures:
        messages.print(f"Measuring the speed of {resources}, once; a minute or two.")
    plan = planned(measured_speed(resources, measure=not resources.submits_jobs))
    if as_json:
        typer.echo(json.dumps(plan.to_dict(), allow_nan=False))
        return
    table = Table(title=plain(f"{plan.study}, on {plan.where}"))
    table.add_column("wave", overflow="fold")
    for name in ("cases", "at most", "grains", "steps", "time", "time at most"):
        table.add_column(name, justify="right")
    for wave in plan.waves:
        numbers = (f"{wave.cases:,}", f"{wave.most:,}", f"{wave.grains:,}", f"{wave.steps:,}")
        table.add_row(wave.name, *numbers, duration(wave.seconds), duration(wave.seconds_most))
    Console(markup=False).print(table)
    typer.echo(
        f"In all {plan.cases:,} cases, at most {plan.most:,}: {duration(plan.seconds)}, at most "
        f"{duration(plan.seconds_most)}"
    )
    typer.echo("Not counted: compiling kernels for a grain or law that is new here, 5 to 15 s, once.")
    what = "of each GPU" if plan.on_gpu else "of this machine"
    if resources.submits_jobs:
        what = "of the workers"
    typer.echo(f"Memory {what}: {_bytes(plan.memory)}. Disk: at most {_bytes(plan.disk)}")
    told = "Nothing was run, nothing was written."
    if measures:
        told = (
            f"It was stored in {user_folder() / SPEEDS}; no case was run, and no folder of results touched."
        )
    typer.echo(plain(f"Speed measured on {plan.speed.on}. {told}"))


def _bytes(number: float) -> str:
    for unit in ("B", "kB", "MB", "GB"):
        if number < 1000.0:
            return f"{number:.3g} {unit}"
        number /= 1000.0
    return f"{number:.3g} TB"
