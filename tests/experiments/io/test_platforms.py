"""Demands on the CPU's path of Windows, macOS and a bare C locale, as far as one machine shows it."""

import ast
import json
import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path, PurePosixPath, PureWindowsPath

import pytest
from commandline import dem_warp

from experiments.cases.engines import run_program
from experiments.commands.console import Attempt
from experiments.io.files import is_device_name
from experiments.measurement.photographs import drawn_names

ROOT = Path(__file__).resolve().parents[3]
PACKAGES = ("dem_warp", "doe", "imaging", "experiments")
EVIDENCE = "experiments/evidence/"

ONLY_POSIX = {
    "os.fork", "os.killpg", "os.setsid", "os.getuid", "os.getpgid", "os.uname", "os.sched_getaffinity",
    "os.nice", "os.mkfifo", "signal.SIGKILL", "signal.SIGHUP", "signal.SIGALRM", "signal.alarm",
}  # fmt: skip
ONLY_POSIX_MODULES = {"fcntl", "grp", "pwd", "resource", "termios", "tty", "pty", "syslog"}
GUARDED = {
    "experiments/cases/engines/run_program.py": {"os.killpg", "signal.SIGKILL"},
    "dem_warp/cores.py": {"os.sched_getaffinity"},
}
"""Calls that run only on the systems that have them."""
OF_LINUX = ["dem_warp/cores.py", "experiments/runs/examination.py"]
"""Files that read what Linux says of itself, where it is there."""


