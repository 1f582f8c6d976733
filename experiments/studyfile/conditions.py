"""``[condition.NAME]`` tables: the same grain tested in other ways.

A condition is what the experimenter changes: another tube, a faster lift, a plate of known friction, more
moisture. Its table is merged over the study as that of a scale is. What it fixes is known there, so that no
factor varies it under that condition.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from pydantic import AfterValidator

from experiments.studyfile.factor_section import merge
from experiments.studyfile.places import value_at
from experiments.studyfile.schema import Section


@dataclass(frozen=True)
class Condition:
    """One way to test the grain."""

    name: str
    """Name in files and tables."""
    changes: Mapping[str, Any] = field(default_factory=dict)
    """Sections of the study that differ under it, as written; none: the study as it is."""
    held_out: bool = False
    """It takes no part in any fit, and only judges."""


BASE = Condition("base")
"""The one condition of a study that has none of its own."""


class ConditionSection(Section):
    """``[condition.NAME]``: the known differences of a test."""

    held_out: bool = False
    """It takes no part in any fit, and only judges."""
    grain: dict[str, Any] | None = None
    """Values of the grains that differ, as their size."""
    wall: dict[str, Any] | None = None
    """Values of the walls that differ."""
    contact: dict[str, Any] | None = None
    """Values of a pair of surfaces that differ."""
    scene: dict[str, Any] | None = None
    """Values of the test that differ."""
    mechanism: dict[str, Any] | None = None
    """Values of a physical effect beside those of the base law."""

    def condition(self, name: str) -> Condition:
        """Build the condition."""
        return Condition(name, self.model_dump(exclude={"held_out"}, exclude_none=True), self.held_out)


def _with_plain_names(sections: dict[str, ConditionSection]) -> dict[str, ConditionSection]:
    for name in sections:
        if not name or not all(character.isalnum() or character in "_-" for character in name):
            raise ValueError(f"a condition's name has letters, digits, - and _ only, not {name!r}")
    return sections


ConditionSections = Annotated[dict[str, ConditionSection], AfterValidator(_with_plain_names)]
"""Conditions by name, in the order of the file."""


def under_condition(
    document: Mapping[str, Any], condition: Condition
) -> tuple[dict[str, Any], frozenset[str]]:
    """Merge a condition over a study document.

    Parameters
    ----------
    document
        A study document.
    condition
        One of its conditions.

    Returns
    -------
    document
        The document of that one test, without conditions and campaign; its factors vary only what the
        condition leaves open.
    fixed
        Names of the factors that have nothing left to vary.
    """
    kept = {key: value for key, value in document.items() if key not in ("condition", "target", "campaign")}
    merged = merge(kept, condition.changes)
    factors = []
    for factor in merged.get("factor", []):
        written = factor["parameter"]
        places = [written] if isinstance(written, str) else written
        if free := [place for place in places if value_at(condition.changes, place.split(".")) is None]:
            factors.append(factor | {"parameter": free})
    names = {factor["name"] for factor in merged.get("factor", [])}
    fixed = names - {factor["name"] for factor in factors}
    return merged | {"factor": factors}, frozenset(fixed)
