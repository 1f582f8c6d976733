"""One run of a command in a process of its own, which may be killed; and what its folder holds at the end."""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from experiments.io.files import has_temporary_name

STUDY = Path(__file__).with_name("study.toml")
"""A campaign of 20 cases of 60 balls: three waves, every table of the report."""

OF_THE_RUN = ("files.json", "report.html", "wall_times.csv", ".lock")
"""Files of a folder that tell of the run itself, its day and its duration."""

TOLD = ".live"
"""Folder of what a run tells while it works; it stays, and is no result."""


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


class Command:
    """A command that runs in another process.

    Parameters
    ----------
    process
        The process.
    said
        File of its messages.
    """

    def __init__(self, process: int, said: Path) -> None:
        self.process, self._said = process, said
        self._started = time.monotonic()
        self._code: int | None = None

    def _look(self) -> int | None:
        """Exit code of the command; None while it runs."""
        raise NotImplementedError

    def has_ended(self) -> bool:
        """Tell that the command has ended by itself, or was ended."""
        if self._code is None:
            self._code = self._look()
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
        # records name no place of one machine
        said = said.replace(f"{Path.cwd()}{os.sep}", "")
        return Ending(int(self._code or 0), said, time.monotonic() - self._started)


class Attempt(Command):
    """A command that runs in a fork of this process, which has the libraries loaded already.

    Parameters
    ----------
    arguments
        Those of the command.
    said
        File of its messages.
    command : callable, optional
        What runs with these as its `sys.argv`; None: ``dem-warp``.
    """

    def __init__(
        self, arguments: Sequence[str], said: Path, command: Callable[[], object] | None = None
    ) -> None:
        process = os.fork()
        if process == 0:
            end_with_starter()
            os._exit(exit_code(arguments, said, command))
        super().__init__(process, said)

    def _look(self) -> int | None:
        process, status = os.waitpid(self.process, os.WNOHANG)
        return os.waitstatus_to_exitcode(status) if process else None


def end_with_starter() -> None:
    """Let Linux kill this process when the one that began it is gone."""
    death_signal = 1  # PR_SET_PDEATHSIG of <sys/prctl.h>
    ctypes.CDLL(None).prctl(death_signal, signal.SIGKILL)


def exit_code(arguments: Sequence[str], said: Path, command: Callable[[], object] | None = None) -> int:
    """Run a command in this process, its messages to a file; return the code that it exits with."""
    code = 70
    try:
        stream = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(stream, 1)
        os.dup2(stream, 2)
        os.close(stream)
        sys.argv = ["dem-warp", *arguments]
        (command or _dem_warp)()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
    return code


def _dem_warp() -> None:
    from experiments.cli import main

    main()


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


def calibrate(folder: Path, where: int | str, resume: bool = False) -> list[str]:
    """Arguments of a campaign in a folder, on so many processes or on the workers of a scheduler."""
    workers = ["--workers", str(where)] if isinstance(where, int) else ["--scheduler", where]
    words = ["calibrate", str(STUDY), "--out", str(folder), "--device", "cpu", *workers]
    return [*words, "--resume"] if resume else words


def begun(folder: Path) -> bool:
    """Tell that a folder is one to resume."""
    return (folder / "study.json").is_file()


def finished_cases(folder: Path) -> dict[str, tuple[int, int]]:
    """Stored cases, each with its inode and the time of its last change: a case done twice has others."""
    found = {}
    for path in (folder / "cases").glob("*.npz"):
        if has_temporary_name(path):  # half a case of a run that was killed
            continue
        facts = path.stat()
        found[path.name] = (facts.st_ino, facts.st_mtime_ns)
    return found


def content(folder: Path) -> dict[str, str]:
    """Hashes of all that a finished run left, but for what tells of the run itself."""
    hashes = {}
    for path in sorted(path for path in folder.rglob("*") if path.is_file() and path.name not in OF_THE_RUN):
        if path.relative_to(folder).parts[0] == TOLD and not has_temporary_name(path):
            continue
        data = path.read_bytes()
        if path.name == "results.json":
            told = json.loads(data)
            told.pop("provenance", None)
            data = json.dumps(told, sort_keys=True).encode()
        hashes[path.relative_to(folder).as_posix()] = hashlib.sha256(data).hexdigest()
    return hashes
