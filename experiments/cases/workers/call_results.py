"""Results and progress of one call of workers, collected from its batches."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Real

import numpy as np

from dem_warp import MECHANISMS, Case, CaseResult, Progress
from dem_warp.result import OnProgress, OnResult
from experiments.cases.engines.engine import Engine
from experiments.cases.engines.program import empty_result
from experiments.cases.workers.batches import relative_work
from experiments.io.errors import InputError
from experiments.io.plug_ins import made_in, outside


@dataclass(frozen=True)
class ExpectedProgress(Progress):
    """Progress of a call, with the wall time that was predicted."""

    expected: float | None = None
    """Wall time of the call, predicted before it began [s]; None if it could not be."""


def checked_result(case: Case, result: CaseResult, engine: Engine | None = None) -> CaseResult:
    """Return a result, failed where its scene or its engine gave something that it cannot have.

    Raise InputError for what is not a result.
    """
    if not isinstance(result, CaseResult):
        problem = f"{outside(engine)} must hand on a dem_warp.CaseResult for each case".lstrip()
        raise InputError("engine", problem, result)
    given = result.observables.items()
    finite = {name: value for name, value in given if isinstance(value, Real) and math.isfinite(value)}
    wrong = [f"{name} = {value}" for name, value in given if name not in finite]
    if not (shapes := _wrong_shapes(result)) and not np.isfinite(result.positions).all():
        wrong.append("positions that are not finite")
    if result.status != "finished" or not (wrong or shapes):
        return result
    # a name takes a second to find, which results in order do not need
    source = outside(engine) or result.provenance.get("engine") or made_in(type(case.scene))
    reason = f"{source} returned {', '.join(wrong + shapes)}"
    if shapes:
        return empty_result("failed", reason, result.provenance)
    return replace(result, status="failed", reason=reason, observables=finite)


def _wrong_shapes(result: CaseResult) -> list[str]:
    """Name the arrays of a result that have not a row for each grain."""
    rows = {"positions": (3,), "orientations": (4,), "sizes": (), "shapes": ()}
    found = {name: np.shape(getattr(result, name)) for name in rows}
    count = found["positions"][:1]
    return [f"{name} of shape {found[name]}" for name, row in rows.items() if found[name] != (*count, *row)]


def require_entries(cases: Sequence[Case]) -> None:
    """Raise InputError for a contact law that the engine does not know, as it is no entry point."""
    for kind in dict.fromkeys(type(mechanism) for case in cases for mechanism in case.mechanisms):
        if MECHANISMS.get(kind.name) is not kind:
            problem = f"{made_in(kind)} must be an entry point of dem_warp.laws in an installed package"
            raise InputError(f"contact law {kind.name}", problem)


class CallResults:
    """Results and progress of a call, collected from its batches.

    Parameters
    ----------
    cases
        All cases of the call.
    on_result, on_progress
        See `Workers.simulate`; their errors end the call.
    expected
        Predicted wall time of all [s].
    at_once
        Cases that run at the same time: the pace counts from when that many have begun, after every worker's
        start and compilation.
    engine
        Engine that answers, for messages; None: dem-warp's own.
    """

    def __init__(
        self,
        cases: Sequence[Case],
        on_result: OnResult | None,
        on_progress: OnProgress | None,
        expected: float | None = None,
        at_once: int = 1,
        engine: Engine | None = None,
    ) -> None:
        require_entries(cases)
        self._cases, self._engine = cases, engine
        self.costs = relative_work(cases)
        """Predicted work of each case, (n,)."""
        self.results: dict[int, CaseResult] = {}
        self.fault: BaseException | None = None
        """Error of the caller's functions."""
        self._on_result, self._on_progress, self._expected = on_result, on_progress, expected
        self._at_once = min(at_once, len(cases))
        self._started = time.perf_counter()
        self._fractions = np.zeros(len(cases))
        self._phases: dict[int, Mapping[str, int]] = {}
        self._begun: tuple[float, float] | None = None

    @property
    def is_complete(self) -> bool:
        """True if every case has given its result."""
        return len(self.results) == len(self.costs)

    @property
    def pace(self) -> tuple[float, float]:
        """Part of the work that was done since the first progress, and the time it took [s].

        The part is 0 where more than one case of ten failed: such cases end early.
        """
        part, begun = self._begun or (1.0, time.perf_counter())
        failed = sum(result.status != "finished" for result in self.results.values())
        done = self._fraction - part if 10 * failed <= len(self.results) else 0.0
        return done, time.perf_counter() - begun

    @property
    def _fraction(self) -> float:
        return 1.0 if self.is_complete else float(self.costs @ self._fractions / self.costs.sum())

    @property
    def _under_way(self) -> int:
        """Cases that have ended, or have begun."""
        running = Counter[str]()
        for counts in self._phases.values():
            running.update(counts)
        return len(self.results) + running.total() - running["waiting"]

    def outside(self, index: int) -> str:
        """Name the engine or the scene of a case, with its place, if it is of another package; else empty."""
        return outside(self._engine) if self._engine else outside(type(self._cases[index].scene))

    def left(self, members: Sequence[int]) -> list[int]:
        """Return the members of a batch that have given no result yet."""
        return [index for index in members if index not in self.results]

    def take(self, index: int, result: CaseResult) -> None:
        """Take the result of a case, and hand it on."""
        if index in self.results:
            return
        result = checked_result(self._cases[index], result, self._engine)
        self.results[index] = result
        self._fractions[index] = 1.0
        if self._on_result is not None:
            self._call(self._on_result, index, result)

    def take_all(self, members: Sequence[int], results: object) -> None:
        """Take what an engine returned for the members of a batch; InputError for another number."""
        if not isinstance(results, list) or len(results) != len(members):
            rule = f"{outside(self._engine)} must return a list of {len(members)} results".lstrip()
            raise InputError("engine", rule, results)
        for index, result in zip(members, results, strict=True):
            self.take(index, result)

    def follow(self, batch: int, members: Sequence[int], progress: Progress) -> None:
        """Take the progress of some members of a batch, and report that of all."""
        if left := self.left(members):
            ended = len(members) - len(left)
            self._fractions[left] = np.clip((progress.fraction * len(members) - ended) / len(left), 0.0, 1.0)
        self._phases[batch] = progress.phase_counts
        if self._begun is None and self._fraction > 0.0 and self._under_way >= self._at_once:
            self._begun = (self._fraction, time.perf_counter())
        self.report()

    def end(self, batch: int) -> None:
        """Note that a batch has ended, and report the progress of all."""
        self._phases.pop(batch, None)
        self.report()

    def report(self) -> None:
        """Report the progress of all."""
        if self._on_progress is None:
            return
        done, total = len(self.results), len(self.costs)
        phases: Counter[str] = Counter()
        for counts in self._phases.values():
            phases.update(counts)
        if (waiting := total - done - phases.total()) > 0:
            phases["waiting"] += waiting
        seconds = time.perf_counter() - self._started
        progress = ExpectedProgress(done, total, self._fraction, dict(phases), seconds, self._expected)
        self._call(self._on_progress, progress)

    def in_order(self) -> list[CaseResult]:
        """Return the results of all cases."""
        return [self.results[index] for index in range(len(self.costs))]

    def _call(self, function: Callable[..., None], *arguments: object) -> None:
        try:
            function(*arguments)
        except BaseException as error:
            self.fault = error
            raise
