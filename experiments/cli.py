"""The command line ``dem-warp``: each command checks its input, calls public functions and shows the result.

Imports of the simulator, the statistics and the pictures are inside the commands: ``--help`` needs none.
"""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.commands.angle import ANGLE_EXAMPLE, angle
from experiments.commands.bridge import BRIDGE_EXAMPLE, bridge
from experiments.commands.clump import CLUMP_EXAMPLE, clump
from experiments.commands.console import (
    FAILED_RUN,
    Attempt,
    CaseProgress,
    clear_errors,
    messages,
)
from experiments.commands.doctor import DOCTOR_EXAMPLE, doctor
from experiments.commands.early import check_calibration_file, check_study_file
from experiments.commands.export import EXPORT_EXAMPLE, export
from experiments.commands.heap import HEAP_EXAMPLE, heap
from experiments.commands.new import NEW_EXAMPLE, new
from experiments.commands.options import (
    AsJson,
    Cluster,
    Device,
    DryRun,
    EngineName,
    Live,
    Out,
    Resume,
    Scale,
    Scheduler,
    StudyFile,
    Workers,
)
from experiments.commands.plans import show_plan
from experiments.commands.results import print_study, show_stage
from experiments.commands.ui import UI_EXAMPLE, ui
from experiments.commands.watch import WATCH_EXAMPLE, watch
from experiments.live.server import live_page

if TYPE_CHECKING:
    from experiments.api import Calibration
    from experiments.runs.search import SearchResult

