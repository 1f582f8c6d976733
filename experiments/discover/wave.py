"""Waves of cases: simulated in as few launches as possible, measured beside, kept as they come."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from functools import cached_property, partial
from multiprocessing.queues import Queue
from pathlib import Path

from dem_warp import Case, CaseResult, Progress, simulate
from dem_warp.batch import Onlooker
from dem_warp.device import resolve_device
from dem_warp.processes import end_with_parent
from dem_warp.simulation import batches
from experiments.cases import Engine
from experiments.cases.engine import NO_ANSWER
from experiments.discover.devices import resolve_devices
from experiments.discover.outcome_table import Outcome, OutcomeTable
from experiments.measurement.observables import NAMES
from experiments.measurement.states import measure
from experiments.studyfile.study import MeasurementSection

WORLDS = 1024
"""Worlds that one launch on a GPU holds: enough to fill it, few enough that a killed run loses little."""

DRIVERS = 4
"""Launches at once on each GPU, each driven by a process of its own: while one's controllers decide on the
host, the GPU works for the others."""

_CONTEXT = multiprocessing.get_context("spawn")
"""Start of processes: a process with a GPU must not be forked. They end with this one."""

_mine: list[str] = []
"""The device of this process, where it drives one."""

SAVE_EVERY = 5.0
"""Time between two savings of what has been measured [s]."""


class WaveRunner:
    """Simulates and measures waves of cases; its processes stay for the next wave until it is closed.

    Parameters
    ----------
    settings
        How pictures are taken and read.
    table
        Where outcomes are kept.
    device
        One, or several GPUs, as `resolve_devices` reads them.
    workers
        Processes that simulate, on the CPU, and that measure; None: one a core.
    worlds
        Worlds of one launch; None: `WORLDS` on a GPU, and on the CPU all: a launch there spreads them over
        its cores.
    drivers
        Launches at once; None: `DRIVERS` on each GPU, one on the CPU.
    progress
        Called with the progress of a wave.
    engine
        Simulates in the place of dem-warp; a wave is then one call. What it has finished lies in a folder
        beside the table until the wave is kept.
    observables
        Names of what is measured.
    onlooker
        That of `dem_warp.simulate`, in every process that simulates.
    """

    def __init__(
        self,
        settings: MeasurementSection,
        table: OutcomeTable,
        device: str | None = None,
        workers: int | None = None,
        worlds: int | None = None,
        drivers: int | None = None,
        progress: Callable[[Progress], None] | None = None,
        engine: Engine | None = None,
        observables: Sequence[str] = NAMES,
        onlooker: Onlooker | None = None,
    ) -> None:
        self._settings, self._table, self._progress = settings, table, progress
        self._engine, self._observables, self._onlooker = engine, tuple(observables), onlooker
        self._devices = resolve_devices(device)
        self._workers, self._worlds = workers, worlds
        count = drivers or (1 if self._on_cpu else DRIVERS * len(self._devices))
        count = count if engine is None else 1
        self.drivers = [self._devices[number % len(self._devices)] for number in range(count)]
        """Device of each process that drives launches."""

    def close(self) -> None:
        """End its processes."""
        for name in ("_measurers", "_driven"):
            if pool := self.__dict__.pop(name, None):
                pool.shutdown(cancel_futures=True)

    def expect(self, count: int) -> None:
        """Begin the processes that drive launches if so many cases need several, and do not wait for them."""
        if not self._drives and len(self.drivers) > 1 and count > (self._worlds or WORLDS):
            for _ in self.drivers:
                self._driven.submit(_open_device)

    def heaps(self, cases: Sequence[Case]) -> list[CaseResult]:
        """Simulate a few cases, measure nothing and keep nothing."""
        if self._drives:
            return [result for (result,) in self._driven.map(_simulate_here, [[case] for case in cases])]
        return (self._engine or simulate)(cases, device=self._devices[0], workers=self._workers)

    def run(self, cases: Mapping[str, Case]) -> dict[str, Outcome]:
        """Simulate and measure cases by their keys in the table, and keep the outcomes."""
        if not cases:
            return {}
        measured = _Measured(self._table)
        clock = _Clock(len(cases), self._progress)
        launches = self._launches(cases)
        several = min(len(launches), len(self.drivers)) > 1
        launch_all = self._drive if several or self._drives else self._launch
        if self._engine is not None:
            launch_all = self._call_engine
        try:
            launch_all(launches, cases, measured, clock)
            found = measured.finish()
            shutil.rmtree(self._unfinished, ignore_errors=True)
            return found
        except BaseException:
            self.close()
            raise
        finally:
            measured.keep()

    @cached_property
    def _measurers(self) -> ProcessPoolExecutor:
        # Processes, as measuring holds Python's lock.
        return ProcessPoolExecutor(self._workers or os.cpu_count(), _CONTEXT, _begin_measuring)

    @cached_property
    def _driven(self) -> ProcessPoolExecutor:
        devices = _CONTEXT.Queue()
        for device in self.drivers:
            devices.put(device)
        return ProcessPoolExecutor(len(self.drivers), _CONTEXT, _begin_driving, (devices,))

    @property
    def _drives(self) -> bool:
        """True if processes drive launches already: then this one needs no context on a GPU."""
        return "_driven" in self.__dict__

    @property
    def _on_cpu(self) -> bool:
        return self._devices[0] == "cpu"

    def _launches(self, cases: Mapping[str, Case]) -> list[list[str]]:
        """Keys of the cases of each launch: all, or such as share what kernels are compiled for.

        The small ones come last, so that no driver is left alone with a large one.
        """
        keys = list(cases)
        if self._engine is not None or (self._on_cpu and self._worlds is None):
            return [keys]
        worlds = self._worlds or WORLDS
        launches = [
            [keys[i] for i in group[start : start + worlds]]
            for group in batches(list(cases.values()), one_each=False)
            for start in range(0, len(group), worlds)
        ]
        return sorted(launches, key=len, reverse=True)

    def _launch(
        self, launches: Sequence[list[str]], cases: Mapping[str, Case], measured: _Measured, clock: _Clock
    ) -> None:
        """Simulate launch after launch in this process."""
        for keys in launches:
            simulate(
                [cases[key] for key in keys],
                device=self._devices[0],
                workers=self._workers,
                on_result=partial(self._take, measured, keys),
                on_progress=partial(clock.report, len(keys)),
                onlooker=self._onlooker,
            )
            clock.pass_launch(len(keys))

    def _drive(
        self, launches: Sequence[list[str]], cases: Mapping[str, Case], measured: _Measured, clock: _Clock
    ) -> None:
        """Simulate several launches at once, each in a process."""
        begun = {
            self._driven.submit(_simulate_here, [cases[key] for key in keys], self._onlooker): keys
            for keys in launches
        }
        for ended in as_completed(begun):
            keys = begun[ended]
            for index, result in enumerate(ended.result()):
                self._take(measured, keys, index, result)
            clock.pass_launch(len(keys))

    def _call_engine(
        self, launches: Sequence[list[str]], cases: Mapping[str, Case], measured: _Measured, clock: _Clock
    ) -> None:
        """Let another engine simulate all cases."""
        [keys], engine = launches, self._engine or simulate
        engine(
            [cases[key] for key in keys],
            device=self._devices[0],
            workers=self._workers,
            on_result=partial(self._take, measured, keys),
            on_progress=partial(clock.report, len(keys)),
            checkpoint=self._unfinished,
        )
        clock.pass_launch(len(keys))

    @property
    def _unfinished(self) -> Path:
        """Folder of what an engine has under way."""
        return self._table.path.with_name("unfinished")

    def _take(self, measured: _Measured, keys: Sequence[str], index: int, result: CaseResult) -> None:
        outcome = self._measurers.submit(measure, self._settings, result, self._observables)
        measured.add(keys[index], outcome, keep=result.status != NO_ANSWER)


def _begin_measuring() -> None:
    """Measure on one thread: there is a process for every core."""
    from threadpoolctl import threadpool_limits

    end_with_parent()
    threadpool_limits(1, "blas")


def _begin_driving(devices: Queue[str]) -> None:
    """Take a device, for good: a process that changes between two would hold memory on both."""
    end_with_parent()
    _mine.append(devices.get())


def _open_device() -> None:
    """Start what the first launch would start."""
    resolve_device(_mine[0])


def _simulate_here(cases: Sequence[Case], onlooker: Onlooker | None = None) -> list[CaseResult]:
    """Simulate on the device of this process."""
    return simulate(cases, _mine[0], 1, onlooker=onlooker)


@dataclass
class _Clock:
    """Progress of all launches of a call, from that of each."""

    total: int
    listener: Callable[[Progress], None] | None
    done: int = 0
    started: float = field(default_factory=time.perf_counter)

    def report(self, count: int, progress: Progress) -> None:
        """Tell how far a launch of some cases is."""
        done, fraction = self.done + progress.done, (self.done + progress.fraction * count) / self.total
        self._tell(done, fraction, progress.phase_counts)

    def pass_launch(self, count: int) -> None:
        """Tell that a launch of some cases has ended."""
        self.done += count
        self._tell(self.done, self.done / self.total, {})

    def _tell(self, done: int, fraction: float, phases: dict[str, int]) -> None:
        if self.listener:
            seconds = time.perf_counter() - self.started
            self.listener(Progress(done, self.total, fraction, phases, seconds))


class _Measured:
    """Outcomes as they come from the measuring processes; what has come is kept now and then."""

    def __init__(self, table: OutcomeTable) -> None:
        self._table = table
        self._waiting: dict[str, Future[Outcome]] = {}
        self._outcomes: dict[str, Outcome] = {}
        self._passing: set[str] = set()
        self._saved = time.monotonic()

    def add(self, key: str, outcome: Future[Outcome], keep: bool = True) -> None:
        """Await an outcome; one that is not to be kept is tried again by the next run."""
        self._waiting[key] = outcome
        if not keep:
            self._passing.add(key)
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
        if lasting := {key: outcome for key, outcome in fresh.items() if key not in self._passing}:
            self._table.save(lasting)
        self._outcomes |= fresh
        self._saved = time.monotonic()

    def _keep_in_time(self) -> None:
        if time.monotonic() - self._saved > SAVE_EVERY:
            self.keep()


def _is_measured(outcome: Future[Outcome]) -> bool:
    return outcome.done() and not outcome.cancelled() and outcome.exception() is None
