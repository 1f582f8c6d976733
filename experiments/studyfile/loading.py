"""Study files: read once, with a scale merged over the rest, units converted and every rule checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from experiments.io.errors import StudyError
from experiments.io.texts import nearest_name
from experiments.io.toml_files import read_toml
from experiments.studyfile.campaign import TARGET_SCENE
from experiments.studyfile.card import card_document, with_material
from experiments.studyfile.conditions import under_condition
from experiments.studyfile.factor_section import (
    FactorTable,
    check_one_home,
    merge,
    natural_value,
    rescaled,
    with_factor_values,
)
from experiments.studyfile.places import Places
from experiments.studyfile.reserved_names import check_factor_names
from experiments.studyfile.schema import validated
from experiments.studyfile.study import Study, check_restitution

BUCKWHEAT = Path(__file__).parents[1] / "studies" / "buckwheat" / "study.toml"
"""Default study: the paper's buckwheat."""


def load_study(
    path: str | Path | None = None, scale: str | None = None, changes: Mapping[str, Any] | None = None
) -> Study:
    """Read and check a study file.

    Parameters
    ----------
    path
        The TOML file; None: the paper's buckwheat.
    scale
        Name of a ``[scale.NAME]`` table to merge over the rest; None: the study as written.
    changes
        Sections that a caller merges over that, table by table, as written in a study file.

    Raises
    ------
    StudyError
        When the file cannot be read or breaks a rule: the rules, the values received, and their places.
    """
    path = BUCKWHEAT if path is None else Path(path)
    text, document = read_toml(path)
    places = Places.read(path, text, scale)
    scales = _scales(path, document)
    document.pop("scale", None)
    if scale is not None:
        if scale not in scales:
            raise StudyError(str(path), f"has no such scale, {nearest_name(scale, list(scales))}", scale)
        document, places = rescaled(document, scales[scale], places)
    return build_study(with_material(merge(document, changes or {}), path.parent), places)


def load_card(path: Path) -> Study:
    """Read a material card as the study of its own test; StudyError where it names none."""
    text, card = read_toml(path)
    return build_study(card_document(card, path), Places.read(path, text))


def build_study(document: dict[str, Any], places: Places) -> Study:
    """Build a study and each of its conditions from a document; errors as in `load_study`."""
    sections = validated(FactorTable, {"factor": document.get("factor", [])}, places).factor
    names = [section.name for section in sections]
    check_factor_names(names, places)
    check_one_home(document, sections, places)
    middle = with_factor_values(document, sections, {}) | {"factor": sections}
    study = validated(Study, middle, places, natural_value=partial(natural_value, sections))
    study._document, study._places = document, places
    check_restitution(study)
    for name, condition in study.condition_sections.items():
        inner, fixed = under_condition(document, condition)
        study._under[name] = build_study(inner, replace(places, condition=name))
        study._under[name]._fixed = fixed
    for name in study.response_scenes:
        if name == TARGET_SCENE or name in study.condition_sections:
            problem = "is the name of the study's own scene or of a condition"
            raise StudyError(places.of(("response-scene", name)), problem, hint="Choose another name.")
    study.match()
    return study


def cheaper_study(study: Study, scale: str | None = None) -> Study:
    """Return a study at the cheaper scale of its campaign, or at one that is named; without one, the study.

    Raise StudyError when the study's file has no such scale, or other factors there.
    """
    fidelity = study.campaign.fidelity
    if scale is None:
        return study if fidelity is None else cheaper_study(study, fidelity.scale)
    place = f"{study.file}: campaign.fidelity.scale"
    if scale == study.scale:
        raise StudyError(place, "must be another scale than that of the run", scale)
    if study.engine is not None and study.engine.by is not None:
        raise StudyError(place, "cannot be combined with runs by hand", scale)
    engine = study.document.get("engine")
    cheaper = load_study(study.file, scale, {"engine": engine} if engine else None)
    if [factor.name for factor in cheaper.factors] != [factor.name for factor in study.factors]:
        raise StudyError(place, "must have the study's factors", scale)
    return cheaper


def study_scales(path: str | Path | None = None) -> tuple[str, ...]:
    """Return the names of the scales of a study file."""
    path = BUCKWHEAT if path is None else Path(path)
    return tuple(_scales(path, read_toml(path)[1]))


def _scales(path: Path, document: Mapping[str, Any]) -> Mapping[str, Mapping[str, Any]]:
    scales = document.get("scale", {})
    if not isinstance(scales, Mapping) or not all(isinstance(table, Mapping) for table in scales.values()):
        raise StudyError(f"{path}: scale", "must hold tables, [scale.NAME]", scales)
    return scales
