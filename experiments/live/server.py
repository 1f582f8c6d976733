"""A small local server: a page that watches a folder, or a page to start runs."""

from __future__ import annotations

import os
import socket
import sys
import threading
import time
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.io.errors import InputError
from experiments.live.access import TokenCheck, new_token

if TYPE_CHECKING:
    import uvicorn
    from starlette.routing import BaseRoute
    from starlette.types import ASGIApp

ADDRESS = "127.0.0.1"
"""Address of the server: nobody else reaches it."""

INSTALL = "pip install 'dem-warp[live]'"
"""Command that installs what the server needs."""

LAST_LOOK = 2.5
"""Time for which the page of a run is served after its end, so that it shows the end [s]."""

STOP_WITHIN = 5.0
"""Time that the server takes to end, at most [s]."""


def require_libraries() -> None:
    """Check that the libraries of the server are there."""
    try:
        import starlette  # noqa: F401
        import uvicorn  # noqa: F401
    except ImportError as error:
        rule = f"the page in the browser needs two more libraries: {INSTALL}"
        raise InputError("dem-warp", rule, f"no module {error.name}") from None


def guarded(routes: Sequence[BaseRoute], token: str) -> ASGIApp:
    """Build the application of some routes, which only answers requests with the token."""
    from starlette.applications import Starlette

    from experiments.live.watch_routes import refused

    handlers: dict[Any, Any] = {InputError: refused}
    return TokenCheck(Starlette(routes=list(routes), exception_handlers=handlers), token)


def watch_app(folder: Path, token: str) -> ASGIApp:
    """Build the application that watches a folder."""
    from experiments.live.watch_routes import watch_routes

    return guarded(watch_routes(lambda request: folder), token)


@dataclass(frozen=True)
class Place:
    """A socket that listens, and the token of its address."""

    socket: socket.socket
    token: str

    @classmethod
    def open(cls, port: int = 0) -> Place:
        """Bind a port of this machine, any free one where it is 0."""
        found = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        if os.name == "posix":  # elsewhere it would let two servers share a port
            found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            found.bind((ADDRESS, port))
            found.listen()  # who comes before the server has begun waits for it
        except (OSError, OverflowError) as error:
            found.close()
            reason = getattr(error, "strerror", None) or str(error)
            raise InputError("--port", f"must be a free port of this machine ({reason})", port) from None
        return cls(found, new_token())

    @property
    def port(self) -> int:
        """Number of the port."""
        return int(self.socket.getsockname()[1])

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{ADDRESS}:{self.port}/{self.token}/"


def serve(port: int, browser: bool, app_of: Callable[[str], ASGIApp], say: Callable[[str], None]) -> None:
    """Serve an application, which `app_of` makes for a token, until Ctrl-C; say its address."""
    place = Place.open(port)
    say(place.url)
    if browser:
        open_browser(place.url)
    _server(app_of(place.token)).run(sockets=[place.socket])


@contextmanager
def serving(place: Place, app: ASGIApp) -> Iterator[None]:
    """Answer from a thread while the block runs, and a moment longer, so that the page sees its end."""
    server = _server(app)
    thread = threading.Thread(target=server.run, args=([place.socket],), daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended = time.monotonic()
        while thread.is_alive() and time.monotonic() - ended < LAST_LOOK and server.server_state.connections:
            thread.join(0.1)
        server.should_exit = True
        thread.join(STOP_WITHIN)
        place.socket.close()


def _server(app: ASGIApp) -> uvicorn.Server:
    import uvicorn

    settings = uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,
        lifespan="off",
        ws="none",
        server_header=False,
        timeout_graceful_shutdown=1,
    )
    return uvicorn.Server(settings)


def can_open_browser() -> bool:
    """Tell that this machine has a screen to open a browser on."""
    if sys.platform in ("win32", "darwin"):
        return True
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))


def open_browser(url: str) -> None:
    """Open a page in the browser, where there is a screen for one."""
    if can_open_browser():
        webbrowser.open(url)


@contextmanager
def live_page(folder: Path, wanted: bool, say: Callable[[str], None]) -> Iterator[None]:
    """Serve the page of a folder while the block runs, if it is wanted, and print its address."""
    if not wanted:
        yield
        return
    require_libraries()
    place = Place.open()
    say(f"Live: {place.url}")
    with serving(place, watch_app(folder, place.token)):
        open_browser(place.url)
        yield
