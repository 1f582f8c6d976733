"""Options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

StudyFile = Annotated[
    Path | None, typer.Argument(metavar="STUDY.toml", help="Study file; left out: the paper's buckwheat.")
]
Scale = Annotated[
    str | None,
    typer.Option(
        help="A scale of the study; the paper's has bench, soft and paper. Left out: paper with a CUDA "
        "device, bench without, where the study has it.",
    ),
]
Device = Annotated[
    str | None,
    typer.Option(
        help="cpu, cuda, cuda:N or several GPUs, as cuda:0,cuda:1. Left out: the GPU if there is one."
    ),
]
OneDevice = Annotated[
    str | None,
    typer.Option(
        help="cpu, cuda or cuda:N. Left out: the GPU if there is one.",
        callback=lambda name: present_device(name),
    ),
]
Workers = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Processes on the CPU, GPUs of this machine, or workers of a cluster. Left out: one a core, one "
        "GPU, or as the cluster's profile says.",
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Dask scheduler whose workers simulate, as tcp://HOST:8786."),
]
Cluster = Annotated[
    Path | None,
    typer.Option(
        metavar="PROFILE.toml",
        help="File with a \\[cluster], whose workers are started. Left out: the study's, or none.",
    ),
]
EngineName = Annotated[
    str | None,
    typer.Option(
        "--engine", metavar="NAME", help="Engine that simulates. Left out: the study's, or dem-warp's own."
    ),
]
Out = Annotated[Path | None, typer.Option(help="Folder of the results, new or empty.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on in the folder of an earlier run.")]
Live = Annotated[
    bool, typer.Option("--live", help="Show the run in the browser while it lasts, as dem-warp watch does.")
]
Port = Annotated[
    int, typer.Option(min=0, max=65535, help="Port of the address. 0: any that is free.", show_default=False)
]
NoBrowser = Annotated[bool, typer.Option("--no-browser", help="Only tell the address, open no browser.")]
DryRun = Annotated[
    bool,
    typer.Option("--dry-run", help="Show cases, grains, steps, time, memory and disk, and run nothing."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Write the result to standard output as JSON.")]


def present_device(name: str | None) -> str | None:
    """Refuse a device that is not there, before a script has written anything."""
    if name is None:
        return None
    from dem_warp.device import resolve_device

    try:
        return resolve_device(name)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None


def assignments(texts: list[str]) -> dict[str, str]:
    """Split ``NAME=VALUE`` options."""
    from experiments.io.errors import InputError

    pairs = [text.partition("=") for text in texts]
    for text, (name, equals, value) in zip(texts, pairs, strict=True):
        if not (name.strip() and equals and value.strip()):
            raise InputError("--set", "needs NAME=VALUE, for example E=0.48", text)
    return {name.strip(): value.strip() for name, _, value in pairs}
