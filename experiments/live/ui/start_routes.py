"""The page to start from: what its buttons ask for, answered by the place and its runs."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.io.errors import InputError
from experiments.live.server import guarded
from experiments.live.ui.started_runs import StartedRuns
from experiments.live.ui.study_folder import LARGEST_UPLOAD, StudyFolder, command_line
from experiments.live.watch_routes import page_file, page_routes, problems_of, watch_routes
from experiments.runs.choices import default_folder
from imaging import PictureError

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.routing import Route
    from starlette.types import ASGIApp

COMMANDS = {"heap": "heap-1", "calibrate": "", "discover": "discover"}
"""Commands that can be started, and what their folder's name ends with."""

Answer = Callable[[dict[str, Any]], Any]
"""Answers what the page asks, plain values by name, with JSON-able data."""


def ui_app(folder: Path, token: str) -> ASGIApp:
    """Build the application of the page to start from."""
    return guarded(start_routes(StudyFolder(folder)), token)


def start_routes(place: StudyFolder) -> list[Route]:
    """Routes of the page to start from, and of the pages that watch its runs."""
    from starlette.concurrency import run_in_threadpool
    from starlette.responses import JSONResponse
    from starlette.routing import Route

    runs = StartedRuns(place.folder)
    answers: dict[str, Answer] = {
        "form": lambda asked: place.form(),
        "clump": place.clump,
        "angles": lambda asked: place.angles(asked["folder"], asked["fit"], asked.get("test", "")),
        "draft": lambda asked: place.draft(asked["name"], asked["values"], asked["factors"]),
        "check": lambda asked: place.checked(asked["file"], asked["text"]),
        "write": lambda asked: {"file": place.write(asked["file"], asked["text"]).name},
        "plan": lambda asked: _command(*plan(place, asked)),
        "start": lambda asked: {"folder": runs.start(*plan(place, asked))},
        "stop": lambda asked: runs.stop(asked["folder"]),
        "resume": lambda asked: {"folder": runs.resume(asked["folder"])},
        "runs": lambda asked: runs.listed(),
    }

    def page(request: Request) -> Response:
        return page_file("ui.html")

    async def ask(request: Request) -> Response:
        what = request.path_params["what"]
        if what not in answers:
            return JSONResponse({"error": "there is no such question"}, status_code=404)
        body = await request.body()
        return JSONResponse(await run_in_threadpool(answered, answers[what], body))

    async def upload(request: Request) -> Response:
        data = bytearray()
        async for part in request.stream():
            data += part
            if len(data) > LARGEST_UPLOAD:
                break  # the place says so
        name = request.path_params["name"]
        found = await run_in_threadpool(_kept, place, name, bytes(data))
        return JSONResponse(found)

    return [
        *page_routes(),
        Route("/{token}/", page),
        Route("/{token}/api/{what}", ask, methods=["POST"]),
        Route("/{token}/upload/{name:path}", upload, methods=["POST"]),
        *watch_routes(lambda request: runs.path(request.path_params["run"]), "/{token}/run/{run:path}/-"),
    ]


def answered(answer: Answer, body: bytes) -> Any:
    """Answer a question; an error has the words of the command line."""
    try:
        asked = json.loads(body or b"{}")
    except (ValueError, RecursionError):
        asked = None
    try:
        return answer({**asked})
    except InputError as error:
        return problems_of(error)
    except PictureError as error:
        return {"error": str(error), "problems": []}
    except OSError as error:
        return {"error": f"{error.filename}: {error.strerror}", "problems": []}
    except (LookupError, TypeError, AttributeError):
        return {"error": "a question must be one of the page's own", "problems": []}


def _kept(place: StudyFolder, name: str, data: bytes) -> dict[str, Any]:
    try:
        return {"file": place.keep(name, data).relative_to(place.folder).as_posix()}
    except InputError as error:
        return problems_of(error)


def plan(place: StudyFolder, asked: Mapping[str, Any]) -> tuple[tuple[str, ...], str]:
    """Write the words of a command, and the folder of its results."""
    command, file = asked["command"], asked["file"]
    if command not in COMMANDS:
        raise InputError("command", f"must be one of {', '.join(COMMANDS)}", command)
    scale = asked.get("scale") or None
    study = place.study(file, scale)
    out = asked.get("out") or default_folder(study, COMMANDS[command]).as_posix()
    words = [command, file]
    if command == "discover" and asked.get("measured"):
        words.append(asked["measured"])
    words += ["--out", out]
    for name in ("scale", "device"):
        words += [f"--{name}", asked[name]] if asked.get(name) else []
    return tuple(map(str, words)), out


def _command(words: tuple[str, ...], out: str) -> dict[str, str]:
    return {"command": command_line(*words), "out": out}
