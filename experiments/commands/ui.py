"""``dem-warp ui``: a page in the browser to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import clear_errors, messages
from experiments.commands.options import NoBrowser, Port

UI_EXAMPLE = "Example: [bold]dem-warp ui mygrains[/]"


def ui(
    folder: Annotated[
        Path | None,
        typer.Argument(
            metavar="DIR",
            help="Folder of the files and the runs, made if it is missing. Default: the current folder.",
        ),
    ] = None,
    port: Port = 0,
    no_browser: NoBrowser = False,
) -> None:
    """Open a page in the browser to describe grain, test, ranges and photographs, then run and watch.

    It writes the study file and shows the command that you would type. Its runs
    continue when it ends: dem-warp watch shows them.
    """
    with clear_errors("Started runs continue: dem-warp watch DIR shows them."):
        from experiments.io.errors import InputError
        from experiments.live.server import require_libraries, serve

        require_libraries()
        from experiments.live.ui.start_routes import ui_app

        chosen = (folder or Path()).absolute()
        if chosen.exists() and not chosen.is_dir():
            raise InputError(str(folder), "must be a folder, and is a file")
        chosen.mkdir(parents=True, exist_ok=True)
        messages.print(f"Working in {chosen}. Open this address; Ctrl-C ends it:")
        serve(port, not no_browser, lambda token: ui_app(chosen, token), typer.echo)
