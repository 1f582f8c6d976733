"""One thing that was translated: a row of the README."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Translated:
    """One thing that was translated."""

    subject: str
    """As "filling", "tube", "time step"."""
    here: str
    """Its form in dem-warp."""
    there: str
    """Its form in the other code; what is lost or changed on the way stands here."""
