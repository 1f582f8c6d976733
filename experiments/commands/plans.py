"""``--dry-run``: what a command would run, for how long and on what; nothing is run or written."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, NoReturn

import typer
from rich.console import Console
from rich.table import Table

from experiments.commands.console import duration, plain

if TYPE_CHECKING:
    from experiments.runs.plan import Plan, PlannedBatch


def show_plan(plan: Plan, as_json: bool) -> NoReturn:
    """Show a plan, and end the command."""
    if as_json:
        typer.echo(json.dumps(plan.to_dict(), allow_nan=False))
        raise typer.Exit
    table, totals = Table(title=plain(f"{plan.study}, on {plan.where}")), plan.totals
    table.add_column("batch", overflow="fold")
    for name in ("cases", "at most", "grains", "steps", "time"):
        table.add_column(name, justify="right")
    for batch in plan.batches:
        numbers = (f"{number:,}" for number in (batch.cases, batch.most, batch.grains, batch.steps))
        table.add_row(batch.name, *numbers, _time(batch.seconds))
    Console(markup=False).print(table)
    for batch in plan.batches:
        if batch.phases:
            typer.echo(plain(f"Phases of {batch.name}: {_phases(batch)}."))
    for doubt in plan.doubts:
        typer.echo(plain(f"Doubtful: {doubt}"))
    if len(plan.shares) > 1:
        shares = ", ".join(f"{scene} {share:.0%}" for scene, share in plan.shares.items())
        typer.echo(plain(f"Work of a setting: {shares}. What a test buys, dem-warp plan finds beforehand."))
    seconds, source = totals["seconds"], totals["source"]
    what = "on each GPU" if plan.on_gpu else "on this machine"
    typer.echo(f"Cases in total: {totals['cases']:,}, at most {totals['most']:,}.")
    time = source if seconds is None else f"{duration(seconds)}, {source}"
    typer.echo(f"Time: {time}. Not counted: compiling kernels that are new here, 5 to 15 s, once.")
    typer.echo(f"Memory needed {what}: {_bytes(plan.memory)}. Disk: at most {_bytes(plan.disk)}.")
    typer.echo("Nothing was run, nothing was written.")
    raise typer.Exit


def _phases(batch: PlannedBatch) -> str:
    """Say how many steps each phase takes, its part of all, and its time where it is known."""
    parts = []
    for name, steps in batch.phases.items():
        part = steps / sum(batch.phases.values())
        time = "" if batch.seconds is None else f", {duration(part * batch.seconds)}"
        parts.append(f"{name} {steps:,} steps ({part:.0%}{time})")
    return "; ".join(parts)


def _time(seconds: float | None) -> str:
    return "unknown" if seconds is None else duration(seconds)


def _bytes(number: float) -> str:
    return f"{number / 1e9:.3g} GB" if number >= 1e9 else f"{number / 1e6:.3g} MB"
