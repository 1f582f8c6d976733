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
        typer.Argument(metavar="DIR", help="Folder of the files and the runs. Left out: the current one."),
    ] = None,
    port: Port = 0,
    no_browser: NoBrowser = False,
) -> None:
    """Start from a page in the browser: the grain, the test, the ranges, photographs; then run and watch.

    It writes the study file, and tells the command line, that you would write and call yourself. Runs that it
    started go on when it ends: dem-warp watch shows them.
    """
    with clear_errors("Runs that were started go on: dem-warp watch DIR shows them."):
        from experiments.io.errors import InputError
        from experiments.live.server import Place, open_browser, require_libraries, serve

        require_libraries()
        from experiments.live.ui.start import ui_app

        chosen = (folder or Path()).absolute()
        if not chosen.is_dir():
            raise InputError(str(folder), "must be a folder to work in", "no folder of this name")
        place = Place.open(port)
        messages.print(f"Working in {chosen}. Open this address; Ctrl-C ends it:")
        typer.echo(place.url)
        if not no_browser:
            open_browser(place.url)
        serve(place, ui_app(chosen, place.token))
