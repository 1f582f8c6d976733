"""Programs as engines: one folder a case, several at once, each failure a status with its reason.

A finished case is never run twice: its answer stays in its folder until the caller, who keeps results,
removes the folder of all. What a program failed at is tried again.
"""

from __future__ import annotations

import json
import math
import os
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
from dem_warp.result import OnProgress, OnResult
from experiments.cases.engines import keeper
from experiments.cases.engines.engine import NO_ANSWER
from experiments.cases.engines.key import case_key

FAILED = "failed"
"""Folder, beside that of the running cases, of those whose program failed: what it wrote is there."""

TOLD = 200
"""Characters of a program's last words that a reason tells."""

REPORT_EVERY = 1.0
"""Time between two reports of progress [s]."""


class AnswerError(Exception):
    """A program gave no answer, or one that breaks the rules."""


class Program(Protocol):
    """Another program: how a case is put to it, and how its answer is read."""

    @property
    def name(self) -> str:
        """Name in words."""

    @property
    def identity(self) -> dict[str, Any]:
        """All beside a case that determines its result, as JSON-able data."""

    @property
    def observables(self) -> tuple[str, ...]:
        """Observables of the test that it tells beside the heap."""

    def answers(self, case: Case) -> tuple[str, ...]:
        """Name the files that it leaves and `read` reads."""

    def check(self, case: Case) -> None:
        """Raise ValueError for a case that it cannot simulate."""

    def write(self, case: Case, folder: Path) -> Sequence[str]:
        """Write a case into an empty folder, and return the words of the command that is run there."""

    def read(self, case: Case, folder: Path) -> CaseResult:
        """Read the answer from a folder; raises AnswerError where there is none."""


@dataclass(frozen=True)
class ProgramEngine:
    """An engine that runs a program once for every case."""

    program: Program
    workers: int | None = None
    """Cases at once; None: one a core."""
    time_limit: float | None = None
    """Wall time of a case [s]; None: none."""

    @property
    def identity(self) -> dict[str, Any]:
        """Identity of the program: neither time limit nor number of workers changes a result."""
        return self.program.identity

    @property
    def observables(self) -> tuple[str, ...]:
        """Observables of the test that the program tells beside the heap."""
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
        """Simulate cases; the device is the program's own affair."""
        with ExitStack() as stack:
            root = checkpoint or stack.enter_context(tempfile.TemporaryDirectory(prefix="dem-warp-"))
            crew = stack.enter_context(_Crew(self, Path(root).resolve(), keeps=checkpoint is not None))
            pool = stack.enter_context(
                ThreadPoolExecutor(min(workers or self.workers or os.cpu_count() or 1, max(len(cases), 1)))
            )
            begun = {pool.submit(crew.run, case): index for index, case in enumerate(cases)}
            try:
                return _gather(begun, on_result, on_progress)
            except BaseException:
                crew.end()
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
            on_progress(Progress(done, total, done / total, {"run": total - done}, seconds))
    return [results[index] for index in range(len(begun))]


@dataclass
class _Crew:
    """Programs that run at the moment, and the folders of their cases."""

    engine: ProgramEngine
    root: Path
    keeps: bool
    """True where folders outlive the call."""
    running: set[subprocess.Popen[bytes]] = field(default_factory=set)
    ended: bool = False
    lock: threading.Lock = field(default_factory=threading.Lock)

    def __enter__(self) -> _Crew:
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
        """Simulate a case, or take up the answer that a run before left of it."""
        folder, program = self.root / case_key(case, self.engine)[:24], self.engine.program
        try:
            if _ending(folder).get("code") != 0:
                self._run_afresh(case, folder)
            result = self._read(case, folder)
        except AnswerError as error:
            reason = str(error) + self._put_aside(folder)
            return empty_result(NO_ANSWER, reason, {"engine": program.name})
        # the laws that were asked for; an engine's name says whether the nearest may stand for them
        asked = {"laws": case.laws.to_dict()}
        made_by = {"engine": program.name, "seconds": _ending(folder)["seconds"]} | asked
        return replace(result, provenance=result.provenance | made_by)

    def _run_afresh(self, case: Case, folder: Path) -> None:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        try:
            words = self.engine.program.write(case, folder)
        except ValueError as error:
            raise AnswerError(f"the case cannot be put to the program: {error}") from error
        self._keep(words, folder)
        limit = self.engine.time_limit
        ending = _ending(folder)
        if ending.get("timed_out"):
            raise AnswerError(f"the program was ended at its time limit of {limit:g} s")
        if "error" in ending:
            raise AnswerError(f"the program {words[0]} could not be started: {ending['error']}")
        if code := ending.get("code", -1):
            raise AnswerError(f"the program ended with {_ended_with(code)}{_last_words(folder)}")

    def _keep(self, words: Sequence[str], folder: Path) -> None:
        """Run a program under a keeper until it ends."""
        limit = math.inf if self.engine.time_limit is None else self.engine.time_limit
        order = [sys.executable, "-I", "-S", keeper.__file__, repr(float(limit)), *words]
        with self.lock:
            if self.ended:
                raise AnswerError("the run was interrupted before the program was started")
            # A session of its own: an interrupt at the terminal reaches this process alone, which decides.
            process = subprocess.Popen(
                order, cwd=folder, stdin=subprocess.PIPE, start_new_session=keeper.POSIX
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
            raise AnswerError(f"{error}{_last_words(folder)}") from error
        if self.keeps:  # what else the program left may be large
            _remove_others(folder, {keeper.ENDING, *program.answers(case)})
        return result

    def _put_aside(self, folder: Path) -> str:
        """Keep the folder of a case that failed for whoever looks for the cause, and say where."""
        if self.ended or not self.keeps or not folder.is_dir():
            return ""
        aside = self.root.with_name(FAILED) / folder.name
        shutil.rmtree(aside, ignore_errors=True)
        aside.parent.mkdir(parents=True, exist_ok=True)
        folder.replace(aside)
        return f"; its folder is {aside}"


def _ending(folder: Path) -> dict[str, Any]:
    """Note of a program's end; empty where there is none."""
    try:
        return json.loads((folder / keeper.ENDING).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def _ended_with(code: int) -> str:
    return f"the exit code {code}" if code >= 0 else f"the signal {-code}"


def _last_words(folder: Path) -> str:
    """Last line that a program wrote: one that says ``ERROR``, else of its errors, else of its output."""
    lines = []
    for name in (keeper.OUTPUT, keeper.ERRORS):
        try:
            text = (folder / name).read_bytes()[-4096:].decode("utf-8", "replace")
        except OSError:
            continue
        lines += [line.strip() for line in text.splitlines() if line.strip()]
    # Yade greets on the stream of its errors, and all codes here write an ERROR to their output
    telling = [line for line in lines if line.startswith("ERROR")] or lines
    return f"; its last words: {telling[-1][:TOLD]}" if telling else ""


def _remove_others(folder: Path, kept: set[str]) -> None:
    for path in folder.iterdir():
        if path.name not in kept:
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()


def empty_result(status: str, reason: str, provenance: dict[str, Any]) -> CaseResult:
    """Result of a case that left no grains."""
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
