"""One reason to doubt an angle."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Doubt:
    """One reason to doubt an angle."""

    name: str
    """Short name, for tables: one of `DOUBTS`."""
    finding: str
    """What was found, and against which limit."""

    def __str__(self) -> str:
        return f"{self.name}: {self.finding}"
