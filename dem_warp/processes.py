"""Cases spread over processes on a CPU: one world a task, as Warp's CPU kernels use one thread."""

from __future__ import annotations

import ctypes
import logging
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any

from dem_warp.batch import Onlooker, begin
from dem_warp.case import Case
from dem_warp.checkpoint import Checkpoints
from dem_warp.device import resolve_device
from dem_warp.result import CaseResult, OnResult

REPORT_EVERY = 0.5
"""Time between two reports of progress [s]."""

PHASE_LENGTH = 16
"""Characters of a phase's name that travel between processes."""

NO_CASE = -1
"""Index of the case of a process that has none."""

LOSSES = 3
"""Processes that are lost in a row, with no case ended between, before a call is given up."""

Report = Callable[[Sequence[float], Sequence[str]], None]
"""Takes the fraction done and the phase of every case."""

_log = logging.getLogger(__name__)


class _Process(SpawnProcess):
    """A process that simulates, told from others that a program may have."""


class _Context(SpawnContext):
    Process = _Process


_CONTEXT = _Context()
"""Start of processes: one that has read a GPU's state must not be forked."""


class _Stand(ctypes.Structure):
    """State of a process, which its parent reads at any time.

    No lock guards it: a process that is killed would keep it. So what is read may be half of it old.
    """

    _fields_ = (
        ("case", ctypes.c_int),
        ("fraction", ctypes.c_double),
        ("phase", ctypes.c_char * PHASE_LENGTH),
    )

    def put(self, case: int, fraction: float, phase: str) -> None:
        """Tell of a case how far it is."""
        self.fraction, self.phase, self.case = fraction, phase.encode()[:PHASE_LENGTH], case


_own: list[_Stand] = []
"""State of this process, which it tells its parent."""


def _start(stands: Any, started: Any) -> None:
    """Begin a process: its parent ends it, not Ctrl-C, which reaches every process of a terminal."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
    with started.get_lock():
        number = started.value
        started.value += 1
    _own.append(stands[number])


def end_with_parent() -> None:
    """Let this process end when its parent is gone: a parent that was killed cannot tell its workers."""
    threading.Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    if parent := multiprocessing.parent_process():
        parent.join()
        os._exit(1)


def _run_case(
    index: int, case: Case, checkpoints: Checkpoints | None, onlooker: Onlooker | None
) -> CaseResult:
    """Run one case in a process, which tells how far it is."""
    batch, _, refused = begin([case], resolve_device("cpu"), checkpoints, onlooker)
    if batch is None:
        return refused[0]
    try:
        while not (ended := batch.advance()):
            _own[0].put(index, batch.fraction(0), batch.phase(0))
    finally:
        _own[0].case = NO_CASE
    return ended[0][1]


def _gather(futures: dict[Future[CaseResult], int], keep: OnResult, look: Callable[[], None]) -> list[int]:
    """Take results as they are had, and look now and then; return those cases that were lost."""
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
    """Processes that simulate cases on a CPU, for one call of `simulate` after another.

    They start with the first cases, and stay until the block of a ``with`` ends.

    Parameters
    ----------
    count : int
        Cases that are simulated at once.

    Examples
    --------
    >>> with Processes(2) as processes:
    ...     first = simulate(cases, "cpu", processes)
    ...     then = simulate(others, "cpu", processes)
    """

    def __init__(self, count: int) -> None:
        self.count = count
        self._pool: ProcessPoolExecutor | None = None
        self._stands: Any = None

    def __enter__(self) -> Processes:
        """Return these processes, which start later."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the processes."""
        self.end()

    def run(
        self,
        cases: Sequence[Case],
        on_result: OnResult,
        report: Report,
        checkpoints: Checkpoints | None = None,
        onlooker: Onlooker | None = None,
    ) -> None:
        """Run cases, `count` at a time; those of a process that is lost go on in another one.

        Parameters
        ----------
        cases : sequence of Case
        on_result : callable
            Called with index and result of each case as it ends.
        report : callable
            Called now and then with the fraction done and the phase of every case.
        checkpoints : Checkpoints, optional
            Where the processes save their cases and take them up.
        onlooker : Onlooker, optional
            Sees the batch of each case, in its process.

        Raises
        ------
        concurrent.futures.process.BrokenProcessPool
            When processes are lost again and again, with no case ended between.
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
                futures = {self._submit(i, cases[i], checkpoints, onlooker): i for i in left}
                lost = _gather(futures, keep, look)
                losses = losses + 1 if len(lost) == len(left) else 0
                if losses == LOSSES:
                    raise BrokenProcessPool("processes are lost again and again")
                if lost:
                    _log.warning("a process was lost: its cases, and those that waited, go on in others")
                left = lost
        except BaseException:
            self._give_up()
            raise

    def end(self) -> None:
        """End the processes, none of which has a case."""
        if pool := self._pool:
            self._pool = None
            pool.shutdown()

    def _started(self) -> ProcessPoolExecutor:
        if self._pool is None:
            self._stands = _CONTEXT.RawArray(_Stand, [(NO_CASE, 0.0, b"")] * self.count)
            begun = (self._stands, _CONTEXT.Value("i", 0))
            self._pool = ProcessPoolExecutor(self.count, _CONTEXT, _start, begun)
        return self._pool

    def _submit(
        self, index: int, case: Case, checkpoints: Checkpoints | None, onlooker: Onlooker | None
    ) -> Future[CaseResult]:
        """Give a case to the processes, or to new ones where one of them was lost."""
        try:
            return self._started().submit(_run_case, index, case, checkpoints, onlooker)
        except BrokenProcessPool:
            self._give_up()
            return self._started().submit(_run_case, index, case, checkpoints, onlooker)

    def _read(self, fractions: list[float], phases: list[str]) -> None:
        """Read how far the running cases are."""
        for stand in self._stands:
            if stand.case != NO_CASE:
                fractions[stand.case], phases[stand.case] = stand.fraction, stand.phase.decode()

    def _give_up(self) -> None:
        """End the processes, whatever they are at."""
        if pool := self._pool:
            self._pool = None
            pool.shutdown(wait=False, cancel_futures=True)
            for process in multiprocessing.active_children():
                if isinstance(process, _Process):
                    process.terminate()
