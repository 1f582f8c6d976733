"""Programs as engines: one folder a case, several at once, each failure a status with its reason.

A finished case is never run twice: its answer stays in its folder until the caller, who keeps results,
removes all folders. A case that failed is tried again.
"""

from __future__ import annotations

import json
import math
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from dem_warp import Case, CaseResult, Progress
from dem_warp.cores import cores
from dem_warp.result import OnProgress, OnResult
from experiments.cases.engines import run_program
from experiments.cases.engines.engine import NO_ANSWER
from experiments.cases.engines.key import case_key

FAILED = "failed"
"""Folder, next to that of the running cases, of the cases whose program failed, with all that it wrote."""

SHOWN = 200
"""Characters of a program's last line that a reason shows."""

REPORT_EVERY = 1.0
"""Time between two reports of progress [s]."""


class AnswerError(Exception):
    """A program gave no answer, or an invalid one."""


class Program(Protocol):
    """Another program: it gets a case as files and leaves its answer as files."""

    @property
    def name(self) -> str:
        """Name for people."""

    @property
    def identity(self) -> dict[str, Any]:
        """Everything but the case that determines its result, as JSON-able data."""

    @property
    def observables(self) -> tuple[str, ...]:
        """Observables of the test that it gives with the heap."""

    def answers(self, case: Case) -> tuple[str, ...]:
        """Return the names of the files that it leaves and `read` reads."""

    def check(self, case: Case) -> None:
        """Raise ValueError for a case that it cannot simulate."""

    def write(self, case: Case, folder: Path) -> Sequence[str]:
        """Write a case into an empty folder, and return the words of the command to run there."""

    def read(self, case: Case, folder: Path) -> CaseResult:
        """Read the answer from a folder; raise AnswerError without a valid one."""


@dataclass(frozen=True)
class ProgramEngine:
    """An engine that runs a program once for every case."""

    program: Program
    workers: int | None = None
    """Cases at once; None: one a core."""
    time_limit: float | None = None
    """Wall time of a case [s]; None: no limit."""

    @property
    def identity(self) -> dict[str, Any]:
        """Identity of the program: neither time limit nor number of workers changes a result."""
        return self.program.identity

    @property
    def observables(self) -> tuple[str, ...]:
        """Observables of the test that the program gives with the heap."""
        return self.program.observables

    def check(self, case: Case) -> None:
        """Raise ValueError for a case that the program cannot simulate."""
        self.program.check(case)

    def __call__(
        self,
        cases: Sequence[Case],
        device: str | None = None,
        workers: int | None = None,
        on_result: OnResult | None = None,
        on_progress: OnProgress | None = None,
        checkpoint: str | Path | None = None,
    ) -> list[CaseResult]:
        """Simulate cases; the program chooses its own device."""
        with ExitStack() as stack:
            root = checkpoint or stack.enter_context(tempfile.TemporaryDirectory(prefix="dem-warp-"))
            programs = stack.enter_context(
                _RunningPrograms(self, Path(root).resolve(), keeps=checkpoint is not None)
            )
            pool = stack.enter_context(
                ThreadPoolExecutor(min(workers or self.workers or cores(), max(len(cases), 1)))
            )
            begun = {pool.submit(programs.run, case): index for index, case in enumerate(cases)}
            try:
                return _gather(begun, on_result, on_progress)
            except BaseException:
                programs.end()
                pool.shutdown(wait=True, cancel_futures=True)
                raise


def _gather(
    begun: dict[Future[CaseResult], int], on_result: OnResult | None, on_progress: OnProgress | None
) -> list[CaseResult]:
    """Hand on results as they come, and return them in order."""
    started, pending = time.perf_counter(), set(begun)
    results: dict[int, CaseResult] = {}
    while pending:
        ended, pending = wait(pending, REPORT_EVERY, FIRST_COMPLETED)
        for future in ended:
            index = begun[future]
            results[index] = future.result()
            if on_result:
                on_result(index, results[index])
        if on_progress:
            done, total = len(results), len(begun)
            seconds = time.perf_counter() - started
            running = sum(future.running() for future in pending)
            on_progress(Progress(done, total, done / total, {"run": running}, seconds))
    return [results[index] for index in range(len(begun))]


