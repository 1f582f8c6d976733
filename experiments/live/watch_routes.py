"""The page that watches a folder: its files, the state of the run, its heaps, its outputs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from plotly.offline import get_plotlyjs

from experiments.io.errors import InputError
from experiments.io.plain_data import jsonable
from experiments.live.access import FILE_POLICY
from experiments.live.drawn_heaps import heap_spheres
from experiments.live.run_charts import charts_of
from experiments.live.run_files import inside
from experiments.live.run_state import RunState

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.routing import Route

PAGES = {
    "watch.html": "text/html", "ui.html": "text/html", "style.css": "text/css", "page.js": "text/javascript",
    "heap_view.js": "text/javascript", "watch.js": "text/javascript", "ui.js": "text/javascript",
}  # fmt: skip
"""Files of the pages and their kinds."""

VIEWER = "heap_view.js"
"""File of the viewer in three dimensions, which the report has too."""

KINDS = {
    ".html": "text/html", ".csv": "text/csv", ".json": "application/json", ".toml": "text/plain",
    ".png": "image/png", ".jpg": "image/jpeg", ".gif": "image/gif", ".mp4": "video/mp4", ".txt": "text/plain",
}  # fmt: skip
"""Files of a run that are handed out, by their ending."""

CASE_ROWS = 200
"""Cases of the page's table, the last ones."""

HIDDEN = ("name", "case_key", "scene")
"""Columns of a case that people have no use for."""

FolderOf = Callable[["Request"], Path]
"""Finds the folder that a request is about."""


def page_file(name: str) -> Response:
    """Answer with a file of the pages."""
    from starlette.responses import Response

    folder = "report/kit/templates" if name == VIEWER else "live/pages"
    text = files("experiments").joinpath(folder, name).read_text(encoding="utf-8")
    return Response(text, media_type=PAGES[name])


def page_routes(base: str = "/{token}") -> list[Route]:
    """Routes of the files that the pages below a path load."""
    from starlette.responses import Response
    from starlette.routing import Route

    def plotly(request: Request) -> Response:
        return Response(get_plotlyjs(), media_type="text/javascript")

    def page(request: Request) -> Response:
        name = request.path_params["name"]
        return page_file(name) if name in PAGES and not name.endswith(".html") else _missing()

    return [Route(f"{base}/plotly.js", plotly), Route(f"{base}/pages/{{name}}", page)]


def watch_routes(folder_of: FolderOf, base: str = "/{token}") -> list[Route]:
    """Routes of the page that watches a folder, and of all that it loads, below a path."""
    from starlette.concurrency import run_in_threadpool
    from starlette.responses import FileResponse, Response
    from starlette.routing import Route

    def page(request: Request) -> Response:
        folder_of(request)
        return page_file("watch.html")

    async def state(request: Request) -> Response:
        folder = folder_of(request)
        body = await run_in_threadpool(state_text, folder)
        tag = f'"{hashlib.sha256(body).hexdigest()[:32]}"'
        if request.headers.get("if-none-match") == tag:
            return Response(status_code=304, headers={"ETag": tag})
        return Response(body, media_type="application/json", headers={"ETag": tag})

    async def heap(request: Request) -> Response:
        folder = folder_of(request)
        try:
            found = await run_in_threadpool(heap_spheres, folder, request.path_params["id"])
        except InputError:
            return Response(status_code=204)  # the preview of a case that has just ended is gone
        spheres, phase, fraction = found
        headers = {"X-Phase": phase.encode("ascii", "replace").decode(), "X-Fraction": f"{fraction:.4f}"}
        return Response(spheres.tobytes(), media_type="application/octet-stream", headers=headers)

    def file(request: Request) -> Response:
        path = inside(folder_of(request), request.path_params["path"])
        hidden = any(part.startswith(".") for part in Path(request.path_params["path"]).parts)
        if hidden or path.suffix.lower() not in KINDS:
            return _missing()
        kind = KINDS[path.suffix.lower()]
        return FileResponse(path, media_type=kind, headers={"Content-Security-Policy": FILE_POLICY})

    return [
        *page_routes(base),
        Route(f"{base}/", page),
        Route(f"{base}/state.json", state),
        Route(f"{base}/heap/{{id:path}}", heap),
        Route(f"{base}/file/{{path:path}}", file),
    ]


def state_text(folder: Path) -> bytes:
    """State of a folder as JSON for the page."""
    state = RunState.read(folder)
    shown = {
        "folder": str(folder.resolve().name or folder),
        "run": state.run.model_dump(include={"command", "study", "scale", "device"}),
        "progress": state.progress.model_dump() | {"left_text": state.left},
        "log": [line.model_dump() for line in state.log],
        "cases": _case_table(state),
        "heaps": state.heaps,
        "stages": [stage.model_dump() for stage in state.stages],
        "outputs": state.outputs,
        "charts": [
            {"name": chart.name, "caption": chart.caption, "figure": json.loads(chart.json)}
            for chart in charts_of(state)
        ],
    }
    return json.dumps(jsonable(shown), allow_nan=False).encode()


def _case_table(state: RunState) -> dict[str, Any]:
    """Return the cases that ended last, and how many there are."""
    ended = [case for case in state.cases.values() if "status" in case]
    shown = ended[-CASE_ROWS:][::-1]
    columns = list(dict.fromkeys(key for case in shown for key in case if key not in HIDDEN))
    columns = [name for name in columns if any(case.get(name) not in (None, "") for case in shown)]
    rows = [[case.get(name) for name in columns] for case in shown]
    return {"columns": columns, "rows": rows, "ended": len(ended), "planned": len(state.cases)}


def problems_of(error: InputError) -> dict[str, Any]:
    """Return the message of an error, and the place, problem and value of each fault."""
    rows = [{"problem": each.problem, "value": each.value, "place": each.place} for each in error.problems]
    return {"error": str(error), "problems": rows}


def refused(request: Request, error: Exception) -> Response:
    """Answer an input error with the command line's message."""
    from starlette.responses import JSONResponse

    return JSONResponse(problems_of(error) if isinstance(error, InputError) else {}, status_code=422)


def _missing() -> Response:
    from starlette.responses import JSONResponse

    return JSONResponse({"error": "no such file"}, status_code=404)
