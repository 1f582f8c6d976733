"""``dem-warp heap``: one case simulated, measured, drawn and filmed."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from experiments.commands.console import FAILED_RUN, Attempt, clear_errors, fail, messages
from experiments.commands.options import (
    AsJson,
    DryRun,
    Live,
    StudyFile,
    assignments,
    options_of,
    with_request,
)
from experiments.commands.plans import show_plan
from experiments.commands.results import print_measured, print_study
from experiments.live.server import live_page
from experiments.runs.request import RunRequest

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


@with_request("workers")
def heap(
    study: StudyFile = None,
    settings: Settings = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of sizes, places and orientations.")] = 1,
    scene: Scene = None,
    frames: Frames = None,
    movie: Annotated[
        str | None, typer.Option(metavar="KIND", help="Film of the frames: gif, mp4 or none. Default: gif.")
    ] = None,
    dry_run: DryRun = False,
    live: Live = False,
    as_json: AsJson = False,
    *,
    asked: RunRequest,
) -> None:
    """Simulate one heap: heap.vtp (ParaView, OVITO), angle.json, and snapshot.png with the fitted flanks.

    snapshot-clean.png is the same picture without them, to be shown or measured again. A test that leaves no
    heap, e.g. a drum or a ledge, gives what it measures instead of the angle; so does --scene with a further
    scene of the study.
    """
    with clear_errors():
        from experiments.runs.choices import check_scene, prepare

        what = f"{scene or 'heap'}-{seed}"
        prepared = prepare(study, replace(asked, workers=1), partial(check_scene, scene=scene), what)
        from experiments.cases.show.movie import MOVIES, require_movie
        from experiments.runs.one_heap import HeapOrder, run_heap

        require_movie(movie, frames)
        values = prepared.study.natural_settings(assignments(settings or []), "--set")
        order = HeapOrder(values, seed, scene, frames, movie or MOVIES[0])
        case = order.case(prepared.study)  # what it refuses is refused before anything is written
        if dry_run:
            from experiments.runs.plan import plan_heap

            show_plan(plan_heap(prepared, case), as_json)
    advice = Attempt.of(
        "heap", study, **options_of(prepared) | {"workers": None}, set=settings, seed=seed, scene=scene,
        frames=frames, movie=movie, live=live, json=as_json,
    )  # fmt: skip
    with clear_errors(advice), live_page(prepared.folder, live, messages.print):
        print_study(prepared.study, prepared.resources)
        simulated = run_heap(prepared, order)
    _print_heap(simulated, prepared.folder, as_json)


def _print_heap(simulated: Heap, folder: Path, as_json: bool) -> None:
    """Print where the files are and what was measured; a case that failed ends the command."""
    if as_json:
        typer.echo(json.dumps(simulated.to_dict(), allow_nan=False))
    messages.print(f"Files: {folder}")
    if simulated.reason:
        fail(f"the case ended as {simulated.result.status}: {simulated.reason}", FAILED_RUN)
    elif not as_json:
        print_measured(simulated)