@dataclass
class _RunningPrograms:
    """Programs that are running, and the folders of their cases."""

    engine: ProgramEngine
    root: Path
    keeps: bool
    """True if the folders outlive the call."""
    running: set[subprocess.Popen[bytes]] = field(default_factory=set)
    ended: bool = False
    lock: threading.Lock = field(default_factory=threading.Lock)

    def __enter__(self) -> _RunningPrograms:
        return self

    def __exit__(self, *error: object) -> None:
        self.end()

    def end(self) -> None:
        """End all programs, and start no more."""
        with self.lock:
            self.ended = True
            for process in self.running:
                if process.stdin:
                    process.stdin.close()

    def run(self, case: Case) -> CaseResult:
        """Simulate a case, or read the answer that an earlier run left."""
        folder, program = self.root / case_key(case, self.engine)[:24], self.engine.program
        try:
            if _ending(folder).get("code") != 0:
                self._run_program(case, folder)
            result = self._read(case, folder)
        except AnswerError as error:
            reason = str(error) + self._put_aside(folder)
            return empty_result(NO_ANSWER, reason, {"engine": program.name})
        # the laws that were asked for; the engine may have taken the nearest
        asked = {"laws": case.laws.to_dict()}
        made_by = {"engine": program.name, "seconds": _ending(folder)["seconds"]} | asked
        return replace(result, provenance=result.provenance | made_by)

    def _run_program(self, case: Case, folder: Path) -> None:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        try:
            words = self.engine.program.write(case, folder)
        except ValueError as error:
            raise AnswerError(f"the program cannot simulate the case: {error}") from error
        self._wait_for(words, folder)
        limit = self.engine.time_limit
        ending = _ending(folder)
        if ending.get("timed_out"):
            raise AnswerError(f"the program was ended at its time limit of {limit:g} s")
        if "error" in ending:
            raise AnswerError(f"the program {words[0]} could not be started: {ending['error']}")
        if code := ending.get("code", -1):
            how = f"the exit code {code}" if code >= 0 else f"the signal {-code}"
            raise AnswerError(f"the program ended with {how}{_last_line(folder)}")

    def _wait_for(self, words: Sequence[str], folder: Path) -> None:
        """Run a program until it ends."""
        limit = math.inf if self.engine.time_limit is None else self.engine.time_limit
        order = [sys.executable, "-I", "-S", run_program.__file__, repr(float(limit)), *words]
        with self.lock:
            if self.ended:
                raise AnswerError("the run was interrupted before the program was started")
            # in its own session, so that an interrupt at the terminal reaches this process alone
            process = subprocess.Popen(
                order, cwd=folder, stdin=subprocess.PIPE, start_new_session=run_program.POSIX
            )
            self.running.add(process)
        try:
            process.wait()
        finally:
            with self.lock:
                self.running.discard(process)
                if process.stdin:
                    process.stdin.close()

    def _read(self, case: Case, folder: Path) -> CaseResult:
        program = self.engine.program
        try:
            result = program.read(case, folder)
        except AnswerError as error:
            raise AnswerError(f"{error}{_last_line(folder)}") from error
        if self.keeps:  # other files of the program may be large
            _remove_others(folder, {run_program.ENDING, *program.answers(case)})
        return result

    def _put_aside(self, folder: Path) -> str:
        """Keep the folder of a case that failed, and say where it is."""
        if self.ended or not self.keeps or not folder.is_dir():
            return ""
        aside = self.root.with_name(FAILED) / folder.name
        shutil.rmtree(aside, ignore_errors=True)
        aside.parent.mkdir(parents=True, exist_ok=True)
        folder.replace(aside)
        return f"; its folder is {aside}"


def _ending(folder: Path) -> dict[str, Any]:
    """Read the note of a program's end; empty without one."""
    try:
        return json.loads((folder / run_program.ENDING).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def _last_line(folder: Path) -> str:
    """Return the last line that a program wrote: an ``ERROR``, else of its errors, else of its output."""
    lines = []
    for name in (run_program.OUTPUT, run_program.ERRORS):
        try:
            text = (folder / name).read_bytes()[-4096:].decode("utf-8", "replace")
        except OSError:
            continue
        lines += [line.strip() for line in text.splitlines() if line.strip()]
    # Yade prints a greeting to its errors, and all codes here print an ERROR to their output
    telling = [line for line in lines if line.startswith("ERROR")] or lines
    return f"; its last line: {telling[-1][:SHOWN]}" if telling else ""


def _remove_others(folder: Path, kept: set[str]) -> None:
    for path in folder.iterdir():
        if path.name not in kept:
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()


def empty_result(status: str, reason: str, provenance: dict[str, Any]) -> CaseResult:
    """Build the result of a case without grains."""
    return CaseResult(
        status=status,
        reason=reason,
        positions=np.empty((0, 3)),
        orientations=np.empty((0, 4)),
        sizes=np.empty(0),
        shapes=np.empty(0, dtype=int),
        clumps=np.zeros((1, 1, 4)),
        provenance=provenance,
    )