app = typer.Typer(
    name="dem-warp",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from dem_warp.version import source_commit
        from experiments.io.program_version import program_version

        commit = source_commit()
        typer.echo(f"dem-warp {program_version()}" + (f" ({commit})" if commit else ""))
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """Calibrate discrete element models of grain: simulated heaps, designed experiments, repose angles."""


@app.command(epilog="Example: [bold]dem-warp calibrate mygrain.toml --out out/mygrain[/]")
def calibrate(
    study: StudyFile = None,
    out: Out = None,
    scale: Scale = None,
    device: Device = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    cluster: Cluster = None,
    engine: EngineName = None,
    resume: Resume = False,
    dry_run: DryRun = False,
    follow_paper: Annotated[
        bool, typer.Option("--follow-paper", help="Simulate the paper's own runs too, and set them beside.")
    ] = False,
    only_paper: Annotated[
        bool, typer.Option("--only-paper", help="Simulate the paper's own runs, and no campaign.")
    ] = False,
    paper_replicates: Annotated[int, typer.Option(min=1, help="Heaps of each of the paper's runs.")] = 3,
    live: Live = False,
    as_json: AsJson = False,
) -> None:
    """Run a whole calibration: noise floor, screening, climb, surface, optimum, verification, report."""
    with clear_errors():
        if only_paper:
            check_study_file(study, scale, engine)
        else:
            check_calibration_file(study, scale, engine)
        from experiments import api
        from experiments.runs.choices import chosen_resources, chosen_study, default_folder, resources_for

        asked: Any = {"device": device, "workers": workers, "scheduler": scheduler, "cluster": cluster}
        resources = chosen_resources(**asked)
        chosen = chosen_study(study, scale, resources)
        folder = out or default_folder(chosen)
        published = paper_replicates if follow_paper or only_paper else 0
        if dry_run:
            from experiments.runs.plan import plan_calibration

            plan = plan_calibration(chosen, resources_for(chosen, resources), published, not only_paper)
            show_plan(plan, as_json)
    go_on = Attempt.of(
        "calibrate", study, out=folder, scale=chosen.scale, **asked, engine=engine,
        follow_paper=follow_paper, only_paper=only_paper, live=live,
        paper_replicates=published or None, json=as_json,
    )  # fmt: skip
    with clear_errors(go_on), live_page(folder, live, messages.print):
        print_study(chosen, resources_for(chosen, resources))
        ended = api.calibrate(
            chosen,
            folder,
            **asked,
            engine=engine,
            resume=resume,
            published_replicates=published,
            campaign=not only_paper,
            watch=CaseProgress,
            on_stage=show_stage,
        )
    _tell_calibration(ended, as_json)


def _tell_calibration(ended: Calibration, as_json: bool) -> None:
    """Say how a calibration ended, and where its pages are."""
    if ended.record is not None:
        messages.print(f"Published runs: {ended.record}")
    if as_json:
        typer.echo(json.dumps(ended.to_dict(), allow_nan=False))
    if (campaign := ended.campaign) is None:
        return
    messages.print(f"{campaign.outcome}: {campaign.reason}")
    messages.print(f"Report: {ended.report}")
    if campaign.outcome == "too-many-failed-runs":
        raise typer.Exit(FAILED_RUN)


@app.command(epilog="Example: [bold]dem-warp discover mygrain.toml mygrain-measured.csv --out out/lacks[/]")
def discover(
    study: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Study file with its conditions.")],
    measured: Annotated[
        Path | None,
        typer.Argument(
            metavar="MEASURED.csv", help="Measured heaps; left out: only the library waves are run."
        ),
    ] = None,
    out: Out = None,
    bank: Annotated[
        Path | None, typer.Option(help="Library waves run earlier for this study; left out: they are run.")
    ] = None,
    photographs_only: Annotated[
        bool, typer.Option("--photographs-only", help="Look only at what photographs show.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the bootstraps and of the fresh runs.")] = 1,
    scale: Scale = None,
    device: Device = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    cluster: Cluster = None,
    engine: EngineName = None,
    resume: Resume = False,
    dry_run: DryRun = False,
    live: Live = False,
    as_json: AsJson = False,
) -> None:
    """Find the effect that a model lacks: calibrate, test the gap, name what explains it, show it closed."""
    with clear_errors():
        check_study_file(study, scale, engine)
        from experiments import api
        from experiments.runs.choices import chosen_resources, chosen_study, default_folder, resources_for

        asked: Any = {"device": device, "workers": workers, "scheduler": scheduler, "cluster": cluster}
        resources = chosen_resources(**asked)
        chosen = chosen_study(study, scale, resources)
        folder = out or default_folder(chosen, "discover")
        if dry_run:
            from experiments.runs.plan import plan_search
            from experiments.runs.search import Job

            job = Job(chosen, measured, folder, bank, photographs_only, seed=seed)
            show_plan(plan_search(job, resources_for(chosen, resources)), as_json)
    go_on = Attempt.of(
        "discover", study, measured, out=folder, bank=bank, photographs_only=photographs_only, scale=scale,
        **asked, seed=seed, engine=engine, live=live, json=as_json,
    )  # fmt: skip
    with clear_errors(go_on), live_page(folder, live, messages.print):
        print_study(chosen, resources_for(chosen, resources))
        ended = api.discover(
            chosen,
            measured,
            folder,
            bank=bank,
            photographs_only=photographs_only,
            seed=seed,
            **asked,
            engine=engine,
            resume=resume,
            watch=CaseProgress,
        )
    _tell_search(ended, as_json)


def _tell_search(ended: SearchResult, as_json: bool) -> None:
    """Say what a search found, and where its page is."""
    from experiments.report.discovery import results_of, verdict_line

    if ended.discovery is None:
        messages.print(f"Library waves: {ended.page}")
        return
    if as_json:
        typer.echo(json.dumps(results_of(ended.discovery, ended.terms), allow_nan=False))
    messages.print(verdict_line(ended.discovery, ended.terms))
    messages.print(f"Report: {ended.page}")


app.command(epilog=HEAP_EXAMPLE)(heap)
app.command(epilog=ANGLE_EXAMPLE)(angle)
app.command(epilog=CLUMP_EXAMPLE)(clump)
app.command(epilog=NEW_EXAMPLE)(new)
app.command(epilog=EXPORT_EXAMPLE)(export)
app.command(epilog=BRIDGE_EXAMPLE)(bridge)
app.command(epilog=DOCTOR_EXAMPLE)(doctor)
app.command(epilog=WATCH_EXAMPLE)(watch)
app.command(epilog=UI_EXAMPLE)(ui)


def main() -> None:
    """Run the command line."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # a console of another encoding than UTF-8 shows an escape for what it lacks
            stream.reconfigure(errors="backslashreplace")
    app()
