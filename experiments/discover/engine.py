"""The engine as a simulator: points in, simulated all at once, measured, kept; observables out."""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial

import numpy as np

from dem_warp import Case, CaseResult, Progress, simulate
from dem_warp.device import resolve_device
from dem_warp.processes import end_with_parent
from dem_warp.provenance import engine_fingerprint
from dem_warp.simulation import batches
from experiments.discover.library import Mechanism, with_mechanisms
from experiments.discover.observables import NAMES, VERSION, measure
from experiments.discover.outcome_table import Outcome, OutcomeTable
from experiments.discover.simulator import Outcomes, Point
from experiments.errors import StudyError
from experiments.study import Study

WORLDS = 1024
"""Worlds that a GPU runs at once: enough to fill it, few enough that a killed run loses little."""

SAVE_EVERY = 5.0
"""Time between two savings of what has been measured [s]."""


class EngineSimulator:
    """Answers points of a study with the observables of simulated heaps.

    All points of a call are simulated in as few launches as possible; they are measured in processes of their
    own while the next are simulated, and kept. A point whose case a study refuses has that as its reason.

    Use it as a context, or call `close`, to end the measuring processes.

    Parameters
    ----------
    study
        The study with its conditions.
    library
        Mechanisms that points may name, from its `library_for`.
    table
        Where outcomes are kept; what is there already is not simulated again.
    device
        ``"cpu"``, ``"cuda"``, ``"cuda:1"``; None: the engine's choice.
    workers
        Processes that simulate, on the CPU, and that measure; None: one a core.
    worlds
        Worlds that a GPU runs at once.
    progress
        Called with the progress of all points of a call that are not kept yet.
    """

    observables = NAMES

    def __init__(
        self,
        study: Study,
        library: Sequence[Mechanism],
        table: OutcomeTable,
        device: str | None = None,
        workers: int | None = None,
        worlds: int = WORLDS,
        progress: Callable[[Progress], None] | None = None,
    ) -> None:
        self.study, self.table, self.workers, self.worlds = study, table, workers, worlds
        self._device, self._progress = device, progress
        self._library = {mechanism.name: mechanism for mechanism in library}
        self._factors = [factor.name for factor in study.factors]
        self._conditions = [condition.name for condition in study.conditions]
        self._extended = lru_cache(maxsize=None)(self._extend)

    def __enter__(self) -> EngineSimulator:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the measuring processes."""
        if "_pool" in self.__dict__:
            self._pool.shutdown(cancel_futures=True)
            del self.__dict__["_pool"]

    def __call__(self, points: Sequence[Point]) -> Outcomes:
        """Observables of every point, in order.

        Raises
        ------
        ValueError
            When a point names an unknown mechanism or condition, or has not one value for every factor.
        """
        cases: dict[str, Case] = {}
        keys, refused = [], {}
        for point in points:
            try:
                case = self.case(point)
                keys.append(self.key(case))
                cases[keys[-1]] = case
            except StudyError as error:
                keys.append(f"refused: {error}")
                refused[keys[-1]] = (np.full(len(NAMES), np.nan), error.rule)
        found = self.table.load(list(cases)) | refused
        found |= self._simulate({key: case for key, case in cases.items() if key not in found})
        values = np.array([found[key][0] for key in keys]).reshape(len(keys), len(NAMES))
        return Outcomes(values, tuple(found[key][1] for key in keys))

    def case(self, point: Point) -> Case:
        """Build the case of a point.

        Raises
        ------
        StudyError
            When the study refuses it: a value leaves what is physical, or two mechanisms exclude each other.
        ValueError
            When the point does not fit the study.
        """
        if len(point.theta) != len(self._factors):
            rule = f"Point.theta: must be one value for each of {', '.join(self._factors)}"
            raise ValueError(f"{rule}, got {point.theta!r}")
        if unknown := [name for name, _ in point.sizes if name not in self._library]:
            raise ValueError(f"Point.sizes: must name mechanisms of the library, got {', '.join(unknown)}")
        if point.condition not in self._conditions:
            rule = f"Point.condition: must be one of {', '.join(self._conditions)}"
            raise ValueError(f"{rule}, got {point.condition!r}")
        study = self._extended(tuple(name for name, _ in point.sizes), point.condition)
        settings = dict(zip(self._factors, point.theta, strict=True)) | dict(point.sizes)
        return study.case(settings, point.seed)

    def key(self, case: Case) -> str:
        """Key of a case: a hash of all that determines its observables, the engine's own code included."""
        determined_by = {
            "case": case.to_dict(),
            "engine": engine_fingerprint(),
            "measurement": self.study.measurement.model_dump(),
            "observables": VERSION,
        }
        text = json.dumps(determined_by, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()

    def _extend(self, names: tuple[str, ...], condition: str) -> Study:
        mechanisms = [self._library[name] for name in names]
        return with_mechanisms(self.study, mechanisms).under(condition)

    # ---- simulating and measuring --------------------------------------------------------------------------

    @cached_property
    def _pool(self) -> ProcessPoolExecutor:
        # Processes, as measuring holds Python's lock; spawned, as a process with a GPU must not be forked.
        context = multiprocessing.get_context("spawn")
        count = self.workers or os.cpu_count()
        return ProcessPoolExecutor(count, context, end_with_parent)

    def _simulate(self, cases: Mapping[str, Case]) -> dict[str, Outcome]:
        """Simulate and measure cases, and keep the outcomes."""
        measured = _Measured(self.table)
        clock = _Clock(len(cases), self._progress)
        try:
            for keys in self._launches(cases):
                simulate(
                    [cases[key] for key in keys],
                    device=self._device,
                    workers=self.workers,
                    on_result=partial(self._take, measured, keys),
                    on_progress=partial(clock.report, len(keys)),
                )
                clock.done += len(keys)
            return measured.finish()
        except BaseException:
            self.close()
            raise
        finally:
            measured.keep()

    def _launches(self, cases: Mapping[str, Case]) -> Iterator[list[str]]:
        """Keys of the cases that run at once; on a CPU all of them, which then are spread over its cores."""
        keys = list(cases)
        if not keys:
            return
        if resolve_device(self._device) == "cpu":
            yield keys
            return
        for members in batches(list(cases.values()), one_each=False):
            for start in range(0, len(members), self.worlds):
                yield [keys[i] for i in members[start : start + self.worlds]]

    def _take(self, measured: _Measured, keys: Sequence[str], index: int, result: CaseResult) -> None:
        measured.add(keys[index], self._pool.submit(measure, self.study.measurement, result))


@dataclass
class _Clock:
    """Progress of all launches of a call, from that of each."""

    total: int
    listener: Callable[[Progress], None] | None
    done: int = 0
    started: float = field(default_factory=time.perf_counter)

    def report(self, count: int, progress: Progress) -> None:
        if self.listener is None:
            return
        whole = replace(
            progress,
            done=self.done + progress.done,
            total=self.total,
            fraction=(self.done + progress.fraction * count) / self.total,
            seconds=time.perf_counter() - self.started,
        )
        self.listener(whole)


class _Measured:
    """Outcomes as they come from the measuring processes; what has come is kept now and then."""

    def __init__(self, table: OutcomeTable) -> None:
        self._table = table
        self._waiting: dict[str, Future[Outcome]] = {}
        self._outcomes: dict[str, Outcome] = {}
        self._saved = time.monotonic()

    def add(self, key: str, outcome: Future[Outcome]) -> None:
        """Await an outcome."""
        self._waiting[key] = outcome
        self._keep_in_time()

    def finish(self) -> dict[str, Outcome]:
        """Wait for all, and return them."""
        for outcome in list(self._waiting.values()):
            outcome.result()
            self._keep_in_time()
        self.keep()
        return self._outcomes

    def keep(self) -> None:
        """Save what has been measured since."""
        ready = [key for key, outcome in self._waiting.items() if _is_measured(outcome)]
        fresh = {key: self._waiting.pop(key).result() for key in ready}
        if fresh:
            self._table.save(fresh)
            self._outcomes |= fresh
        self._saved = time.monotonic()

    def _keep_in_time(self) -> None:
        if time.monotonic() - self._saved > SAVE_EVERY:
            self.keep()


def _is_measured(outcome: Future[Outcome]) -> bool:
    return outcome.done() and not outcome.cancelled() and outcome.exception() is None
