"""``[discover]``: what a search for a missing effect looks for, and how hard."""

from __future__ import annotations

from pydantic import Field

from experiments.studyfile.schema import Section


class DiscoverSection(Section):
    """``[discover]``; every part may be left out."""

    mechanisms: tuple[str, ...] | None = Field(default=None, min_length=1)
    """Names of the effects that are looked for; left out: all of the library that the study can have."""
    settings: dict[str, int | float] = Field(default={})
    """Numbers of runs and levels that differ from the defaults, by name."""
