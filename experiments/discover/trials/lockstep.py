"""Many analyses in step: the waves of a round go to the simulator in one call.

Each analysis is a generator that yields points and is sent their outcomes. They live in worker processes, so
that the statistics of a round take every core; the simulator stays in this process.
"""

from __future__ import annotations

import multiprocessing
import os
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Protocol

from experiments.discover.analysis import Analysis
from experiments.discover.discovery import Discovery
from experiments.discover.simulator import Outcomes, Point, Simulator

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Crash:
    """An analysis that raised: a result of a trial like any other."""

    traceback: str


Step = list[Point] | Discovery | Crash
"""What an analysis answers: a wave that it wants, or how it ended."""


class Crew(Protocol):
    """Whoever runs the analyses."""

    def step(self, answers: Mapping[str, Outcomes | None]) -> dict[str, Step]:
        """Send every named analysis the outcomes of its wave, or None to begin, and collect what they say."""


class LocalCrew:
    """Runs analyses in this process.

    Parameters
    ----------
    begin
        Starts the analysis of a name.
    """

    def __init__(self, begin: Callable[[str], Analysis]) -> None:
        self._begin = begin
        self._running: dict[str, Analysis] = {}

    def step(self, answers: Mapping[str, Outcomes | None]) -> dict[str, Step]:
        """Take one analysis after the other."""
        return {name: self._step(name, answer) for name, answer in answers.items()}

    def _step(self, name: str, answer: Outcomes | None) -> Step:
        try:
            if answer is None:
                self._running[name] = self._begin(name)
                return next(self._running[name])
            return self._running[name].send(answer)
        except StopIteration as end:
            del self._running[name]
            discovery: Discovery = end.value
            return discovery
        except Exception:
            self._running.pop(name, None)
            return Crash(traceback.format_exc())


class ProcessCrew:
    """Spreads analyses over processes; an analysis stays where it began.

    Parameters
    ----------
    pipes
        One to each process.
    """

    def __init__(self, pipes: Sequence[Connection]) -> None:
        self._pipes = pipes
        self._homes: dict[str, int] = {}

    def step(self, answers: Mapping[str, Outcomes | None]) -> dict[str, Step]:
        """Send each process what its analyses wait for, then collect; new analyses are dealt in turn."""
        shares: dict[int, dict[str, Outcomes | None]] = {}
        for name, answer in answers.items():
            home = self._homes.setdefault(name, len(self._homes) % len(self._pipes))
            shares.setdefault(home, {})[name] = answer
        for home, share in shares.items():
            self._pipes[home].send(share)
        steps: dict[str, Step] = {}
        for home in shares:
            steps |= self._pipes[home].recv()
        return {name: steps[name] for name in answers}


@contextmanager
def process_crew(begin: Callable[[str], Analysis], workers: int) -> Iterator[ProcessCrew]:
    """Start processes for analyses, and end them with the block.

    Parameters
    ----------
    begin
        Starts the analysis of a name; must be picklable.
    workers
        Number of processes.

    Yields
    ------
    ProcessCrew
    """
    # Not forked: the parent may hold a CUDA context and threads, which do not survive a fork.
    context = multiprocessing.get_context("spawn")
    pipes, processes = [], []
    try:
        with _one_thread_each():
            for _ in range(workers):
                mine, theirs = context.Pipe()
                process = context.Process(target=_serve, args=(theirs,), daemon=True)
                process.start()
                theirs.close()
                pipes.append(mine)
                processes.append(process)
        # Not with the start, which waits until the process before has loaded its libraries and reads.
        for pipe in pipes:
            pipe.send(begin)
        yield ProcessCrew(pipes)
    finally:
        for pipe in pipes:
            pipe.close()
        for process in processes:
            process.join()


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Let processes that are started meanwhile use one thread of linear algebra: there is one a core."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ |= dict.fromkeys(_THREADS, "1")
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _serve(pipe: Connection) -> None:
    """Be told how analyses begin, and run them until the other end of the pipe closes."""
    try:
        crew = LocalCrew(pipe.recv())
    except EOFError:
        return
    while True:
        try:
            answers = pipe.recv()
        except EOFError:
            return
        pipe.send(crew.step(answers))


@dataclass(frozen=True)
class Round:
    """One turn of all analyses that are under way."""

    number: int
    ended: dict[str, Discovery | Crash]
    """Analyses that ended before this round's cases."""
    running: int
    """Analyses that want cases."""
    cases: int
    """Cases of their waves, all in one call."""


def in_step(names: Sequence[str], crew: Crew, simulator: Simulator) -> Iterator[Round]:
    """Run analyses round by round until all have ended.

    A round is yielded before its cases run, so that whoever iterates may stop there; the simulator keeps what
    it has run, and the same analyses then come to the same point again.

    Parameters
    ----------
    names
        Analyses to begin.
    crew
        Runs them.
    simulator
        Answers their waves.

    Yields
    ------
    Round
    """
    answers: dict[str, Outcomes | None] = dict.fromkeys(names)
    number = 0
    while answers:
        steps = crew.step(answers)
        waves = {name: step for name, step in steps.items() if isinstance(step, list)}
        ended = {name: step for name, step in steps.items() if not isinstance(step, list)}
        points = [point for wave in waves.values() for point in wave]
        number += 1
        yield Round(number, ended, len(waves), len(points))
        answers = dict(_dealt(waves, simulator(points))) if waves else {}


def _dealt(waves: Mapping[str, list[Point]], outcomes: Outcomes) -> Iterator[tuple[str, Outcomes]]:
    """Give each wave its part of the outcomes."""
    start = 0
    for name, wave in waves.items():
        end = start + len(wave)
        yield name, Outcomes(outcomes.values[start:end], outcomes.reasons[start:end])
        start = end
