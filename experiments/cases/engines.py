"""Engines from outside: whatever turns cases into results in place of `dem_warp.simulate`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from dem_warp import Case, CaseResult
from dem_warp.registry import Registry
from dem_warp.result import OnProgress, OnResult
from experiments.errors import InputError


class Engine(Protocol):
    """A function of cases, as `dem_warp.simulate` is one."""

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


def _check(name: str, engine: object, known: object) -> None:
    if not callable(engine):
        raise TypeError(f"must be a function of cases, got {engine!r}")


ENGINES: Registry[Engine] = Registry("dem_warp.engines", {}, _check)
"""Engines of installed packages, by name."""


def engine_named(name: str | None) -> Engine | None:
    """Find an engine by its name; None is that of dem-warp.

    Raises
    ------
    InputError
        When no installed package has one of this name.
    """
    if name is None:
        return None
    if name not in ENGINES:
        known = ", ".join(ENGINES) or "none, no package adds any"
        raise InputError(f"must be one of {known}", name, "engine")
    return ENGINES[name]
