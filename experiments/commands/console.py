"""Output of the command line: progress with the time left, and errors as one clear message."""

from __future__ import annotations

import errno
import logging
import os
import shlex
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn
from unicodedata import category

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn
from rich.text import Text

from experiments.io.time_left import duration, time_left
from experiments.runs.request import AwaitingRuns

if TYPE_CHECKING:
    from dem_warp import Progress as BatchProgress

BAD_INPUT, FAILED_RUN, INTERRUPTED, TERMINATED = 2, 1, 130, 143
"""Exit codes."""

ENDED_OUTSIDE = "a process was ended from outside, perhaps for lack of memory: use fewer --workers."

QUIET_START = 2.0
"""Shortest duration that shows progress [s]."""
MANIFEST = "study.json"
"""File of a folder that a run can be continued in; `experiments.studyfile.manifest` writes it."""

LINE_EVERY = 10.0
"""Time between two lines of progress without a terminal [s]."""

HIDDEN = ("Cc", "Cf", "Cs", "Zl", "Zp")
"""Categories of characters that control a terminal or the order of its text."""

WAYS_OUT = {
    errno.ENOSPC: "free some room on the disk",
    errno.EDQUOT: "free some room in your quota",
    errno.EACCES: "check the permissions, close the program that has it open, or choose another place",
    errno.EPERM: "check the permissions, or choose another place",
    errno.EROFS: "choose a place that can be written to",
    errno.ENAMETOOLONG: "choose a shorter name",
    errno.ENOENT: "check that nothing is moved or removed while a command runs",
}
"""Advice about errors of the system, by their number."""


def plain(text: str) -> str:
    """Return text in which characters that control a terminal are escaped, e.g. as ``x1b``."""
    return "".join(
        character if character in "\n\t" or category(character) not in HIDDEN
        else character.encode("unicode_escape", "surrogatepass").decode()
        for character in text
    )  # fmt: skip


def shell_line(words: Sequence[str]) -> str:
    """Join the words of a command for the system's shell."""
    return subprocess.list2cmdline(words) if sys.platform == "win32" else shlex.join(words)


class Messages(Console):
    """Console of messages; text is shown without markup."""

    def print(self, *objects: Any, **options: Any) -> None:
        """Show texts plainly, and renderables of Rich."""
        shown = (plain(each) if isinstance(each, str) else each for each in objects)
        super().print(*shown, **({"markup": False} | options))


messages = Messages(stderr=True, highlight=False, soft_wrap=True)
"""Console of progress and errors; results go to standard output."""


