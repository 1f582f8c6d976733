"""Several GPUs as one simulator: a process for each, which take the points in turns."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import AbstractContextManager
from functools import partial
from multiprocessing.queues import Queue

import numpy as np

from dem_warp.processes import end_with_parent
from experiments.discover.engine import EngineSimulator
from experiments.discover.library import Mechanism
from experiments.discover.observables import NAMES
from experiments.discover.outcome_table import OutcomeTable
from experiments.discover.simulator import Outcomes, Point
from experiments.discover.wave import WORLDS
from experiments.study import Study

Make = Callable[[str], EngineSimulator]
"""Makes the simulator of a device, in the process that it is for."""

_engines: list[EngineSimulator] = []
"""The simulator of this process, where it is one of a fleet's."""


class Fleet:
    """Answers points with the engine on several devices; all of them keep outcomes in one table.

    Use it as a context, or call `close`, to end the processes.

    Parameters
    ----------
    devices
        As ``("cuda:0", "cuda:1")``.
    make
        Makes the simulator of a device; must be picklable.
    share
        Points that a device takes at a time.
    """

    observables = NAMES

    def __init__(self, devices: Sequence[str], make: Make, share: int = WORLDS) -> None:
        # Spawned: a CUDA context does not survive a fork.
        context = multiprocessing.get_context("spawn")
        names: Queue[str] = context.Queue()
        for name in devices:
            names.put(name)
        self._pool = ProcessPoolExecutor(len(devices), context, _man, (names, make))
        self._share = share

    def __enter__(self) -> Fleet:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the processes."""
        self._pool.shutdown(cancel_futures=True)

    def __call__(self, points: Sequence[Point]) -> Outcomes:
        """Observables of every point, in order; points with the same mechanisms run together."""
        order = sorted(range(len(points)), key=lambda i: tuple(name for name, _ in points[i].sizes))
        shares = [order[start : start + self._share] for start in range(0, len(order), self._share)]
        values = np.full((len(points), len(NAMES)), np.nan)
        reasons = [""] * len(points)
        answers = self._pool.map(_answer, [[points[i] for i in share] for share in shares])
        for share, outcomes in zip(shares, answers, strict=True):
            values[share] = outcomes.values
            for i, reason in zip(share, outcomes.reasons, strict=True):
                reasons[i] = reason
        return Outcomes(values, tuple(reasons))


def engine_on(
    device: str | None,
    study: Study,
    library: Sequence[Mechanism],
    table: OutcomeTable,
    workers: int | None = None,
) -> AbstractContextManager[EngineSimulator | Fleet]:
    """The engine on a device, or on several, as ``"cuda:0,cuda:1"``.

    Parameters
    ----------
    device
        None: the engine's choice.
    study, library, table
        See `EngineSimulator`.
    workers
        Processes that measure, in all; None: one a core.
    """
    names = (device or "").split(",")
    if len(names) == 1:
        return EngineSimulator(study, library, table, device, workers)
    each = max((workers or os.cpu_count() or 1) // len(names), 1)
    return Fleet(names, partial(_engine, study, library, table, each))


def _engine(
    study: Study, library: Sequence[Mechanism], table: OutcomeTable, workers: int, device: str
) -> EngineSimulator:
    return EngineSimulator(study, library, table, device, workers)


def _man(names: Queue[str], make: Make) -> None:
    end_with_parent()
    _engines.append(make(names.get()))


def _answer(points: Sequence[Point]) -> Outcomes:
    return _engines[0](points)
