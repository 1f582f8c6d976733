"""Kill a command at random moments, resume it until it ends, and compare its folder with an unbroken run's.

    python -m experiments.evidence.robustness.kill_and_resume out/kills --kills 100
    python -m experiments.evidence.robustness.kill_and_resume out/kills heap --scale bench --device cpu

The words after the folder are a ``dem-warp`` command without ``--out`` and ``--resume``; the default is a
campaign of 20 small cases. Every fourth run is also started a second time in the same folder, which must be
refused. It needs Linux.
"""

import hashlib
import json
import random
import shutil
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from experiments.cases.store.folder import is_used
from experiments.evidence.machine import machine
from experiments.evidence.performance.result_pages import write_results
from experiments.io.files import JOURNAL, has_temporary_name
from experiments.live.ui.started_runs import PROGRAM

STUDY = Path(__file__).with_name("kill_study.toml")
"""A campaign of 20 cases of 60 balls: three batches, every table of the report."""

CAMPAIGN = ("calibrate", str(STUDY), "--device", "cpu", "--workers", "2")

OF_THE_RUN = ("files.json", "report.html", "wall_times.csv", ".lock")
"""Files that hold the day and the duration of a run."""

MOST = 6
"""Kills of one run."""

PATIENCE = 600.0
"""Time after which a command counts as hanging [s]."""

BUSY = 2
"""Exit code of a command that finds its folder in use."""

RULE = (
    "No finished case may be lost or written again, every message must be readable, and the final folder "
    "must be to the bit that of a run without kills."
)
"""Rule that the page states."""


@dataclass(frozen=True)
class Kill:
    """One kill, and the rule that the run broke."""

    run: int
    killed: str
    """``command`` or ``worker``."""
    after: float
    """Wall time since its start [s]."""
    kept: int
    """Number of cases that were finished then."""
    fault: str


def start(words: Sequence[str], folder: Path) -> subprocess.Popen[bytes]:
    """Start a command in a folder, which it resumes if it can; its messages go to a file next to it."""
    more = ["--resume"] if is_used(folder) else []
    with folder.with_suffix(".txt").open("wb") as messages:
        return subprocess.Popen(
            [*PROGRAM, *words, "--out", str(folder), *more], stdout=messages, stderr=messages
        )


def fault_of(process: subprocess.Popen[bytes], folder: Path, allowed: Sequence[int] = (0,)) -> str:
    """Wait for a command, and name what is wrong with its end; empty: nothing."""
    try:
        code = process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        return f"no end within {PATIENCE:g} s"
    messages = folder.with_suffix(".txt").read_text(encoding="utf-8", errors="replace")
    if code not in allowed or "Traceback" in messages:
        return f"exit {code}: {messages[-300:]}"
    return ""


def workers_of(process: int) -> list[int]:
    """Find the processes that simulate for a command."""
    listed = Path(f"/proc/{process}/task/{process}/children")
    children = listed.read_text(encoding="ascii").split() if listed.exists() else []
    lines = {int(child): Path(f"/proc/{child}/cmdline") for child in children}
    return [child for child, line in lines.items() if line.exists() and b"spawn_main" in line.read_bytes()]


def finished_cases(folder: Path) -> dict[str, tuple[int, int]]:
    """Return the stored cases, each with its inode and time of change: a case done twice has others."""
    paths = [path for path in (folder / "cases").glob("*.npz") if not has_temporary_name(path)]
    return {path.name: (path.stat().st_ino, path.stat().st_mtime_ns) for path in paths}


def content(folder: Path) -> dict[str, str]:
    """Hash all that a finished run left, except what describes the run itself."""
    hashes = {}
    for path in sorted(path for path in folder.rglob("*") if path.is_file() and path.name not in OF_THE_RUN):
        if path.relative_to(folder).parts[0] == JOURNAL and not has_temporary_name(path):
            continue
        data = path.read_bytes()
        if path.name == "results.json":
            results = json.loads(data)
            results.pop("provenance", None)
            data = json.dumps(results, sort_keys=True).encode()
        hashes[path.relative_to(folder).as_posix()] = hashlib.sha256(data).hexdigest()
    return hashes