class _PlainFormatter(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        return plain(super().format(record))


class Terminated(KeyboardInterrupt):
    """The command received SIGTERM, e.g. from a scheduler."""


@dataclass(frozen=True)
class Attempt:
    """A command whose run can be continued in its folder."""

    command: str
    """The command with all its options, quoted."""
    folder: Path
    """Its folder."""

    @classmethod
    def of(cls, command: str, /, *files: Path | None, out: Path, **options: object) -> Attempt:
        """Write a command with its files and the options that were given; a list repeats its option."""
        words = ["dem-warp", command, *(str(file) for file in files if file)]
        for name, given in {"out": out, **options}.items():
            for value in given if isinstance(given, list) else [given]:
                if value is not None and value is not False:
                    words += [f"--{name.replace('_', '-')}", *([] if value is True else [str(value)])]
        return cls(shell_line(words), out)

    def __str__(self) -> str:
        """Advice on how to continue."""
        # pathlib raises where a name is too long for the system
        begun = os.path.isfile(self.folder / MANIFEST)
        return f"Resume with: {self.command} --resume" if begun else f"Begin again with: {self.command}"


@contextmanager
def clear_errors(advice: object = "") -> Iterator[None]:
    """Turn errors into a message, with advice on how to continue, and an exit code.

    2 is for bad input, 1 for a run that the machine ended, 130 for Ctrl-C, 143 for SIGTERM.
    """
    # SIGTERM first, since the libraries take time to load
    with _ended_by_sigterm():
        handler = logging.StreamHandler()
        handler.setFormatter(_PlainFormatter("%(message)s"))
        logging.basicConfig(handlers=[handler], level=logging.WARNING)
        try:
            yield
        except Terminated:
            messages.print(f"Ended by SIGTERM. {advice}")
            raise typer.Exit(TERMINATED) from None
        except AwaitingRuns as waiting:
            messages.print(f"{waiting} {advice}")
            raise typer.Exit(0) from None
        except KeyboardInterrupt:
            messages.print(f"Interrupted. {advice}")
            raise typer.Exit(INTERRUPTED) from None
        except BrokenExecutor as error:
            module = sys.modules.get("experiments.cases.workers.workers")
            what = str(error) if module and isinstance(error, module.WorkersLostError) else ENDED_OUTSIDE
            fail(f"{what} {advice}", FAILED_RUN)
        except MemoryError:
            fail(f"there is not enough memory: use fewer --workers. {advice}", FAILED_RUN)
        except OSError as error:
            place = f"{error.filename}: " if error.filename is not None else ""
            way_out = f": {WAYS_OUT.get(error.errno or 0, 'check the file, or choose another')}"
            if error.errno and error.strerror != os.strerror(error.errno):
                way_out = ""  # its raiser says what to do
            fail(f"{place}{error.strerror or error}{way_out}. {advice}", FAILED_RUN)
        except Exception as error:
            if isinstance(error, ValueError) and _is_input(error):
                fail(str(error))
            from experiments.io.plug_ins import described, fault_of

            if not fault_of(error):
                raise
            fail(f"a plug-in raised {described(error)}. {advice}", FAILED_RUN)


@contextmanager
def _ended_by_sigterm() -> Iterator[None]:
    """Let SIGTERM raise `Terminated`, in the thread that receives signals."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(*_: object) -> None:
        raise Terminated

    before = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _is_input(error: ValueError) -> bool:
    """Check for an error of bad input, of the libraries that are loaded."""
    kinds = [("experiments.io.errors", "InputError"), ("imaging", "PictureError"), ("doe", "DesignError")]
    loaded = (getattr(sys.modules.get(module), name, ()) for module, name in kinds)
    return isinstance(error, tuple(kind for kind in loaded if kind))


def fail(message: str, code: int = BAD_INPUT) -> NoReturn:
    """Print what is wrong, and end the command by typer.Exit."""
    messages.print(Text.assemble(("Error:", "bold red"), " ", plain(message)))
    raise typer.Exit(code)


class CaseProgress:
    """Shows the progress of a batch of cases: a bar on a terminal, a line now and then elsewhere."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._last_line = QUIET_START - LINE_EVERY
        self._first: BatchProgress | None = None
        self._bar = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}", markup=False),
            BarColumn(bar_width=16),
            TextColumn("{task.percentage:3.0f} %  {task.fields[state]}"),
            console=messages,
            transient=True,
        )
        self._task = self._bar.add_task(title, total=1.0, state="starting", visible=False)

    def __enter__(self) -> CaseProgress:
        if messages.is_terminal:
            self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        if messages.is_terminal:
            self._bar.stop()

    def __call__(self, progress: BatchProgress) -> None:
        """Show the engine's progress."""
        self._first = self._first or progress
        if progress.seconds < QUIET_START:
            return
        state = describe_progress(progress, self._first)
        if messages.is_terminal:
            self._bar.update(self._task, completed=progress.fraction, state=state, visible=True)
        elif progress.seconds - self._last_line >= LINE_EVERY:
            self._last_line = progress.seconds
            messages.print(f"{self._title}: {100.0 * progress.fraction:.0f} %, {state}")


@contextmanager
def shown_count(title: str, total: int) -> Iterator[Callable[[int], None]]:
    """Show how many of some things are done, to be called with their number."""
    started = last = time.monotonic()
    with Progress(*Progress.get_default_columns(), console=messages, transient=True) as bar:
        task = bar.add_task(title, total=total, visible=False)

        def watch(done: int) -> None:
            nonlocal last
            now = time.monotonic()
            bar.update(task, completed=done, visible=now - started > QUIET_START)
            if not messages.is_terminal and now - last > LINE_EVERY and done < total:
                last = now
                left = duration((now - started) / done * (total - done))
                messages.print(f"{title}: {done} of {total}, {left} left")

        yield watch


def describe_progress(progress: BatchProgress, first: BatchProgress | None = None) -> str:
    """Describe the time left and what runs, e.g. ``1 min 20 s left, 3 of 12 cases, 2 lift``.

    See `time_left` for the `first` progress.
    """
    parts = [f"{progress.done} of {progress.total} cases"]
    parts += [f"{count} {phase}" for phase, count in progress.phase_counts.items() if phase != "waiting"]
    if (left := time_left(progress, first)) is not None:
        parts.insert(0, f"{duration(left)} left")
    return ", ".join(parts)
