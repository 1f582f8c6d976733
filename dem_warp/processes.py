"""Cases in processes on a CPU: one world per task, as Warp's CPU kernels use one thread."""

from __future__ import annotations

import ctypes
import logging
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.context import SpawnContext, SpawnProcess
from pathlib import Path
from typing import Any

from dem_warp.batch import OnAdvance, begin
from dem_warp.case import Case
from dem_warp.checkpoint import Checkpoints
from dem_warp.device import resolve_device
from dem_warp.result import CaseResult, OnResult

REPORT_EVERY = 0.5
"""Time between two reports of progress [s]."""

PHASE_LENGTH = 16
"""Characters of a phase's name in a process's state."""

NO_CASE = -1
"""Index of the case of an idle process."""

LOSSES = 3
"""Losses of processes in a row, without an ended case, after which a call fails."""

GUARD = 'if __name__ == "__main__":'
"""Line without which a script cannot start processes: each of them imports the script."""

Report = Callable[[Sequence[float], Sequence[str]], None]
"""Callback with the fraction done and the phase of every case."""

_log = logging.getLogger(__name__)


class _Process(SpawnProcess):
    """A simulating process; a subclass, so that it can be recognised."""


class _Context(SpawnContext):
    Process = _Process


_CONTEXT = _Context()
"""Start method of processes: a process with a GPU context must not be forked."""


class _State(ctypes.Structure):
    """State of a process, which its parent reads at any time.

    It has no lock, as a killed process would keep it; so a part of what is read may be old.
    """

    _fields_ = (
        ("case", ctypes.c_int),
        ("fraction", ctypes.c_double),
        ("phase", ctypes.c_char * PHASE_LENGTH),
    )

    def put(self, case: int, fraction: float, phase: str) -> None:
        self.fraction, self.phase, self.case = fraction, phase.encode()[:PHASE_LENGTH], case


_own: list[_State] = []
"""State of this process, shared with its parent."""


def _start(states: Any, started: Any) -> None:
    """Begin a process: its parent ends it, not Ctrl-C, which reaches every process of a terminal."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
    with started.get_lock():
        number = started.value
        started.value += 1
    _own.append(states[number])


def require_guard() -> None:
    """End a script that never looks at its ``__name__`` in one sentence, before its processes run it again.

    Raises
    ------
    SystemExit
        If this program is such a script.
    """
    main = sys.modules["__main__"]
    path = Path(getattr(main, "__file__", None) or "")
    is_script = main.__spec__ is None and path.suffix == ".py" and path.is_file()
    if is_script and "__name__" not in path.read_text(encoding="utf-8", errors="replace"):
        raise SystemExit(f"{path}: needs {GUARD} above the call: its worker processes import this file.")


def end_with_parent() -> None:
    """Let this process end with its parent, even if the parent is killed."""
    threading.Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    if parent := multiprocessing.parent_process():
        parent.join()
        os._exit(1)


def _run_case(
    index: int, case: Case, checkpoints: Checkpoints | None, on_advance: OnAdvance | None
) -> CaseResult:
    """Run one case in a process, with its progress in the shared state."""
    batch, _, refused = begin([case], resolve_device("cpu"), checkpoints, on_advance)
    if batch is None:
        return refused[0]
    try:
        while not (ended := batch.advance()):
            _own[0].put(index, batch.fraction(0), batch.phase(0))
    finally:
        _own[0].case = NO_CASE
    return ended[0][1]


def _gather(futures: dict[Future[CaseResult], int], keep: OnResult, look: Callable[[], None]) -> list[int]:
    """Pass on results, call `look` regularly, and return the cases of lost processes."""
    lost, pending = [], set(futures)
    while pending:
        finished, pending = wait(pending, REPORT_EVERY, FIRST_COMPLETED)
        for future in finished:
            if isinstance(future.exception(), BrokenProcessPool):
                lost.append(futures[future])
            else:
                keep(futures[future], future.result())
        look()
    return sorted(lost)


class Processes:
    """Processes that simulate cases on a CPU, for several calls of `simulate`.

    They start with the first cases and end with the ``with`` block.

    Examples
    --------
    >>> with Processes(2) as processes:
    ...     first = simulate(cases, "cpu", processes)
    ...     then = simulate(others, "cpu", processes)
    """

    def __init__(self, count: int) -> None:
        self.count = count
        self._pool: ProcessPoolExecutor | None = None
        self._states: Any = None

    def __enter__(self) -> Processes:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def run(
        self,
        cases: Sequence[Case],
        on_result: OnResult,
        report: Report,
        checkpoints: Checkpoints | None = None,
        on_advance: OnAdvance | None = None,
    ) -> None:
        """Run cases, `count` at a time; the cases of a lost process continue in another one.

        `report` is called regularly with the fraction done and the phase of every case; the other parameters
        are as in `simulate`. BrokenProcessPool is raised after LOSSES losses without an ended case.
        """
        fractions, phases = [0.0] * len(cases), ["waiting"] * len(cases)

        def keep(index: int, result: CaseResult) -> None:
            fractions[index] = 1.0
            on_result(index, result)

        def look() -> None:
            self._read(fractions, phases)
            report(fractions, phases)

        left, losses = list(range(len(cases))), 0
        try:
            while left:
                futures = {self._submit(i, cases[i], checkpoints, on_advance): i for i in left}
                lost = _gather(futures, keep, look)
                losses = losses + 1 if len(lost) == len(left) else 0
                if losses == LOSSES:
                    raise BrokenProcessPool("processes were lost repeatedly; they may need more memory")
                if lost:
                    _log.warning("a process was lost: its cases and the waiting ones continue in others")
                left = lost
        except BaseException:
            self._terminate()
            raise

    def end(self) -> None:
        """End the idle processes."""
        if pool := self._pool:
            self._pool = None
            pool.shutdown()

    def _started(self) -> ProcessPoolExecutor:
        if self._pool is None:
            require_guard()
            self._states = _CONTEXT.RawArray(_State, [(NO_CASE, 0.0, b"")] * self.count)
            begun = (self._states, _CONTEXT.Value("i", 0))
            self._pool = ProcessPoolExecutor(self.count, _CONTEXT, _start, begun)
        return self._pool

    def _submit(
        self, index: int, case: Case, checkpoints: Checkpoints | None, on_advance: OnAdvance | None
    ) -> Future[CaseResult]:
        """Submit a case, to new processes if one was lost."""
        try:
            return self._started().submit(_run_case, index, case, checkpoints, on_advance)
        except BrokenProcessPool:
            self._terminate()
            return self._started().submit(_run_case, index, case, checkpoints, on_advance)

    def _read(self, fractions: list[float], phases: list[str]) -> None:
        """Read the progress of the running cases."""
        for state in self._states:
            if state.case != NO_CASE:
                fractions[state.case], phases[state.case] = state.fraction, state.phase.decode()

    def _terminate(self) -> None:
        """End the processes, with or without a case."""
        if pool := self._pool:
            self._pool = None
            pool.shutdown(wait=False, cancel_futures=True)
            for process in multiprocessing.active_children():
                if isinstance(process, _Process):
                    process.terminate()
