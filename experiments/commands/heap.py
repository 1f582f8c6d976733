"""``dem-warp heap``: one case simulated, measured, drawn and filmed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from experiments.commands.console import FAILED_RUN, Attempt, CaseProgress, clear_errors, fail, messages
from experiments.commands.early import check_heap_file
from experiments.commands.options import (
    AsJson,
    Cluster,
    Device,
    DryRun,
    EngineName,
    Live,
    Out,
    Scale,
    Scheduler,
    StudyFile,
    assignments,
)
from experiments.commands.plans import show_plan
from experiments.commands.results import print_measured, print_narrowness
from experiments.live.server import live_page

if TYPE_CHECKING:
    from experiments.cases import Heap

HEAP_EXAMPLE = "Example: [bold]dem-warp heap --scale bench --set E=0.48 --set F=0.45 --seed 7 --frames 40[/]"

LEAST_FRAMES, MOST_FRAMES = 2, 1000

Settings = Annotated[list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="Value of a factor.")]
Scene = Annotated[
    str | None, typer.Option(metavar="NAME", help="A further scene of the study, \\[response-scene.NAME].")
]
Frames = Annotated[
    int | None,
    typer.Option(
        min=LEAST_FRAMES,
        max=MOST_FRAMES,
        metavar="N",
        help="Keep N frames of the whole test: frames/*.pvd for ParaView and OVITO (spheres; grains with "
        "orientation, velocity and spin; contacts with their forces; each wall), and a film.",
    ),
]


def heap(
    study: StudyFile = None,
    settings: Settings = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of sizes, places and orientations.")] = 1,
    scene: Scene = None,
    frames: Frames = None,
    movie: Annotated[
        str | None, typer.Option(metavar="KIND", help="Film of the frames: gif, mp4 or none. Left out: gif.")
    ] = None,
    out: Out = None,
    scale: Scale = None,
    device: Device = None,
    scheduler: Scheduler = None,
    cluster: Cluster = None,
    engine: EngineName = None,
    dry_run: DryRun = False,
    live: Live = False,
    as_json: AsJson = False,
) -> None:
    """Simulate one heap: heap.vtp (ParaView, OVITO), angle.json, and snapshot.png with the fitted flanks.

    snapshot-clean.png is the same picture without them, to be shown or measured again. A study of a hopper, a
    drum or a draw-down gives what that test measures instead of the angle; so does --scene with a further
    scene of the study.
    """
    with clear_errors():
        check_heap_file(study, scale, engine, scene)
        from experiments.cases import open_workers, require_unused, simulate_heap, with_engine, write_heap
        from experiments.cases.show.heap import filmed_by
        from experiments.cases.show.movie import MOVIES, require_movie
        from experiments.cases.workers.own import watched_by
        from experiments.io.files import require_folder
        from experiments.journal.journal import Journal
        from experiments.runs.campaign import watching
        from experiments.runs.choices import chosen_resources, chosen_study, default_folder, resources_for
        from experiments.studyfile.campaign import TARGET_SCENE

        require_movie(movie, frames)
        resources, place = chosen_resources(device, 1, scheduler, cluster), scene or TARGET_SCENE
        chosen = with_engine(chosen_study(study, scale, resources), engine)
        values = chosen.natural_settings(assignments(settings or []), "--set")
        folder = out or default_folder(chosen, f"{scene or 'heap'}-{seed}")
        resources = resources_for(chosen, resources)
        case = chosen.case(values, seed, place)  # what it refuses is refused before anything is written
        if dry_run:
            from experiments.runs.plan import plan_heap

            show_plan(plan_heap(chosen, resources, case), as_json)
    go_on = Attempt.of(
        "heap", study, out=folder, set=settings, seed=seed, scene=scene, frames=frames, movie=movie,
        scale=chosen.scale, device=device, scheduler=scheduler, cluster=cluster, engine=engine, live=live,
        json=as_json,
    )  # fmt: skip
    with clear_errors(go_on):
        require_unused(folder)
        require_folder(folder)
        print_narrowness(chosen)
        with live_page(folder, live, messages.print), open_workers(resources) as crew:
            if frames is not None:
                filmed_by(chosen, crew)
            with (
                Journal(folder, "heap", chosen, device=str(crew.described.get("device", ""))) as notes,
                watching(scene or "heap", CaseProgress, notes) as progress,
            ):
                crew = watched_by(crew, notes.glimpses)
                simulated = simulate_heap(chosen, values, seed, crew, progress, place, frames)
                write_heap(simulated, folder, movie or MOVIES[0])
    _tell_heap(simulated, folder, as_json)


def _tell_heap(simulated: Heap, folder: Path, as_json: bool) -> None:
    """Say where the files are, and what was measured; a case that failed ends the command."""
    if as_json:
        typer.echo(json.dumps(simulated.to_dict(), allow_nan=False))
    messages.print(f"Files: {folder}")
    if simulated.reason:
        fail(f"the case {simulated.result.status}: {simulated.reason}", FAILED_RUN)
    elif not as_json:
        print_measured(simulated)
