"""Material cards: what a calibration found of a material, for other studies to name.

A study says ``material = "material.toml"``: the sections of the card then hold where the study has nothing of
its own. What a factor varies is taken from no card.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.errors import StudyError
from experiments.studyfile.factor_section import merge
from experiments.studyfile.places import drop
from experiments.toml_files import read_toml

MATERIAL = "material"
"""Key of a study that names a card, and table of a card that holds the sections."""

SECTIONS = ("grain", "wall", "contact", "mechanism")
"""Sections of a study that describe a material."""


def with_material(document: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Lay a study document over the card that it names, relative to a folder, if it names one.

    Raises
    ------
    StudyError
        When there is no such card, or the file is none.
    """
    own = {key: value for key, value in document.items() if key != MATERIAL}
    if MATERIAL not in document:
        return own
    path = folder / str(document[MATERIAL])
    sections = read_card(path)
    for factor in document.get("factor", []):
        places = factor.get("parameter", "")
        for place in places if isinstance(places, list) else [places]:
            drop(sections, str(place).split("."))
    return merge(sections, own)


def read_card(path: Path) -> dict[str, Any]:
    """Read the sections of a card, its clump files by their whole path.

    Raises
    ------
    StudyError
        When the file cannot be read, or is no card.
    """
    _, card = read_toml(path, "a material card")
    sections = card.get(MATERIAL)
    if not isinstance(sections, dict) or not set(sections) <= set(SECTIONS):
        rule = f"a material card has the tables {', '.join(f'[{MATERIAL}.{name}]' for name in SECTIONS)}"
        raise StudyError(rule, sorted(card), str(path))
    for shape in shapes_of(sections):
        shape["clump"] = str(path.parent.resolve() / shape["clump"])
    return sections


def shapes_of(sections: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Tables of a document that name a clump file."""
    grain = sections.get("grain", {})
    return [table for table in (grain, *grain.get("shapes", {}).values()) if "clump" in table]
