"""``[condition.NAME]`` tables: the same grain tested in other ways.

A condition is what the experimenter changes: another tube, a faster lift, a plate of known friction, more
moisture. Its table is merged over the study as that of a scale is. What it fixes is known there, so that no
factor varies it under that condition.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, PrivateAttr

from experiments.studyfile.factor_section import merge
from experiments.studyfile.places import value_at
from experiments.studyfile.schema import Angle, Section


class Condition(Section):
    """``[condition.NAME]``: one way to test the grain, by its known differences from the study as it is."""

    held_out: bool = False
    """It takes no part in any fit, and only judges."""
    camera: Angle = 0.0
    """Azimuth that the heaps are seen from, about the tube: 0 with x of the study to the right, 180 degrees
    from behind."""
    grain: dict[str, Any] | None = None
    """Values of the grains that differ, as their size."""
    wall: dict[str, Any] | None = None
    """Values of the walls that differ."""
    walls: dict[str, Any] | None = None
    """Values of parts of the walls that differ."""
    contact: dict[str, Any] | None = None
    """Values of a pair of surfaces that differ."""
    scene: dict[str, Any] | None = None
    """Values of the test that differ."""
    mechanism: dict[str, Any] | None = None
    """Values of a physical effect in addition to the base law."""

    _name: str = PrivateAttr(default="base")

    @property
    def name(self) -> str:
        """Name in files and tables."""
        return self._name

    @property
    def changes(self) -> dict[str, Any]:
        """Sections of the study that differ under it, as written; empty for the study as it is."""
        return self.model_dump(exclude={"held_out", "camera"}, exclude_none=True)


BASE = Condition()
"""Condition of a study without conditions."""


def _named(conditions: dict[str, Condition]) -> dict[str, Condition]:
    for name, condition in conditions.items():
        if not name or not all(character.isalnum() or character in "_-" for character in name):
            raise ValueError(f"a condition's name must have letters, digits, - and _ only, got {name!r}")
        condition._name = name
    return conditions


Conditions = Annotated[dict[str, Condition], AfterValidator(_named)]
"""Conditions by name, in the order of the file."""


def under_condition(
    document: Mapping[str, Any], condition: Condition
) -> tuple[dict[str, Any], frozenset[str]]:
    """Merge one of a study's conditions over its document.

    Returns
    -------
    document
        The document of that one test, without conditions and campaign; its factors vary only what the
        condition leaves open.
    fixed
        Names of the factors that have nothing left to vary.
    """
    left_out = ("condition", "target", "response", "direct", "candidate", "campaign")
    kept = {key: value for key, value in document.items() if key not in left_out}
    merged = merge(kept, condition.changes)
    factors = [free_of(condition, factor) for factor in merged.get("factor", [])]
    fixed = frozenset(factor["name"] for factor in factors if not factor["parameter"])
    return merged | {"factor": [factor for factor in factors if factor["parameter"]]}, fixed


def free_of(condition: Condition, factor: Mapping[str, Any]) -> dict[str, Any]:
    """Return a ``[[factor]]`` with the places alone that a condition leaves open."""
    written, changes = factor["parameter"], condition.changes
    places = [written] if isinstance(written, str) else written
    return {**factor, "parameter": [each for each in places if value_at(changes, each.split(".")) is None]}
