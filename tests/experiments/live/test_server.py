"""The server on this machine: who is let in, and what a folder gives away."""

import json
import os
import socket
import sys
import urllib.request
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from commandline import dem_warp, refused
from conftest import KEY, NAME, OTHER, begin
from starlette.testclient import TestClient

from dem_warp import CaseResult
from experiments.io.errors import InputError
from experiments.live import server
from experiments.live.server import Place, watch_app
from experiments.studyfile import Study

TOKEN = "a-secret-token"
HOST = "http://127.0.0.1:8765"


@pytest.fixture
def client(run_folder: Path, small_study: Study, cone: Callable[..., CaseResult]) -> TestClient:
    """Ask the server of a run that is running."""
    begin(run_folder, small_study, cone)
    return TestClient(watch_app(run_folder, TOKEN), base_url=HOST)


def test_the_page_and_all_that_it_loads_come_with_the_token(client: TestClient) -> None:
    page = client.get(f"/{TOKEN}/")
    assert page.status_code == 200
    assert "dem-warp" in page.text
    for name in ("pages/style.css", "pages/watch.js", "pages/page.js", "pages/heap_view.js", "plotly.js"):
        assert client.get(f"/{TOKEN}/{name}").status_code == 200, name


def test_without_the_token_every_request_is_refused(client: TestClient) -> None:
    for path in (
        "/",
        "/state.json",
        "/wrong/state.json",
        f"/{TOKEN}x/",
        f"/{TOKEN[:-1]}/",
        "//",
        f"//{TOKEN}/",
    ):
        answer = client.get(HOST + path)
        assert answer.status_code == 403
        assert "Small" not in answer.text


def test_a_page_of_another_name_is_refused_and_a_tunnel_may_have_another_port(client: TestClient) -> None:
    """Refuse DNS rebinding: another site's name that leads to this address."""
    others = ("evil.example", "127.0.0.1.evil.example:8765", "[::1]:8765", "0.0.0.0:8765", "")
    for host in (*others, "127.0.0.1:1", "localhost:8765", "localhost"):
        status = client.get(f"/{TOKEN}/state.json", headers={"Host": host}).status_code
        assert status == (403 if host in others else 200), host


def test_another_sites_request_is_refused(client: TestClient) -> None:
    for origin in ("http://evil.example", "null", "https://127.0.0.1:8765"):
        assert client.get(f"/{TOKEN}/state.json", headers={"Origin": origin}).status_code == 403
    assert client.get(f"/{TOKEN}/state.json", headers={"Origin": HOST}).status_code == 200
    assert client.post(f"/{TOKEN}/state.json").status_code == 403


def test_a_page_loads_nothing_from_elsewhere(client: TestClient) -> None:
    headers = client.get(f"/{TOKEN}/").headers
    assert "default-src 'none'" in headers["content-security-policy"]
    assert headers["referrer-policy"] == "no-referrer"
    assert "sandbox" in client.get(f"/{TOKEN}/file/report.html").headers["content-security-policy"]


def test_the_state_describes_the_run(client: TestClient) -> None:
    state = client.get(f"/{TOKEN}/state.json").json()
    assert state["run"] == {"command": "calibrate", "study": "Small", "scale": None, "device": "cpu"}
    assert state["progress"]["state"] == "running"
    assert [heap["id"] for heap in state["heaps"]] == [f"preview/{NAME}", f"case/{KEY}"]
    assert state["heaps"][0]["title"] == "screening, run 2, replicate 1"
    assert (state["cases"]["ended"], state["cases"]["planned"]) == (1, 2)
    assert [line["text"] for line in state["log"]] == ["The run begins."]
    assert state["outputs"] == ["report.html", "tables/cases.csv"]
    assert [chart["name"] for chart in state["charts"]] == ["course"]


def test_what_has_not_changed_is_not_sent_again(client: TestClient) -> None:
    tag = client.get(f"/{TOKEN}/state.json").headers["etag"]
    assert client.get(f"/{TOKEN}/state.json", headers={"If-None-Match": tag}).status_code == 304


def test_heaps_come_as_their_spheres(client: TestClient, cone: Callable[..., CaseResult]) -> None:
    for name, heap in ((f"case/{KEY}", cone()), (f"preview/{NAME}", cone(0.3))):
        rows = np.frombuffer(client.get(f"/{TOKEN}/heap/{name}").content, "<f4").reshape(-1, 5)
        np.testing.assert_allclose(rows[:, :3], heap.sphere_centers, atol=1e-9)
        np.testing.assert_allclose(rows[:, 3], heap.sphere_radii, rtol=1e-6)
    assert client.get(f"/{TOKEN}/heap/preview/{NAME}").headers["x-phase"] == "lift"


