"""Options that several commands have."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from inspect import Parameter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.commands.console import CaseProgress
from experiments.runs.request import RunRequest

if TYPE_CHECKING:
    from experiments.runs.choices import Prepared

StudyFile = Annotated[
    Path | None, typer.Argument(metavar="STUDY.toml", help="Study file. Default: the paper's buckwheat.")
]
Scale = Annotated[
    str | None,
    typer.Option(
        help="Scale of the study; the paper's has bench, soft and paper. Default: paper with a CUDA device, "
        "bench without, where the study has it.",
    ),
]
Device = Annotated[
    str | None,
    typer.Option(help="cpu, cuda, cuda:N or several GPUs, e.g. cuda:0,cuda:1. Default: the GPU if present."),
]
OneDevice = Annotated[
    str | None,
    typer.Option(
        help="cpu, cuda or cuda:N. Default: the GPU if present.",
        callback=lambda name: present_device(name),
    ),
]
Workers = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Processes on the CPU, GPUs of this machine, or workers of a cluster. Default: one a core, one "
        "GPU, or as many as the cluster's profile says.",
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Address of a Dask scheduler, e.g. tcp://HOST:8786."),
]
Cluster = Annotated[
    Path | None,
    typer.Option(
        metavar="PROFILE.toml",
        help="File with a \\[cluster], whose workers are started. Default: the study's, if it has one.",
    ),
]
EngineName = Annotated[
    str | None,
    typer.Option(
        "--engine", metavar="NAME", help="Engine that simulates. Default: the study's, or dem-warp's own."
    ),
]
Out = Annotated[Path | None, typer.Option(help="Folder of the results, new or empty.")]
Resume = Annotated[bool, typer.Option("--resume", help="Continue the run of the folder.")]
Live = Annotated[
    bool, typer.Option("--live", help="Show the run in the browser while it works, as dem-warp watch does.")
]
Port = Annotated[
    int, typer.Option(min=0, max=65535, help="Port of the address. 0: any that is free.", show_default=False)
]
NoBrowser = Annotated[bool, typer.Option("--no-browser", help="Print the address; do not open a browser.")]
DryRun = Annotated[
    bool,
    typer.Option("--dry-run", help="Show cases, grains, steps, time, memory and disk, and run nothing."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Write the result to standard output as JSON.")]

REQUEST: dict[str, Any] = {
    "out": Out,
    "scale": Scale,
    "device": Device,
    "workers": Workers,
    "scheduler": Scheduler,
    "cluster": Cluster,
    "engine": EngineName,
    "resume": Resume,
}
"""Options of a `RunRequest`, by the names of its fields."""


def with_request(*without: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command the options of a `RunRequest`, which it takes as ``asked``, but for those named."""
    names = [name for name in REQUEST if name not in without]

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @wraps(command)
        def called(**given: Any) -> None:
            asked = RunRequest(**{name: given.pop(name) for name in names}, watch=CaseProgress)
            command(asked=asked, **given)

        own = inspect.signature(command, eval_str=True).parameters.values()
        options = [
            Parameter(
                name, Parameter.KEYWORD_ONLY, default=getattr(RunRequest, name), annotation=REQUEST[name]
            )
            for name in names
        ]
        taken = [each.replace(kind=Parameter.KEYWORD_ONLY) for each in own if each.name != "asked"]
        # typer reads both
        signature = inspect.Signature([*taken, *options])
        called.__dict__["__signature__"] = signature
        called.__annotations__ = {name: each.annotation for name, each in signature.parameters.items()}
        return called

    return decorate


def options_of(prepared: Prepared) -> dict[str, Any]:
    """Options of the command that continues a run."""
    given = {name: getattr(prepared.request, name) for name in REQUEST if name != "resume"}
    return given | {"out": prepared.folder, "scale": prepared.study.scale}


def show_version(wanted: bool) -> None:
    """Print the version, and end the command."""
    if wanted:
        from dem_warp.version import source_commit
        from experiments.io.program_version import program_version

        commit = source_commit()
        typer.echo(f"dem-warp {program_version()}" + (f" ({commit})" if commit else ""))
        raise typer.Exit


def present_device(name: str | None) -> str | None:
    """Refuse a missing device, before a script has written anything."""
    if name is None:
        return None
    from dem_warp.device import resolve_device

    try:
        return resolve_device(name)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None


def assignments(texts: list[str], option: str = "--set", example: str = "E=0.48") -> dict[str, str]:
    """Split ``NAME=VALUE`` options."""
    from experiments.io.errors import InputError

    pairs = [text.partition("=") for text in texts]
    for text, (name, equals, value) in zip(texts, pairs, strict=True):
        if not (name.strip() and equals and value.strip()):
            raise InputError(option, f"needs NAME=VALUE, for example {example}", text)
    return {name.strip(): value.strip() for name, _, value in pairs}