def lost(before: Mapping[str, tuple[int, int]], now: Mapping[str, tuple[int, int]]) -> str:
    """Name a finished case that is gone, or was written again; empty: none."""
    return next((f"case {name} lost or done twice" for name in before if now.get(name) != before[name]), "")


def differing(expected: Mapping[str, str], found: Mapping[str, str]) -> str:
    """Name the files that a run without kills left otherwise; empty: none."""
    names = sorted(name for name in expected.keys() | found.keys() if expected.get(name) != found.get(name))
    return f"differs from a run without kills: {', '.join(names[:3])} ({len(names)} in all)" if names else ""


def killed_run(
    run: int,
    words: Sequence[str],
    folder: Path,
    expected: Mapping[str, str],
    seconds: float,
    rng: random.Random,
) -> list[Kill]:
    """Kill a run of some seconds again and again, and let it end; the last kill has the faults of the end."""
    kills: list[Kill] = []
    before: dict[str, tuple[int, int]] = {}
    fault = ""
    for _ in range(rng.randint(1, MOST)):
        process, begun = start(words, folder), time.monotonic()
        time.sleep(rng.uniform(0.0, seconds))
        workers = workers_of(process.pid) if rng.random() < 0.25 else []
        if process.poll() is None:
            kind, target = ("worker", rng.choice(workers)) if workers else ("command", process.pid)
            subprocess.run(["kill", f"-{signal.SIGKILL:d}", str(target)], check=False)
            fault = fault_of(process, folder, (0, 1, -signal.SIGKILL))
            now = finished_cases(folder)
            after = round(time.monotonic() - begun, 2)
            kills.append(Kill(run, kind, after, len(now), fault or lost(before, now)))
            before = now
    last = start(words, folder)
    if run % 4 == 0 and is_used(folder):
        second = subprocess.run(
            [*PROGRAM, *words, "--out", str(folder), "--resume"], capture_output=True, check=False
        )
        if last.poll() == BUSY:
            # the second was faster to the lock: it has run, and the first was refused
            last = start(words, folder)
        elif last.poll() is None and second.returncode != BUSY:
            fault = f"a second run in the folder ended with {second.returncode}"
    fault = fault or fault_of(last, folder) or lost(before, finished_cases(folder))
    fault = fault or differing(expected, content(folder))
    if fault and not (kills and kills[-1].fault):
        kills.append(Kill(run, "none", 0.0, len(before), fault))
    shutil.rmtree(folder, ignore_errors=True)
    return kills


def main(
    out: Annotated[Path, typer.Argument(help="Folder of the results.")],
    words: Annotated[list[str] | None, typer.Argument(help="Command, without --out and --resume.")] = None,
    kills: Annotated[int, typer.Option(min=1, help="Number of kills.")] = 100,
    seed: Annotated[int, typer.Option(help="Seed of the moments.")] = 1,
) -> None:
    """Kill and resume a command; write kills.md and kills.csv."""
    work, rng, command = out / "work", random.Random(seed), words or list(CAMPAIGN)
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    begun = time.monotonic()
    if fault := fault_of(start(command, work / "whole"), work / "whole"):
        raise RuntimeError(f"the run without kills failed: {fault}")
    seconds, expected = time.monotonic() - begun, content(work / "whole")
    rows: list[Kill] = []
    run = 0
    while len(rows) < kills:
        rows += killed_run(run, command, work / f"run-{run}", expected, seconds, rng)
        run += 1
        head = f"# Kills\n\n{machine('cpu')}. `dem-warp {' '.join(command)}`, {run} runs. {RULE}"
        write_results(out, "kills", [("kills", head, pd.DataFrame(map(asdict, rows)))])
        print(run, rows[-1], flush=True)
    raise typer.Exit(int(any(row.fault for row in rows)))


if __name__ == "__main__":
    app = typer.Typer(add_completion=False)
    app.command(context_settings={"ignore_unknown_options": True, "allow_interspersed_args": False})(main)
    app()
