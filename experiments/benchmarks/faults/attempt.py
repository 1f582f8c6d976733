"""One run of a command in a process of its own, which may be killed; and what its folder holds at the end."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

STUDY = Path(__file__).with_name("study.toml")
"""A campaign of 20 cases of 60 balls: three waves, every table of the report."""

OF_THE_RUN = ("files.json", "report.html", "wall_times.csv", ".lock")
"""Files of a folder that tell of the run itself, its day and its duration."""


@dataclass(frozen=True)
class Ending:
    """End of a command."""

    code: int
    """Exit code; negative: the signal that ended it."""
    said: str
    """Its messages."""
    seconds: float
    """Wall time [s]."""

    @property
    def is_clear(self) -> bool:
        """True of an end that a person can read."""
        return "Traceback" not in self.said and self.code != -signal.SIGSEGV


class Attempt:
    """A command that runs in a fork of this process, which has the libraries loaded already.

    Parameters
    ----------
    arguments
        Those of ``dem-warp``.
    said
        File of its messages.
    """

    def __init__(self, arguments: Sequence[str], said: Path) -> None:
        self._said, self._started = said, time.monotonic()
        self._code: int | None = None
        self.process = os.fork()
        if self.process == 0:
            _become(["dem-warp", *arguments], said)

    def has_ended(self) -> bool:
        """Tell that the command has ended by itself, or was ended."""
        if self._code is None:
            process, status = os.waitpid(self.process, os.WNOHANG)
            self._code = os.waitstatus_to_exitcode(status) if process else None
        return self._code is not None

    def wait(self, seconds: float = 600.0) -> bool:
        """Wait until it has ended, so long at most; tell that it has."""
        end = time.monotonic() + seconds
        while not self.has_ended():
            if time.monotonic() > end:
                return False
            time.sleep(0.005)
        return True

    def kill(self, process: int | None = None) -> None:
        """Kill it, or one of its workers, as the system does: without a word."""
        os.kill(process or self.process, signal.SIGKILL)

    @property
    def workers(self) -> list[int]:
        """Processes that simulate for it."""
        return [child for child in _children(self.process) if b"spawn_main" in _command_line(child)]

    def ending(self) -> Ending:
        """End of the command, awaited; one that hangs is killed after ten minutes."""
        if not self.wait():
            self.kill()
            self.wait()
        said = self._said.read_text(encoding="utf-8", errors="replace")
        return Ending(int(self._code or 0), said, time.monotonic() - self._started)


def _become(words: list[str], said: Path) -> None:
    """Run a command in this process, which ends with it."""
    code = 70
    try:
        stream = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(stream, 1)
        os.dup2(stream, 2)
        sys.argv = words
        from experiments.cli import main

        main()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _children(process: int) -> list[int]:
    """Processes that a process has begun."""
    listed = Path(f"/proc/{process}/task/{process}/children")
    try:
        return [int(child) for child in listed.read_text(encoding="ascii").split()]
    except OSError:
        return []


def _command_line(process: int) -> bytes:
    try:
        return Path(f"/proc/{process}/cmdline").read_bytes()
    except OSError:
        return b""


def calibrate(folder: Path, workers: int, resume: bool = False, study: Path = STUDY) -> list[str]:
    """Arguments of a campaign in a folder."""
    words = ["calibrate", str(study), "--out", str(folder), "--device", "cpu", "--workers", str(workers)]
    return [*words, "--resume"] if resume else words


def begun(folder: Path) -> bool:
    """Tell that a folder is one to resume."""
    return (folder / "study.json").is_file()


def finished_cases(folder: Path) -> dict[str, tuple[int, int]]:
    """Stored cases, each with its inode and the time of its last change: a case done twice has others."""
    found = {}
    for path in (folder / "cases").glob("*.npz"):
        facts = path.stat()
        found[path.name] = (facts.st_ino, facts.st_mtime_ns)
    return found


def content(folder: Path) -> dict[str, str]:
    """Hashes of all that a finished run left, but for what tells of the run itself."""
    hashes = {}
    for path in sorted(path for path in folder.rglob("*") if path.is_file() and path.name not in OF_THE_RUN):
        data = path.read_bytes()
        if path.name == "results.json":
            told = json.loads(data)
            told.pop("provenance", None)
            data = json.dumps(told, sort_keys=True).encode()
        hashes[path.relative_to(folder).as_posix()] = hashlib.sha256(data).hexdigest()
    return hashes