@cache
def sources() -> list[tuple[str, str]]:
    paths = (path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
    named = ((path.relative_to(ROOT).as_posix(), path) for path in paths)
    return [(name, path.read_text(encoding="utf-8")) for name, path in named if not name.startswith(EVIDENCE)]


def test_nothing_of_one_system_is_used() -> None:
    found: dict[str, set[str]] = {}
    words = re.compile(rf"\b({'|'.join(ONLY_POSIX_MODULES | {n.partition('.')[2] for n in ONLY_POSIX})})\b")
    for name, text in sources():
        for node in ast.walk(ast.parse(text)) if words.search(text) else ():
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                found.setdefault(name, set()).update({f"{node.value.id}.{node.attr}"} & ONLY_POSIX)
            if isinstance(node, ast.Import | ast.ImportFrom):
                modules = {each.name for each in node.names} | {getattr(node, "module", None)}
                found.setdefault(name, set()).update(map(str, modules & ONLY_POSIX_MODULES))
    assert {name: calls for name, calls in found.items() if calls} == GUARDED


def test_no_file_has_its_place_at_a_root_of_one_system() -> None:
    rooted = re.compile(r"""["']/(tmp|proc|dev|etc|usr|var|sys|bin)\b""")
    assert [name for name, text in sources() if rooted.search(text)] == OF_LINUX


@pytest.mark.parametrize(
    ("system", "written"),
    [
        ("linux", "dem-warp calibrate 'my wheat.toml' --out 'my results'"),
        ("win32", 'dem-warp calibrate "my wheat.toml" --out "my results"'),
    ],
)
def test_commands_are_quoted_for_the_shell_of_the_system(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, system: str, written: str
) -> None:
    monkeypatch.setattr(sys, "platform", system)
    assert Attempt.of("calibrate", Path("my wheat.toml"), out=Path("my results")).command == written
    monkeypatch.chdir(tmp_path)
    _, out, _ = dem_warp("new", "my wheat")
    assert out.rstrip().endswith(written.partition(" --out")[0])


def test_names_that_windows_keeps_for_devices_are_known() -> None:
    assert all(map(is_device_name, ("nul", "CON", "com1", "LPT9.toml", "aux ")))
    assert not any(map(is_device_name, ("console", "com10", "common.toml", "annul", "wheat")))


def test_copies_have_names_of_their_own_on_every_system() -> None:
    windows = [PureWindowsPath(place) for place in (r"C:\one\Heap.jpg", r"D:\one\heap.png")]
    pictures = [*windows, PurePosixPath("two/heap.jpg")]
    names = drawn_names([*pictures, *pictures])  # type: ignore[list-item]
    assert len({name.casefold() for name in names}) == len(names)
    assert not set(r'\/:*?"<>|') & set("".join(names))


def test_a_program_is_ended_at_its_limit_without_process_groups(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(run_program, "POSIX", False)
    monkeypatch.setattr(run_program, "_end_with_starter", lambda program: None)
    monkeypatch.chdir(tmp_path)
    run_program.main("0.5", sys.executable, "-c", "import threading; threading.Event().wait()")
    ending = json.loads(Path(run_program.ENDING).read_text(encoding="utf-8"))
    assert (ending["timed_out"], ending["code"]) == (True, None)
    assert ending["seconds"] >= 0.5


CONES = Path(__file__).parents[1] / "cases" / "engines" / "cone_program.py"
FEW_CASES = """
[campaign]
noise_floor.replicates = 3
screening.dummies = 1
climb = { replicates = 1, steps = 4 }
surface.center_points = 3
verification.replicates = 4
"""
ENGINE = f"\n[engine]\ncommand = \"'{sys.executable}' '{CONES}'\"\n"


MAIN = "from experiments.cli import main; main()"
OBSERVED = f"""
import atexit, sys
from experiments.report import solid
solid.PIXELS = 200
atexit.register(lambda: print("loaded", *sys.modules))
{MAIN}
"""


def run(
    folder: Path, *words: str, program: str = MAIN, **environment: str
) -> subprocess.CompletedProcess[bytes]:
    """Run the command line as a process of its own."""
    command = [sys.executable, "-c", program, *words]
    settings = os.environ | {"PYTHONPATH": str(ROOT), **environment}
    return subprocess.run(command, cwd=folder, env=settings, capture_output=True, check=False)


def test_a_campaign_runs_in_new_processes_under_a_bare_locale(tmp_path: Path, small_text: str) -> None:
    """Processes are always started anew, as Windows and macOS do."""
    folder = tmp_path / "Körner und mehr"
    folder.mkdir()
    (folder / "Weizen groß.toml").write_text(small_text + FEW_CASES + ENGINE, encoding="utf-8")
    words = ("calibrate", "Weizen groß.toml", "--device", "cpu", "--workers", "1", "--out", "aus gabe ü")
    bare = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONWARNDEFAULTENCODING": "1"}
    done = run(folder, *words, program=OBSERVED, **bare)
    printed = done.stderr.decode("utf-8", "replace")
    assert done.returncode == 0, printed
    results = json.loads((folder / "aus gabe ü" / "results.json").read_text(encoding="utf-8"))
    assert results["study"]["file"] == "Weizen groß.toml"
    assert results["campaign"]["outcome"] == "calibrated"
    assert (folder / "aus gabe ü" / "report.html").read_text(encoding="utf-8").rstrip().endswith("</html>")
    loaded = done.stdout.decode("utf-8", "replace").rpartition("loaded ")[2].split()
    assert not {"dask", "distributed", "dask_jobqueue"} & set(loaded)
    assert "experiments.cli" in loaded
    # No file of ours is opened in an encoding that the system chooses.
    ours = tuple(str(ROOT / package) for package in PACKAGES)
    assert [
        line for line in printed.splitlines() if "EncodingWarning" in line and line.startswith(ours)
    ] == []


def test_stubs_read_the_same_in_every_encoding() -> None:
    """lazy_loader opens them in the one that the system chooses."""
    stubs = [path for package in PACKAGES for path in (ROOT / package).rglob("*.pyi")]
    assert len(stubs) >= 5
    assert [path.name for path in stubs if not path.read_bytes().isascii()] == []


def test_what_a_console_cannot_show_is_no_error(tmp_path: Path) -> None:
    done = run(tmp_path, "heap", "Maße µ.toml", PYTHONIOENCODING="ascii", PYTHONUTF8="0")
    assert done.returncode == 2
    assert b"Traceback" not in done.stderr
    assert rb"Ma\xdfe \xb5.toml" in done.stderr
