"""One reason to doubt an angle."""

from __future__ import annotations

from dataclasses import dataclass

from imaging.errors import PictureError

DOUBTS = (
    "lean", "error", "range", "elevation", "straightness", "foot", "step", "ends",
    "tilt", "border", "plate", "threshold", "shade",
)  # fmt: skip
"""Names of all doubts: of a fitted angle, and of the outline that it was fitted on."""


@dataclass(frozen=True)
class Doubt:
    """One reason to doubt an angle."""

    name: str
    """Short name, for tables: one of `DOUBTS`."""
    finding: str
    """Finding, and the limit that it passes."""

    def __post_init__(self) -> None:
        if self.name not in DOUBTS:
            raise PictureError("doubt", f"expected a doubt is one of {', '.join(DOUBTS)}", self.name)

    def __str__(self) -> str:
        return f"{self.name}: {self.finding}"
