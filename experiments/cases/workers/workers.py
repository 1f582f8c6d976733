"""The interface of workers."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import BrokenExecutor
from pathlib import Path
from typing import Any, Protocol

from dem_warp import Case, CaseResult
from dem_warp.result import OnProgress, OnResult
from experiments.cases.engines.engine import Engine


class WorkersLostError(BrokenExecutor):
    """Workers were lost and their cases with them; what had finished was handed on."""


class Workers(Protocol):
    """Simulates cases, one call after another."""

    @property
    def count(self) -> int:
        """Cases or launches at once."""

    @property
    def on_gpu(self) -> bool:
        """True if they have GPUs, each one or a share of it."""

    @property
    def sharing(self) -> int:
        """Workers of a GPU; 1 on CPUs."""

    @property
    def machine(self) -> str:
        """Name under which their speed is stored."""

    @property
    def helpers(self) -> int:
        """Processes of this machine that may measure at the same time."""

    @property
    def leaves_cores(self) -> bool:
        """True if the cores of this machine are free for measuring."""

    @property
    def described(self) -> dict[str, Any]:
        """Device and number, for the provenance of results, as JSON-able data."""

    def simulate(
        self,
        cases: Sequence[Case],
        engine: Engine | None = None,
        on_result: OnResult | None = None,
        on_progress: OnProgress | None = None,
        checkpoint: str | Path | None = None,
    ) -> list[CaseResult]:
        """Simulate cases with an engine, None for dem-warp's own; results in their order.

        Each is handed to ``on_result`` with its index as it ends. A case that raises, or that the device has
        no memory for, ends with the status `NO_ANSWER` and its reason; the others go on.

        Raise WorkersLostError when workers are lost repeatedly.
        """
