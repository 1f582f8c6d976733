"""``dem-warp export``: a card or a study as input of another code."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import clear_errors, messages
from experiments.commands.options import AsJson, Out, Scale, assignments

EXPORT_EXAMPLE = "Example: [bold]dem-warp export out/mygrain/material.toml --to liggghts --out lift[/]"


def export(
    source: Annotated[
        Path | None,
        typer.Argument(
            metavar="CARD|STUDY", help="Material card or study file. Default: the paper's buckwheat."
        ),
    ] = None,
    to: Annotated[str, typer.Option(metavar="NAME", help="Target code, e.g. liggghts.")] = "",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Value of a factor. Default: its middle."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of sizes, places and orientations.")] = 1,
    scene: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="A further scene of the study, \\[response-scene.NAME]."),
    ] = None,
    approximate: Annotated[
        bool,
        typer.Option(
            "--approximate",
            help="Replace what the code lacks by the nearest it has, with a warning in the input.",
        ),
    ] = False,
    out: Out = None,
    scale: Scale = None,
    as_json: AsJson = False,
) -> None:
    """Write the same test as the input of another code: clump, walls, filling, lift, laws, and a README.

    What the code lacks is rejected by name, or approximated with a warning at the top of the input.
    """
    with clear_errors():
        from experiments.cases import require_unused
        from experiments.commands.leaving import exported_test, study_of, with_card_warnings
        from experiments.export import export_input, write_export
        from experiments.io.files import require_folder
        from experiments.runs.choices import default_folder
        from experiments.studyfile.campaign import TARGET_SCENE

        study = study_of(source, scale)
        values = study.natural_settings(assignments(settings or []), "--set")
        test = exported_test(study, values, seed, scene or TARGET_SCENE)
        translation = with_card_warnings(export_input(test, to, approximate), study, to)
        folder = out or default_folder(study, to)
        require_unused(folder)
        require_folder(folder)
        files = write_export(test, to, translation, folder)
    for warning in translation.warnings:
        messages.print(f"Not the same there: {warning}")
    if as_json:
        typer.echo(json.dumps(translation.to_dict() | {"folder": str(folder)}, allow_nan=False))
    messages.print(f"Files: {folder}: {', '.join(file.name for file in files)}")
    if translation.command:
        messages.print(f"Run there: {' '.join(translation.command)}")
