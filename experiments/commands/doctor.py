"""``dem-warp doctor``: what this machine has, and what will be used."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated

import typer

from experiments.commands.console import FAILED_RUN, clear_errors, messages, plain
from experiments.commands.options import AsJson, Cluster, Device, Scheduler, Workers

if TYPE_CHECKING:
    from experiments.runs.examination import Finding

DOCTOR_EXAMPLE = "Example: [bold]dem-warp doctor --measure[/]"


def doctor(
    device: Device = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    cluster: Cluster = None,
    measure: Annotated[
        bool, typer.Option("--measure", help="Simulate one batch of the paper's study and note its speed.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Check this machine: GPU, driver, kernel cache, cores, memory, OpenGL, and what will be used.

    The exit code is 0 where cases can be simulated, else 1.
    """
    with clear_errors():
        from experiments.runs.choices import chosen_resources
        from experiments.runs.examination import examine, kernel_cache, measure_speed

        cache = kernel_cache()
        resources = chosen_resources(device, workers, scheduler, cluster)
        if measure:
            messages.print(f"Simulating one batch of the paper's study on {resources}.")
            measure_speed(resources)
        findings = examine(resources, cache)
    if as_json:
        typer.echo(json.dumps([finding.to_dict() for finding in findings], allow_nan=False))
    else:
        _print(findings)
    if not all(finding.good for finding in findings if finding.needed):
        raise typer.Exit(FAILED_RUN)


def _print(findings: list[Finding]) -> None:
    width = max(len(finding.name) for finding in findings)
    for finding in findings:
        mark = "ok  " if finding.good else "FAIL" if finding.needed else "-   "
        typer.echo(plain(f"{mark} {finding.name:{width}}  {finding.text}"))
        if finding.cure:
            typer.echo(plain(f"     {'':{width}}  {finding.cure}"))
