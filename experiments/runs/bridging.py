"""A bridge in a folder: a few runs of another solver correct a card, fresh ones verify it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from experiments.bridge.crossing import check_order, cross
from experiments.bridge.result import BridgeOutcome, Crossing
from experiments.bridge.source import Source, read_source
from experiments.cases import with_engine
from experiments.io.errors import InputError
from experiments.report.corrected_card import write_crossing
from experiments.report.material_card import CARD
from experiments.runs.choices import Prepared, prepare
from experiments.runs.request import RunRequest
from experiments.runs.run_folder import open_run
from experiments.studyfile.campaign import Response


@dataclass(frozen=True, kw_only=True)
class BridgeOrder:
    """Runs of a bridge in another solver."""

    command: str | None = None
    """Command of the solver, a program that keeps the folder contract; None: the engine that is named."""
    runs: int = 12
    """Runs that the correction is made from."""
    fresh: int = 5
    """Runs that verify it."""
    margin: float | None = None
    """Difference from the target that does not matter, in the response's unit; None: 0.5 degrees."""
    seed: int = 1
    """Root of the seeds of all runs."""
    time_limit: str | None = None
    """Wall time of a run with its unit, e.g. ``"10 min"``; None: no limit."""
    approximate: bool = False
    """Take the nearest for what the other code lacks."""


@dataclass(frozen=True)
class Bridge:
    """A bridge that has ended."""

    folder: Path
    """Folder of everything that it wrote."""
    crossing: Crossing
    """Shift, scale, the corrected point, and what fresh runs gave."""

    def __str__(self) -> str:
        return f"{self.crossing.reason} {self.card or self.folder}"

    @property
    def card(self) -> Path | None:
        """The corrected card; None where no point was found."""
        return self.folder / CARD if self.crossing.point is not None else None

    @property
    def failed(self) -> bool:
        """True if too many runs failed for a result."""
        return self.crossing.outcome is BridgeOutcome.TOO_MANY_FAILED_RUNS

    def to_dict(self) -> dict[str, Any]:
        """Everything that was found as JSON-able data."""
        return self.crossing.to_dict()


@dataclass(frozen=True)
class PreparedBridge:
    """A bridge that can begin."""

    source: Source
    margin: float
    order: BridgeOrder
    run: Prepared


def prepare_bridge(card: str | Path, request: RunRequest, order: BridgeOrder) -> PreparedBridge:
    """Read the card of a bridge, check its numbers, and choose solver, workers and folder.

    Raise InputError when card, engine or numbers break a rule.
    """
    source = read_source(Path(card))
    margin = check_order(source, order.runs, order.fresh, order.margin)
    if request.engine is None and order.command is None:
        raise InputError("engine", "a bridge needs another solver", hint="Add --engine NAME or --command.")
    limits = {"time_limit": order.time_limit, "approximate": order.approximate or None}
    study = with_engine(source.study, request.engine, order.command, **limits)
    return PreparedBridge(source, margin, order, prepare(study, replace(request, engine=None), what="bridge"))


def run_bridge(prepared: PreparedBridge) -> Bridge:
    """Correct a card for another solver, and write the corrected card.

    Raise InputError when the folder cannot be used; nothing is written then.
    """
    order, source = prepared.order, prepared.source
    matched = Response(source.response, source.observable, source.unit)
    with open_run("bridge", prepared.run) as run:
        program = getattr(run.store.engine, "program", None)
        engine = run.study.engine and run.study.engine.name
        name = engine or str(getattr(program, "name", order.command or "a program by hand"))
        runner = partial(run.run_cases, asked_for=(matched,))
        crossing = cross(source, runner, name, order.runs, order.fresh, prepared.margin, order.seed)
        with run.publishing() as drafts:
            write_crossing(crossing, drafts)
    return Bridge(run.folder, crossing)
