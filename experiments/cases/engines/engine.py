"""The interface of an engine, which turns cases into results in place of `dem_warp.simulate`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from dem_warp import Case, CaseResult
from dem_warp.result import OnProgress, OnResult

NO_ANSWER = "no-answer"
"""Status of a case whose program failed or gave no valid answer: it is not kept, and may be repeated."""


class Engine(Protocol):
    """A function of cases, like `dem_warp.simulate`.

    An engine whose results depend on more than its code has that as ``identity``, JSON-able data; one that
    gives only some observables of a scene has their names as ``observables``; and one that cannot simulate
    every case has a method ``check``, which raises ValueError for those that it cannot.
    """

    def __call__(
        self,
        cases: Sequence[Case],
        device: str | None = None,
        workers: int | None = None,
        on_result: OnResult | None = None,
        on_progress: OnProgress | None = None,
        checkpoint: str | Path | None = None,
    ) -> list[CaseResult]:
        """Simulate cases; results in their order, each handed to `on_result` with its index as it ends."""