def test_a_missing_heap_is_no_error(client: TestClient) -> None:
    for name in (
        f"case/{OTHER}",
        "case/../study",
        "preview/x",
        "other/" + KEY,
        "%2e%2e/secret",
        f"case/{KEY}%00",
    ):
        assert client.get(f"/{TOKEN}/heap/{name}").status_code == 204


def test_files_of_the_run_can_be_opened(client: TestClient) -> None:
    assert "The report" in client.get(f"/{TOKEN}/file/report.html").text
    assert client.get(f"/{TOKEN}/file/tables/cases.csv").headers["content-type"].startswith("text/csv")


@pytest.mark.parametrize(
    "path",
    [
        "%2e%2e/secret.txt", "..%2f..%2fsecret.txt", "tables/%2e%2e/%2e%2e/%2e%2e/secret.txt",
        "%2fetc/passwd",
        "tables", "tables%5c..%5csecret.txt", "no.csv", "linked.txt", "away/secret.txt", ".live/log.jsonl",
        "report.html%00.csv", "pipe.txt",
    ],
)  # fmt: skip
def test_no_path_leads_out_of_the_folder(client: TestClient, run_folder: Path, path: str) -> None:
    secret = run_folder.parents[1] / "secret.txt"
    secret.write_text("secret", encoding="utf-8")
    (run_folder / "linked.txt").symlink_to(secret)
    (run_folder / "away").symlink_to(secret.parent)
    os.mkfifo(run_folder / "pipe.txt")
    answer = client.get(f"/{TOKEN}/file/{path}")
    assert answer.status_code in (404, 422)
    assert answer.text != "secret"


def test_watching_changes_nothing(client: TestClient, run_folder: Path) -> None:
    # the run's own sign of life, which the test does not stop
    found = lambda: {  # noqa: E731
        path: path.read_bytes() for path in run_folder.rglob("*") if path.is_file() and path.name != "beat"
    }
    before = found()
    for name in ("", "state.json", f"heap/case/{KEY}", f"heap/preview/{NAME}", "file/report.html"):
        client.get(f"/{TOKEN}/{name}")
    assert found() == before


def test_the_server_listens_on_this_machine_alone() -> None:
    place = Place.open()
    assert place.socket.getsockname()[0] == "127.0.0.1"
    assert len(place.token) >= 32
    assert place.token != Place.open().token
    said = r"--port: must be a free port of this machine \(.+\), got"
    with socket.create_server(("127.0.0.1", 0)) as taken, pytest.raises(InputError, match=said):
        Place.open(taken.getsockname()[1])


def test_a_missing_library_is_reported_with_the_command_that_installs_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    for words in (
        ("watch", tmp_path),
        ("ui", tmp_path),
        ("heap", "--scale", "bench", "--live", "--out", tmp_path / "h"),
    ):
        assert "pip install 'dem-warp[live]'" in refused(*words)
    assert not (tmp_path / "h").exists()


def test_the_address_is_reported_and_no_browser_opened_without_a_screen(
    monkeypatch: pytest.MonkeyPatch, run_folder: Path
) -> None:
    run_folder.mkdir(parents=True)
    opened: list[str] = []
    monkeypatch.setattr(
        server, "_server", lambda app: SimpleNamespace(run=lambda sockets: sockets[0].close())
    )
    monkeypatch.setattr(server.webbrowser, "open", opened.append)
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    code, shown, _ = dem_warp("watch", run_folder)
    assert code == 0
    assert shown.startswith("http://127.0.0.1:")
    assert opened == []
    monkeypatch.setenv("DISPLAY", ":0")
    dem_warp("watch", run_folder)
    assert len(opened) == 1
    dem_warp("watch", run_folder, "--no-browser")
    assert len(opened) == 1


@pytest.mark.parametrize("command", ["calibrate", "discover", "heap"])
def test_live_serves_the_page_of_the_run(
    command: str, small_study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    places: list[Place] = []
    seen: list[bytes] = []
    urls: list[str] = []
    opened = Place.open

    def run(*_: object, **__: object) -> None:
        urls.append(places[0].url)
        with urllib.request.urlopen(urls[0] + "state.json") as answer:
            seen.append(answer.read())
        raise InputError(command, "the run has looked")

    monkeypatch.setattr(server.Place, "open", lambda port=0: places.append(opened(port)) or places[-1])
    monkeypatch.setattr(server, "can_open_browser", lambda: False)
    for place in ("calibration.run_calibration", "search.run_search", "one_heap.run_heap"):
        monkeypatch.setattr(f"experiments.runs.{place}", run)
    words = [command, small_study.file, "--device", "cpu", "--live", "--out", tmp_path / "out"]
    shown = refused(*words)
    assert "the run has looked" in shown
    assert f"Live: {urls[0]}" in shown
    assert json.loads(seen[0])["progress"]["state"] == "waiting"
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(urls[0])
