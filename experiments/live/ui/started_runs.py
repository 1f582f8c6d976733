"""StartedRuns that the page to start from began: commands of their own, which go on without it."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from experiments.io.errors import InputError
from experiments.live.run_files import matching
from experiments.live.run_state import RunState
from experiments.live.ui.study_folder import command_line

PROGRAM = (sys.executable, "-c", "from experiments.cli import main; main()")
"""Words that run ``dem-warp``, also where it is not on the path."""

SHOWN = 4_000
"""Characters of a command's messages that are shown, its last ones."""


@dataclass
class Started:
    """A command that was started, its folder, and what it says."""

    words: tuple[str, ...]
    folder: str
    """Folder of its results, relative to that of the page."""
    process: subprocess.Popen[bytes]
    output: IO[bytes]

    @property
    def command(self) -> str:
        """The command line."""
        return command_line(*self.words)

    @property
    def messages(self) -> str:
        """Last messages of the command."""
        self.output.seek(0, os.SEEK_END)
        self.output.seek(max(0, self.output.tell() - SHOWN))
        return self.output.read().decode("utf-8", errors="replace").replace("\r", "\n")


class StartedRuns:
    """Runs in a folder: those that were started here, and those below its ``out``."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._started: dict[str, Started] = {}

    def start(self, words: Sequence[str], out: str) -> str:
        """Start a command whose results go to a folder, and return that folder's name."""
        place = self._place(out)
        if (before := self._started.get(place)) and before.process.poll() is None:
            raise InputError(place, "another run is using this folder")
        output = tempfile.TemporaryFile()  # noqa: SIM115  (it lives as long as the run)
        process = subprocess.Popen(
            [*PROGRAM, *words],
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            # Ctrl-C on the page's server is not meant for its runs
            start_new_session=os.name == "posix",
        )
        self._started[place] = Started(tuple(words), place, process, output)
        return place

    def stop(self, place: str) -> None:
        """End a run that was started here; it can be resumed."""
        if place in self._started:
            self._started[place].process.terminate()

    def resume(self, place: str) -> str:
        """Resume a run that was started here and has ended."""
        if place not in self._started:
            raise InputError("resume", "must be a run that was started from this page", place)
        words = [word for word in self._started[place].words if word != "--resume"]
        return self.start([*words, "--resume"], place)

    def path(self, place: str) -> Path:
        """Folder of a run."""
        if place not in self.names():
            raise InputError("run", "must be the folder of a run", place)
        return self.folder / place

    def names(self) -> list[str]:
        """Folders of all runs, those that were started here first."""
        others = [
            path.relative_to(self.folder).as_posix()
            for path in matching(self.folder, "out/*/")
            if any((path / name).exists() for name in ("study.json", "angle.json", ".live"))
            and not path.is_symlink()
        ]
        return list(dict.fromkeys([*reversed(self._started), *others]))

    def listed(self) -> list[dict[str, Any]]:
        """Describe every run: its folder, command, state and messages."""
        return [self._described(name) for name in self.names()]

    def _described(self, name: str) -> dict[str, Any]:
        state, started = RunState.read(self.folder / name), self._started.get(name)
        row: dict[str, Any] = {
            "folder": name,
            "study": state.run.study,
            "state": state.progress.state,
            "message": state.progress.message,
            "left": state.left,
            "outputs": [each for each in state.outputs if each.endswith(".html") or each == "snapshot.png"],
        }
        if started is None:
            return row | {"command": "", "messages": "", "running": False, "code": None}
        code = started.process.poll()
        if code is None and row["state"] != "running":
            row |= {"state": "running", "message": "The command is starting."}
        elif code not in (None, 0) and row["state"] in ("running", "waiting"):
            row |= {"state": "failed", "message": f"The command ended with the exit code {code}."}
        return row | {
            "command": started.command, "messages": started.messages, "running": code is None, "code": code,
        }  # fmt: skip

    def _place(self, out: str) -> str:
        """Folder of a new run, below that of the page."""
        parts = Path(out).parts
        if not parts or Path(out).is_absolute() or ".." in parts or any(p.startswith(".") for p in parts):
            raise InputError("--out", "must be a folder below the one of this page", out)
        return Path(out).as_posix()
