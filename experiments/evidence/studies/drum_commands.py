"""Command line that the studies of drums share: run the study, write the page of a run."""

from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import clear_errors
from experiments.commands.options import OneDevice
from experiments.io.errors import InputError
from experiments.io.files import require_folder

Out = Annotated[Path, typer.Option(help="Folder of the results.")]


def drum_commands(study: str, about: str, default: Path) -> typer.Typer:
    """Make the commands ``run`` and ``page`` of a study, whose modules begin with a name; they load late."""
    app = typer.Typer(help=about, no_args_is_help=True)

    @app.command()
    def run(
        scale: Annotated[str, typer.Option(help="h200 or bench.")] = "h200",
        device: OneDevice = None,
        workers: Annotated[int | None, typer.Option(min=1, help="Processes on a CPU.")] = None,
        out: Out = default,
    ) -> None:
        """Simulate, calibrate, predict."""
        with clear_errors("What is stored is not simulated again."):
            require_folder(out)
            import_module(f"{study}_campaign").run_study(scale, out, device, workers)

    @app.command()
    def page(out: Out = default) -> None:
        """Write the page of a finished run."""
        with clear_errors():
            print(import_module(f"{study}_page").write_record(out))

    return app


def require_run(folder: Path, *names: str) -> None:
    """Refuse a folder that a finished run has not left."""
    if lacking := [name for name in names if not (folder / name).is_file()]:
        rule = "must be the folder of a finished run: run the study first"
        raise InputError(str(folder), rule, f"without {', '.join(lacking)}")
