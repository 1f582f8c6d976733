"""Entries of a journal as the page reads them; invalid entries are ignored."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

Value = str | int | float | bool | None
"""Values that a note may hold."""


class Note(BaseModel):
    """Base of every note; unknown keys are ignored."""

    model_config = ConfigDict(extra="ignore", strict=True, frozen=True, allow_inf_nan=False)


AnyNote = TypeVar("AnyNote", bound=Note)


class FactorNote(Note):
    """A factor of the study."""

    name: str
    unit: str = "1"


class SampleNote(Note):
    """Mean and scatter of what was measured, or simulated for a twin."""

    mean: float
    sd: float


class ResponseNote(Note):
    """A number that is to be matched."""

    name: str
    observable: str
    unit: str = "1"
    measured: SampleNote | None = None


class RunNote(Note):
    """The run: its command and its study."""

    command: str = ""
    study: str = ""
    scale: str | None = None
    device: str | None = None
    factors: list[FactorNote] = []
    responses: list[ResponseNote] = []


class ProgressNote(Note):
    """Progress of the run, and of its batch."""

    state: Literal["waiting", "running", "finished", "failed", "interrupted"]
    message: str = ""
    title: str = ""
    done: int = 0
    total: int = 0
    fraction: float = 0.0
    left: float | None = None
    phases: dict[str, int] = {}


class LogNote(Note):
    """A line of the log."""

    time: float
    level: str = "info"
    text: str


class DecisionNote(Note):
    """A decision of a stage."""

    outcome: str
    rule: str = ""


class TableNote(Note):
    """A table of a stage."""

    columns: list[str]
    data: list[list[Value]]


class StageNote(Note):
    """A stage that has ended."""

    name: str
    decisions: list[DecisionNote] = []
    tables: dict[str, TableNote] = {}
    responses: dict[str, SampleNote] = {}


def noted(kind: type[AnyNote], found: Any) -> AnyNote | None:
    """Validate an entry; return None if it is invalid."""
    try:
        return kind.model_validate(found)
    except (ValidationError, RecursionError):
        return None


def all_noted(kind: type[AnyNote], found: Iterable[Any]) -> list[AnyNote]:
    """Validate entries; leave out invalid ones."""
    return [note for each in found if (note := noted(kind, each)) is not None]


def values_of(line: dict[str, Any]) -> dict[str, Value]:
    """Plain values of a line."""
    return {key: value for key, value in line.items() if isinstance(value, Value)}
