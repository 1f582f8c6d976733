"""The page to start from: its answers are those of the commands, and it writes what they take."""

import contextlib
import json
import shlex
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import trimesh
from commandline import dem_warp
from conftest import photograph
from drawn_drums import draw_drum
from starlette.testclient import TestClient

from dem_warp import SCENES
from experiments.io.toml_files import read_toml
from experiments.live.run_state import RunState
from experiments.live.ui import started_runs, study_folder
from experiments.live.ui.start_routes import ui_app
from experiments.live.ui.study_folder import plain_value
from experiments.studyfile import load_study

TOKEN = "a-secret-token"

Ask = Callable[..., Any]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder in which a person works; the commands are called in it too."""
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    return work


@pytest.fixture
def client(folder: Path) -> TestClient:
    headers = {"X-Dem-Warp": "1"}
    return TestClient(ui_app(folder, TOKEN), base_url="http://127.0.0.1:8765", headers=headers)


@pytest.fixture
def ask(client: TestClient) -> Ask:
    """Ask the server as the page does."""

    def question(what: str, **asked: Any) -> Any:
        return client.post(f"/{TOKEN}/api/{what}", content=json.dumps(asked)).json()

    return question


@pytest.fixture
def upload(client: TestClient) -> Callable[[str, bytes], dict[str, Any]]:
    return lambda name, data: client.post(f"/{TOKEN}/upload/{name}", content=data).json()


def form_values(form: dict[str, Any]) -> tuple[dict[str, str], list[dict[str, str]]]:
    """Values of the form as it is first shown."""
    template, values = form["template"], {}

    def collect(table: dict[str, Any], path: str) -> None:
        for key, value in table.items():
            if isinstance(value, dict):
                collect(value, f"{path}{key}.")
            elif not isinstance(value, list):
                values[f"{path}{key}"] = str(value)

    collect({key: table for key, table in template.items() if key not in ("name", "campaign")}, "")
    return values, [{key: str(value) for key, value in each.items()} for each in template["factor"]]


def test_the_untouched_form_writes_the_template(ask: Ask, folder: Path) -> None:
    """The study is the one that ``dem-warp new`` writes, but for what both leave at its default."""
    values, factors = form_values(ask("form"))
    answer = ask("draft", name="mygrain", values=values, factors=factors)
    assert "error" not in answer
    assert list(folder.iterdir()) == [], "a draft leaves nothing"
    assert ask("write", file=answer["file"], text=answer["text"]) == {"file": "mygrain.toml"}
    assert dem_warp("new", "other")[0] == 0
    ours, theirs = (load_study(folder / name).document for name in ("mygrain.toml", "other.toml"))
    theirs.pop("campaign")
    assert ours | {"name": ""} == theirs | {"name": ""}


@pytest.mark.parametrize(
    ("place", "value"),
    [
        ("grain.density", "28,5 kg/m^3"), ("scene.lifted-cylinder.colour", "red"), ("target.n", "1"),
        ("grain.density", '700 kg/m^3"\n[evil]\nx = 1'),
    ],
)  # fmt: skip
def test_a_wrong_value_gets_the_command_lines_own_message(
    ask: Ask, folder: Path, place: str, value: str
) -> None:
    values, factors = form_values(ask("form"))
    answer = ask("draft", name="mygrain", values=values | {place: value}, factors=factors)
    assert answer["error"]
    assert ask("write", file="mygrain.toml", text=answer["text"])["error"] == answer["error"]
    assert list(folder.iterdir()) == []
    (folder / "mygrain.toml").write_text(answer["text"], encoding="utf-8")
    code, _, messages = dem_warp("heap", "mygrain.toml", "--device", "cpu")
    assert code == 2
    assert messages == f"Error: {answer['error']}\n"


def test_a_wrong_name_gets_the_command_lines_own_message(ask: Ask, folder: Path) -> None:
    values, factors = form_values(ask("form"))
    for name in ("", "../evil", "a/b", ".hidden", "a\0b", "x" * 300):
        assert ask("draft", name=name, values=values, factors=factors)["error"]
    assert list(folder.parent.rglob("*.toml")) == []


def test_a_study_never_overwrites_a_file(ask: Ask, folder: Path) -> None:
    dem_warp("new", "mygrain")
    before = (folder / "mygrain.toml").read_bytes()
    assert "never overwrites" in ask("write", file="mygrain.toml", text="name = 'other'")["error"]
    assert (folder / "mygrain.toml").read_bytes() == before


def test_fields_are_read_as_a_file_would() -> None:
    read = {"0.3": 0.3, "5": 5, "true": True, "2 mm": "2 mm", "1\n[x]": "1\n[x]", "[1]": "[1]", " a ": "a"}
    assert {text: plain_value(text) for text in read} == read


@pytest.mark.usefixtures("_coarse_clumps")
def test_a_grain_from_an_stl_is_that_of_the_command(ask: Ask, upload: Callable, folder: Path) -> None:
    grain = trimesh.creation.icosphere(subdivisions=3, radius=3.0)
    assert upload("my grain.stl", grain.export(file_type="stl")) == {"file": "my grain.stl"}
    asked = {"source": "my grain.stl", "spheres": "4", "protrusion": "auto", "density": "700 kg/m^3"}
    made = ask("clump", **asked, out="mine.txt")
    words = shlex.split(made["command"])
    assert words[:3] == ["dem-warp", "clump", "my grain.stl"]
    (folder / "mine.txt").rename(folder / "page.txt")
    code, answer, _ = dem_warp(*words[1:], "--json")
    assert code == 0
    assert json.loads(answer) == made["facts"]
    assert (folder / "mine.txt").read_bytes() == (folder / "page.txt").read_bytes()
    # the preview: as many spheres, and the triangles of the solid
    assert len(made["spheres"]) == 5 * made["facts"]["sphere_count"]
    assert len(made["faces"]) == 9 * len(grain.faces)
    assert np.abs(made["faces"]).max() == pytest.approx(3.0e-3, rel=1e-3)


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"source": "ellipsoid:6x3x2", "spheres": "x"}, None),
        ({"source": "egg:6", "spheres": "3"}, ["egg:6", "--spheres", "3"]),
        ({"source": "broken.stl", "spheres": "3"}, ["broken.stl", "--spheres", "3"]),
        (
            {"source": "ball.stl", "spheres": "3", "unit": "furlong"},
            ["ball.stl", "--spheres", "3", "--unit", "furlong"],
        ),
        ({"source": "../secret.stl", "spheres": "3"}, None),
    ],
)
def test_a_bad_shape_gets_the_command_lines_own_message(
    ask: Ask, upload: Callable, folder: Path, asked: dict[str, str], words: list[str] | None
) -> None:
    ball = trimesh.creation.icosphere(subdivisions=1, radius=2.0)
    upload("ball.stl", ball.export(file_type="stl"))
    upload("broken.stl", b"no mesh at all")
    (folder.parent / "secret.stl").write_bytes(b"secret")
    answer = ask("clump", **asked)["error"]
    assert answer
    if words is not None:
        code, _, messages = dem_warp("clump", *words)
        assert code == 2
        assert messages.replace(f"{folder}/", "") == f"Error: {answer.replace(f'{folder}/', '')}\n"


@pytest.mark.parametrize(
    "name",
    ["../evil.stl", "%2e%2e/evil.stl", "a/b/c.stl", ".hidden", "%2fetc/x", "a%00.stl", "linked/x.stl", ""],
)
def test_an_upload_stays_in_the_folder(upload: Callable, folder: Path, tmp_path: Path, name: str) -> None:
    (folder / "linked").symlink_to(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    with contextlib.suppress(json.JSONDecodeError):  # the path itself drops the dots: there is no such page
        assert upload(name, b"data")["error"]
    assert sorted(tmp_path.rglob("*")) == before


def test_an_upload_overwrites_nothing_and_has_an_end(
    upload: Callable, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert upload("a.stl", b"one") == {"file": "a.stl"}
    assert upload("a.stl", b"one") == {"file": "a.stl"}
    assert "the file exists" in upload("a.stl", b"two")["error"]
    assert (folder / "a.stl").read_bytes() == b"one"
    monkeypatch.setattr(study_folder, "LARGEST_UPLOAD", 3)
    assert "at most 3 bytes" in upload("b.stl", b"four")["error"]
    assert not (folder / "b.stl").exists()


def test_photographs_are_measured_as_the_command_does(ask: Ask, upload: Callable, folder: Path) -> None:
    for number, slope in enumerate((0.5, 0.55, 0.6)):
        upload(f"mine-photos/{number}.png", photograph(slope))
    answer = ask("angles", folder="mine-photos", fit="flank")
    code, out, _ = dem_warp(*shlex.split(answer["command"])[1:], "--json")
    measured = json.loads(out)["pictures"]
    assert [row["mean"] for row in answer["rows"]] == [row["mean"] for row in measured]
    assert code in (0, 2)
    assert ask("angles", folder="mine-photos", fit="none")["error"]
    for place in ("..", "none", "/etc", ".hidden"):
        assert ask("angles", folder=place, fit="flank")["error"], place


def test_drums_are_measured_as_the_command_does(ask: Ask, upload: Callable) -> None:
    for number, slope in enumerate((30.0, 33.0)):
        upload(f"mine-photos/{number}.png", cv2.imencode(".png", draw_drum(slope))[1].tobytes())
    answer = ask("angles", folder="mine-photos", fit="flank", test="drum")
    # The promise for drawn drums.
    assert [row["mean"] for row in answer["rows"]] == pytest.approx([30.0, 33.0], abs=0.3)
    assert "--drum" in answer["command"]


def test_the_command_line_is_the_one_that_is_called(
    ask: Ask, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = "import json, sys; json.dump(sys.argv[1:], open('called.json', 'w')); sys.exit(2)"
    monkeypatch.setattr(started_runs, "PROGRAM", (sys.executable, "-c", script))
    dem_warp("new", "my grain")
    asked = {"command": "calibrate", "file": "my grain.toml", "device": "cpu"}
    planned = ask("plan", **asked)
    assert planned["command"] == "dem-warp calibrate 'my grain.toml' --out 'out/my grain' --device cpu"
    assert ask("start", **asked) == {"folder": "out/my grain"}
    ended = time.monotonic() + 90.0
    while (run := ask("runs")[0])["code"] is None:
        assert time.monotonic() < ended
    assert run["command"] == planned["command"]
    assert (
        json.loads((folder / "called.json").read_text(encoding="utf-8"))
        == shlex.split(planned["command"])[1:]
    )
    assert (run["state"], run["code"]) == ("failed", 2)


@pytest.mark.parametrize(
    "asked",
    [
        {"command": "rm", "file": "g.toml"}, {"command": "heap", "file": "none.toml"},
        {"command": "heap", "file": "../g.toml"}, {"command": "heap", "file": "g.toml", "out": "../away"},
        {"command": "heap", "file": "g.toml", "out": "/tmp/away"}, {"command": "heap"},
        {"command": "heap", "file": "g.toml", "scale": "x"},
    ],
)  # fmt: skip
def test_what_cannot_be_started_is_refused(
    ask: Ask, asked: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        started_runs.subprocess, "Popen", lambda *_, **__: pytest.fail("a command was started")
    )
    dem_warp("new", "g")
    assert ask("start", **asked)["error"]


def test_a_run_that_is_unknown_is_not_watched(client: TestClient, folder: Path) -> None:
    (folder.parent / "elsewhere").mkdir()
    for name in ("none", "..%2felsewhere", "%2e%2e/elsewhere"):
        assert client.get(f"/{TOKEN}/run/{name}/-/state.json").status_code in (403, 404, 422)


def test_folders_that_go_while_they_are_read_are_no_error(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run's end takes its previews away, whoever looks at them."""
    (folder / "out" / "heap" / ".live").mkdir(parents=True)
    runs = started_runs.StartedRuns(folder)
    assert [run["folder"] for run in runs.listed()] == ["out/heap"]

    def gone(path: Path, pattern: str) -> list[Path]:
        raise FileNotFoundError(2, "No such file or directory", str(path))

    monkeypatch.setattr(Path, "glob", gone)
    assert RunState.read(folder / "out" / "heap").heaps == []
    assert runs.listed() == []


def test_a_question_that_is_none_is_no_traceback(client: TestClient) -> None:
    for body in (b"[1]", b"{", b"\xff", b'{"source": 3}', b'{"values": 3, "name": "a", "factors": {}}', b""):
        for what in ("clump", "draft", "write", "start", "angles", "plan", "stop", "resume"):
            answer = client.post(f"/{TOKEN}/api/{what}", content=body)
            assert answer.status_code == 200, (what, body)
            assert what == "stop" or answer.json()["error"], (what, body)
    assert client.post(f"/{TOKEN}/api/none", content=b"{}").status_code == 404


def test_questions_need_the_pages_own_header(folder: Path) -> None:
    other = TestClient(ui_app(folder, TOKEN), base_url="http://127.0.0.1:8765")
    assert other.post(f"/{TOKEN}/api/form", content=b"{}").status_code == 403


def test_the_form_knows_every_test_of_the_library(ask: Ask) -> None:
    form = ask("form")
    assert list(form["tests"]) == list(SCENES)
    assert all(rows for rows in form["tests"].values())
    assert form["template"] == read_toml(study_folder.TEMPLATE)[1]
