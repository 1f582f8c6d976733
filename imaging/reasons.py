"""One reason to doubt an angle."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Doubt:
    """One reason to doubt an angle."""

    name: str
    """Short name, for tables: one of `DOUBTS`."""
    finding: str
    """Finding, and the limit that it passes."""

    def __str__(self) -> str:
        return f"{self.name}: {self.finding}"
