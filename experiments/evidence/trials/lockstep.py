"""Many analyses in step: the waves of a round go to the simulator in one call.

Each analysis is a generator that yields points and is sent their outcomes. They live in worker processes, so
that the statistics of a round take every core; the simulator stays in this process. The analyses are in two
shifts, which take turns: while the waves of the one are simulated, the other one calculates.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import traceback
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import accumulate, pairwise

from dem_warp.processes import end_with_parent
from doe.discrepancy import Analysis, Discovery, Outcomes, Point, Simulator

POLITE = 10
"""Niceness of the processes of the analyses."""


@dataclass(frozen=True)
class Crash:
    """An analysis that raised: a result of a trial like any other."""

    traceback: str


Step = list[Point] | Discovery | Crash
"""Answer of an analysis: a wave that it wants, or how it ended."""


Answers = Mapping[str, Outcomes | None]
"""Outcomes of the waves of named analyses; None begins one."""


class LocalCrew:
    """Runs analyses in this process; `begin` starts the one of a name."""

    def __init__(self, begin: Callable[[str], Analysis]) -> None:
        self._begin = begin
        self._running: dict[str, Analysis] = {}
        self._said: dict[str, Step] = {}

    def send(self, answers: Answers) -> None:
        """Take one analysis after the other."""
        self._said = {name: self._step(name, answer) for name, answer in answers.items()}

    def collect(self) -> dict[str, Step]:
        """Return what they said."""
        return self._said

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
    """Spreads analyses over pools of one process with a crew each; an analysis stays where it began."""

    def __init__(self, homes: Sequence[ProcessPoolExecutor]) -> None:
        self._homes = homes
        self._dealt: dict[str, int] = {}
        self._asked: list[str] = []
        self._waiting: list[Future[dict[str, Step]]] = []

    def send(self, answers: Answers) -> None:
        """Send each process what its analyses wait for; new analyses are dealt in turn."""
        shares: dict[int, dict[str, Outcomes | None]] = {}
        for name, answer in answers.items():
            home = self._dealt.setdefault(name, len(self._dealt) % len(self._homes))
            shares.setdefault(home, {})[name] = answer
        self._asked = list(answers)
        self._waiting = [self._homes[home].submit(_take, share) for home, share in shares.items()]

    def collect(self) -> dict[str, Step]:
        """Wait for every process that was sent something."""
        steps = {name: step for ended in self._waiting for name, step in ended.result().items()}
        return {name: steps[name] for name in self._asked}


@contextmanager
def process_crew(begin: Callable[[str], Analysis], workers: int) -> Iterator[ProcessCrew]:
    """Start processes for analyses, and end them with the block; `begin` must be picklable."""
    # Not forked: the parent may hold a CUDA context and threads, which do not survive a fork.
    context = multiprocessing.get_context("spawn")
    with ExitStack() as stack:
        homes = [
            stack.enter_context(ProcessPoolExecutor(1, context, _settle, (begin,))) for _ in range(workers)
        ]
        yield ProcessCrew(homes)


_here: list[LocalCrew] = []
"""The crew of this process, where it is one of a `ProcessCrew`."""


def _settle(begin: Callable[[str], Analysis]) -> None:
    """Be told how analyses begin."""
    # Whoever simulates meanwhile goes first: a GPU must not wait for a core.
    if sys.platform != "win32":
        os.nice(POLITE)
    end_with_parent()
    _here.append(LocalCrew(begin))


def _take(answers: Answers) -> dict[str, Step]:
    """Take every named analysis to its next wave."""
    _here[0].send(answers)
    return _here[0].collect()


@dataclass(frozen=True)
class Round:
    """One turn of a shift of analyses."""

    number: int
    ended: dict[str, Discovery | Crash]
    """Analyses that ended before this round's cases."""
    running: int
    """Analyses of the shift that want cases."""
    cases: int
    """Cases of their waves, all in one call."""

    @classmethod
    def of(cls, number: int, steps: Mapping[str, Step]) -> Round:
        """Count what the analyses of a shift said."""
        ended = {name: step for name, step in steps.items() if not isinstance(step, list)}
        return cls(number, ended, len(steps) - len(ended), sum(map(len, _waves(steps).values())))


def in_step(names: Sequence[str], crew: LocalCrew | ProcessCrew, simulator: Simulator) -> Iterator[Round]:
    """Run analyses round by round until all have ended.

    A round is yielded before its cases run, so that whoever iterates may stop there; the simulator keeps what
    it has run, and the same analyses then come to the same point again. Where the simulator raises, what the
    other shift has found by then is yielded first.
    """
    answers: Answers = dict.fromkeys(names[0::2])
    waiting: Answers = dict.fromkeys(names[1::2])
    number = 0
    crew.send(answers)
    while answers:
        steps, number = crew.collect(), number + 1
        yield Round.of(number, steps)
        crew.send(waiting)
        try:
            waves = _waves(steps)
            answers = dict(zip(waves, dealt(waves.values(), simulator), strict=True))
        except BaseException:
            yield Round.of(number + 1, crew.collect())
            raise
        if waiting:
            answers, waiting = waiting, answers
        else:
            crew.send(answers)


def _waves(steps: Mapping[str, Step]) -> dict[str, list[Point]]:
    return {name: step for name, step in steps.items() if isinstance(step, list)}


def dealt(waves: Collection[list[Point]], simulator: Simulator) -> list[Outcomes]:
    """Run waves in one call, and give each its part of the outcomes."""
    if not waves:
        return []
    outcomes = simulator([point for wave in waves for point in wave])
    ends = list(accumulate(map(len, waves), initial=0))
    return [Outcomes(outcomes.values[a:b], outcomes.reasons[a:b]) for a, b in pairwise(ends)]
