"""Material cards: what a calibration found of a material, for other studies to name.

A study says ``material = "material.toml"``: the sections of the card then hold where the study has nothing of
its own. What a factor varies is taken from no card.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from experiments.io.errors import StudyError
from experiments.io.toml_files import read_toml
from experiments.studyfile.factor_section import merge
from experiments.studyfile.places import drop
from experiments.studyfile.solver_section import CARD_LAWS, CORRECTED_FOR, LAWS, laws_of

MATERIAL = "material"
"""Key of a study that names a card, and table of a card that holds the sections."""

BRIDGE = "bridge"
"""Table of a card whose values a bridge has corrected."""

FORMAT = 1
"""Version of the keys of a card."""

SECTIONS = ("grain", "wall", "contact", "mechanism", "solver")
"""Sections of a study that describe a material, and the laws and the solver that its values hold for."""


def with_material(document: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Lay a study document over the card that it names, relative to a folder, if it names one.

    The laws of the card hold where the study does not name any. Raise StudyError when there is no such card,
    the file is not a card, or its values were found with other laws than the study's and the study does not
    say so.
    """
    own = {key: value for key, value in document.items() if key != MATERIAL}
    if MATERIAL not in document:
        return own
    if isinstance(document[MATERIAL], Mapping):
        hint = f'A study takes its values by  {MATERIAL} = "FILE"; dem-warp new NAME writes a study.'
        raise StudyError(MATERIAL, "this file is a material card, not a study", hint=hint)
    path = folder / str(document[MATERIAL])
    sections = read_card(path)
    check_laws(own, sections, path)
    for factor in document.get("factor", []):
        places = factor.get("parameter", "")
        for place in places if isinstance(places, list) else [places]:
            drop(sections, str(place).split("."))
    return merge(sections, own)


def check_laws(document: Mapping[str, Any], sections: Mapping[str, Any], path: Path) -> None:
    """Refuse a study that has other laws than its card and does not say so, by ``solver.card_laws``."""
    solver = document.get("solver", {})
    if not isinstance(solver, Mapping) or LAWS not in solver:
        return
    try:
        own, others = laws_of(solver), laws_of(sections.get("solver", {}))
    except ValidationError:
        return  # the study's sections are checked next, with their places
    if own != others and solver.get(CARD_LAWS) != others.name:
        problem = f"the values of the card hold for the laws {others.name!r} only"
        hint = f'Take those, or set {CARD_LAWS} = "{others.name}" to take the values as they are.'
        raise StudyError(f"solver.{LAWS}, with the card {path}", problem, solver[LAWS], hint)


def read_card(path: Path) -> dict[str, Any]:
    """Read the sections of a card, its clump files by their whole path, and the solver of its bridge."""
    _, card = read_toml(path)
    sections = card.get(MATERIAL)
    if not isinstance(sections, dict) or not set(sections) <= set(SECTIONS):
        tables = ", ".join(f"[{MATERIAL}.{name}]" for name in SECTIONS)
        raise StudyError(str(path), f"is not a material card, which has the tables {tables}", sorted(card))
    if (written := card.get("format", FORMAT)) != FORMAT:
        problem = f"must be {FORMAT}: another version of dem-warp wrote the card"
        raise StudyError(f"{path}: format", problem, written, "Use that version, or run calibrate again.")
    for table, key in files_of(sections):
        table[key] = str(path.parent.resolve() / table[key])
    bridge = card.get(BRIDGE)
    if isinstance(bridge, Mapping) and "engine" in bridge:
        sections = merge(sections, {"solver": {CORRECTED_FOR: bridge["engine"]}})
    return sections


FITTED = ("walls", "measurement", "numerics")
"""Further sections of a study that a card keeps, among what it was fitted to."""


def is_card(path: Path) -> bool:
    """Tell a card from a study; raises `StudyError` when the file cannot be read."""
    return isinstance(read_toml(path)[1].get(MATERIAL), Mapping)


def card_document(card: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Lay out the study of a card's own test; StudyError where the card does not say which."""
    fitted = card.get("fitted", {})
    if not isinstance(fitted, Mapping) or "test" not in fitted:
        raise StudyError(str(path), "lacks the test that it was fitted to, [fitted.test.NAME]")
    kept = {name: fitted[name] for name in FITTED if name in fitted}
    name = str(card.get("name", path.stem))
    return {"name": name, "scene": fitted["test"]} | kept | read_card(path)


def files_of(sections: Mapping[str, Any]) -> list[tuple[dict[str, Any], str]]:
    """Tables of a document that name a file of the grain, each with its key."""
    grain = sections.get("grain", {})
    tables = (grain, *grain.get("shapes", {}).values(), grain.get("sizes", {}))
    return [(table, key) for table in tables for key in ("clump", "sieves", "counts") if key in table]
