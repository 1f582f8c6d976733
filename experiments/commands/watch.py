"""``dem-warp watch``: a page in the browser that shows a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import clear_errors, messages
from experiments.commands.options import NoBrowser, Port

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

    then open the printed address in a browser here.
    """
    with clear_errors("The run continues, if it was running."):
        from experiments.io.errors import InputError
        from experiments.live.server import require_libraries, serve, watch_app

        require_libraries()
        if not folder.is_dir():
            raise InputError(str(folder), "no such folder")
        messages.print(f"Watching {folder}. Open this address; Ctrl-C ends it:")
        serve(port, not no_browser, lambda token: watch_app(folder, token), typer.echo)
