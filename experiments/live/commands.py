"""``dem-warp watch`` and ``dem-warp ui``: pages in the browser that show a run, and that begin one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import clear_errors, messages
from experiments.commands.options import NoBrowser, Port

UI_EXAMPLE = "Example: [bold]dem-warp ui mygrains[/]"
WATCH_EXAMPLE = "Example: [bold]dem-warp watch out/mygrain[/]"


def watch(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of a calibrate, discover or heap: its --out.")
    ],
    port: Port = 0,
    no_browser: NoBrowser = False,
) -> None:
    """Show a run in the browser: its heaps as they form, tables and charts as they fill, time left, log.

    The run may be running, finished or interrupted; nothing in its folder is changed. The page is served to
    this machine alone, at an address with a secret token; Ctrl-C ends it.

    A run on another machine: start dem-warp watch DIR --port 8765 there, and here

      ssh -L 8765:127.0.0.1:8765 THAT-MACHINE

    then open the address that it told in a browser here.
    """
    with clear_errors("The run itself goes on, if it was running."):
        from experiments.errors import InputError
        from experiments.live.server import Place, open_browser, require_libraries, serve, watch_app

        require_libraries()
        if not folder.is_dir():
            raise InputError("must be the folder of a run", "no folder of this name", str(folder))
        place = Place.open(port)
        messages.print(f"Watching {folder}. Open this address; Ctrl-C ends it:")
        typer.echo(place.url)
        if not no_browser:
            open_browser(place.url)
        serve(place, watch_app(folder, place.token))


def ui(
    folder: Annotated[
        Path | None,
        typer.Argument(metavar="[DIR]", help="Folder of the files and the runs. Left out: the current one."),
    ] = None,
    port: Port = 0,
    no_browser: NoBrowser = False,
) -> None:
    """Start from a page in the browser: the grain, the test, the ranges, photographs; then run and watch.

    It writes the study file, and tells the command line, that you would write and call yourself. Runs that it
    started go on when it ends: dem-warp watch shows them.
    """
    with clear_errors("Runs that were started go on: dem-warp watch DIR shows them."):
        from experiments.errors import InputError
        from experiments.live.server import Place, open_browser, require_libraries, serve, ui_app

        require_libraries()
        chosen = (folder or Path()).absolute()
        if not chosen.is_dir():
            raise InputError("must be a folder to work in", "no folder of this name", str(folder))
        place = Place.open(port)
        messages.print(f"Working in {chosen}. Open this address; Ctrl-C ends it:")
        typer.echo(place.url)
        if not no_browser:
            open_browser(place.url)
        serve(place, ui_app(chosen, place.token))
