"""Output of the command line: progress with the time left, and errors as one clear message."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn
from rich.text import Text

if TYPE_CHECKING:
    from dem_warp import Progress as BatchProgress

BAD_INPUT, FAILED_RUN, INTERRUPTED = 2, 1, 130
"""Exit codes."""

QUIET_START = 2.0
"""Least duration that shows progress [s]."""
FIRST_GUESS = 0.01
"""Part of the work that is done before the time left is guessed."""
LINE_EVERY = 10.0
"""Time between two lines of progress where there is no terminal [s]."""

messages = Console(stderr=True, highlight=False, soft_wrap=True, markup=False)
"""Console of progress and errors, whose text is taken as it is; results go to standard output."""


@contextmanager
def clear_errors(resume: str | None = None) -> Iterator[None]:
    """Turn errors into a message and an exit code: 2 for bad input, 130 for Ctrl-C, with how to resume."""
    from doe import DesignError
    from experiments.errors import InputError
    from imaging import PictureError

    logging.basicConfig(format="%(message)s", level=logging.WARNING)
    try:
        yield
    except (InputError, PictureError, DesignError) as error:
        fail(str(error))
    except KeyboardInterrupt:
        messages.print(f"Interrupted. Resume with: {resume}" if resume else "Interrupted.")
        raise typer.Exit(INTERRUPTED) from None


def fail(message: str, code: int = BAD_INPUT) -> None:
    """Say what is wrong and end the command by typer.Exit."""
    messages.print(Text.assemble(("Error:", "bold red"), f" {message}"))
    raise typer.Exit(code)


class CaseProgress:
    """Shows how far a batch of cases is: a bar on a terminal, a line now and then elsewhere."""

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


def describe_progress(progress: BatchProgress, first: BatchProgress | None = None) -> str:
    """Say how long it will take and what runs, as ``1 min 20 s left, 3 of 12 cases, 2 lift``.

    The speed is that since the `first` progress: what an earlier run had done is not this one's speed.
    """
    parts = [f"{progress.done} of {progress.total} cases"]
    parts += [f"{count} {phase}" for phase, count in progress.phase_counts.items() if phase != "waiting"]
    done, seconds = progress.fraction, progress.seconds
    if first is not None:
        done, seconds = done - first.fraction, seconds - first.seconds
    if done >= FIRST_GUESS and progress.fraction < 1.0:
        left = seconds * (1.0 - progress.fraction) / done
        parts.insert(0, f"{duration(left)} left")
    return ", ".join(parts)


def duration(seconds: float) -> str:
    """Write a time as a person would: ``12 s``, ``1 min 20 s``, ``2 h 5 min``."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
