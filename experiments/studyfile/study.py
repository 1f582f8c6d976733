"""Studies: everything that a person configures, one TOML file.

A study file is read once: its scale is merged over it, units are converted, every rule is checked. Any breach
is a `StudyError` with the rule, the value received and the file, line and key. What comes out is frozen.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import Field, PrivateAttr, field_validator

from dem_warp.case import Case
from doe.factors import Factor
from experiments.errors import StudyError
from experiments.studyfile.campaign import (
    TARGET_SCENE,
    CampaignSettings,
    Target,
)
from experiments.studyfile.card import with_material
from experiments.studyfile.conditions import BASE, Condition, ConditionSections, under_condition
from experiments.studyfile.discover_section import DiscoverSection
from experiments.studyfile.factor_section import (
    FactorSection,
    FactorTable,
    check_one_home,
    merge,
    natural_settings,
    with_factor_values,
)
from experiments.studyfile.places import Places, value_at
from experiments.studyfile.scene_sections import SceneSection
from experiments.studyfile.schema import Dimension, Section, nearest_name, validated
from experiments.studyfile.sections import Physics
from experiments.studyfile.target_section import ResponseSection, TargetSection, build_target
from experiments.studyfile.toml_files import read_toml
from imaging import FITS

BUCKWHEAT = Path(__file__).parents[1] / "studies" / "buckwheat" / "study.toml"
"""The study that is meant when none is named: the paper's buckwheat."""

_FACTOR_VALUE_TABLES = (
    ("campaign", "climb", "start"),
    ("campaign", "climb", "step"),
    ("campaign", "surface", "center"),
    ("campaign", "surface", "half_range"),
    ("campaign", "optimum", "point"),
    ("target", "twin", "truth"),
)
"""Tables of a study that hold quantities by factor name."""


class MeasurementSection(Section):
    """``[measurement]``: how an angle is read from a heap; only angles read the same way compare."""

    fit: str = "flank"
    """Part of the flank that the line is fitted to, one of ``imaging.FITS``."""
    azimuths: int = Field(default=8, ge=2)
    """Views of one heap, over half a turn."""
    pixels: int = Field(default=800, ge=50, le=4000)
    """Width of the heap in a view."""

    @field_validator("fit")
    @classmethod
    def _is_known(cls, fit: str) -> str:
        if fit not in FITS:
            raise ValueError(f"must be one of {', '.join(FITS)}")
        return fit


class Study(Physics):
    """Everything that a person configures; built by `load_study`."""

    name: str
    """What is calibrated, in words."""
    note: str = ""
    """What a reader must know about the study at this scale."""
    paper: bool = False
    """The study is the paper's buckwheat: the report shows the published numbers beside."""
    measurement: MeasurementSection = MeasurementSection()
    """How the angle is read."""
    target_section: TargetSection | None = Field(default=None, alias="target")
    """The angle to be matched."""
    response_sections: tuple[ResponseSection, ...] = Field(default=(), alias="response")
    """What else is to be matched."""
    response_scenes: dict[str, SceneSection] = Field(default_factory=dict, alias="response-scene")
    """Further scenes, by the names that responses call them by."""
    factor_sections: tuple[FactorSection, ...] = Field(default=(), alias="factor")
    """The factors as written, in order."""
    condition_sections: ConditionSections = Field(default={}, alias="condition")
    """The conditions as written."""
    campaign: CampaignSettings = CampaignSettings()
    """Every decision of the campaign."""
    discover: DiscoverSection = DiscoverSection()
    """What a search for a missing effect looks for."""

    _document: dict[str, Any] = PrivateAttr(default_factory=dict)
    _places: Places = PrivateAttr(default_factory=lambda: Places(BUCKWHEAT, {}))
    _fixed: frozenset[str] = PrivateAttr(default=frozenset())
    _tests: dict[str, Study] = PrivateAttr(default_factory=dict)
    _target: Target | None = PrivateAttr(default=None)

    @property
    def file(self) -> Path:
        """The study file."""
        return self._places.file

    @property
    def scale(self) -> str | None:
        """The chosen scale; None: the study as written."""
        return self._places.scale

    @property
    def document(self) -> dict[str, Any]:
        """The study as written, the scale merged over it: plain JSON-able data."""
        return copy.deepcopy(self._document)

    @property
    def target(self) -> Target:
        """Responses that the cases must match.

        Raises
        ------
        StudyError
            When the study has none, or they are still to be measured.
        """
        if self._target is None and self.target_section is not None:
            rule = (
                "names pictures or a file: measurement.target.with_measurements takes the numbers from them"
            )
            raise StudyError(rule, "no numbers", f"{self.file}: target")
        if self._target is None:
            raise StudyError("a calibration needs a [target] or a [[response]]", "none", str(self.file))
        return self._target

    @property
    def scenes(self) -> dict[str, SceneSection]:
        """Every scene by its name: the study's own, further ones, those of its conditions."""
        tests = {name: test.scene for name, test in self._tests.items()}
        return {TARGET_SCENE: self.scene, **self.response_scenes, **tests}

    @cached_property
    def factors(self) -> tuple[Factor, ...]:
        """Factors of the designs in natural units, in the order of the file."""
        return tuple(section.factor() for section in self.factor_sections)

    @cached_property
    def limits(self) -> dict[str, tuple[float, float]]:
        """Hard physical limits of every factor in its natural unit, infinite where there is none."""
        return {section.name: section.limits for section in self.factor_sections}

    @cached_property
    def conditions(self) -> tuple[Condition, ...]:
        """What the grain is tested under, in the order of the file; none written: the test as it is."""
        return tuple(section.condition(name) for name, section in self.condition_sections.items()) or (BASE,)

    def under(self, condition: str) -> Study:
        """Build the study of the test under one condition; it takes settings of all factors of this one.

        Raises
        ------
        StudyError
            When there is no such condition, or it breaks a rule.
        """
        by_name = {each.name: each for each in self.conditions}
        if condition not in by_name:
            rule = f"must be a condition of the study, {nearest_name(condition, list(by_name))}"
            raise StudyError(rule, condition, str(self.file))
        document, fixed = under_condition(self._document, by_name[condition])
        study = _build(document, replace(self._places, condition=condition))
        study._fixed = self._fixed | fixed
        return study

    def with_document(self, document: Mapping[str, Any]) -> Study:
        """Build the study that another document describes, as if it stood in the same file.

        Raises
        ------
        StudyError
            When the document breaks a rule.
        """
        return _build(dict(document), self._places)

    def natural_settings(self, settings: Mapping[str, object], source: str = "settings") -> dict[str, float]:
        """Read factor values with their units as numbers in natural units.

        Parameters
        ----------
        settings
            Quantities by factor name, as ``{"B": "34 MPa", "E": 0.46}``.
        source
            Where they come from, for error messages.

        Raises
        ------
        StudyError
            When there is no such factor, or a value is no quantity of its dimension.
        """
        return natural_settings(self.factor_sections, settings, Places(Path(source), {}))

    def case(self, settings: Mapping[str, float], seed: int, scene: str = TARGET_SCENE) -> Case:
        """Build one case.

        Parameters
        ----------
        settings
            Values by factor name in natural units; a factor that is not named is at its middle.
        seed
            Seed of everything random in the case.
        scene
            Name of the scene, or of the condition.

        Raises
        ------
        StudyError
            When there is no such factor or scene, or a value leaves what is physical.
        """
        if scene in self._tests:
            return self._tests[scene].case(settings, seed)
        names = [section.name for section in self.factor_sections]
        for name in settings:
            if name not in names and name not in self._fixed:
                raise StudyError(f"must name a factor, {nearest_name(name, names)}", name, str(self.file))
        document = with_factor_values(self._document, self.factor_sections, settings)
        sections = {key: document[key] for key in Physics.model_fields if key in document}
        if scene not in self.scenes:
            rule = f"must name a scene of the study, {nearest_name(scene, list(self.scenes))}"
            raise StudyError(rule, scene, str(self.file))
        if scene != TARGET_SCENE:
            sections["scene"] = document["response-scene"][scene]
        physics = validated(Physics, sections, self._places)
        try:
            return physics.build_case(seed)
        except ValueError as error:
            raise StudyError(str(error), dict(settings), str(self.file)) from error


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
        What a caller merges over that, table by table, as written in a study file.

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
            rule = f"the scale must be one that the study has, {nearest_name(scale, list(scales))}"
            raise StudyError(rule, scale, str(path))
        document = merge(document, scales[scale])
    return _build(with_material(merge(document, changes or {}), path.parent), places)


def _build(document: dict[str, Any], places: Places) -> Study:
    """Build a study, and each of its conditions once, so that a wrong one is named at once."""
    sections = validated(FactorTable, {"factor": document.get("factor", [])}, places).factor
    check_one_home(document, sections, places)
    plain = with_factor_values(_without_units(document, sections, places), sections, {})
    study = validated(Study, plain, places)
    study._document, study._places = document, places
    for condition in study.condition_sections:
        study._tests[condition] = study.under(condition)
    for name in study.response_scenes:
        if name == TARGET_SCENE or name in study._tests:
            rule = f"a further scene has a name of its own: {name!r} is the study's own, or a condition"
            raise StudyError(rule, name, places.of(("response-scene", name)))
    held_out = [condition.name for condition in study.conditions if condition.held_out]
    study._target = build_target(
        study.target_section, study.response_sections, study.scenes, held_out, places
    )
    return study


def study_scales(path: str | Path | None = None) -> tuple[str, ...]:
    """Names of the scales that a study file has.

    Raises
    ------
    StudyError
        When the file cannot be read.
    """
    path = BUCKWHEAT if path is None else Path(path)
    return tuple(_scales(path, read_toml(path)[1]))


def _scales(path: Path, document: Mapping[str, Any]) -> Mapping[str, Mapping[str, Any]]:
    scales = document.get("scale", {})
    if not isinstance(scales, Mapping) or not all(isinstance(table, Mapping) for table in scales.values()):
        raise StudyError("scales are tables, [scale.NAME]", scales, str(path))
    return scales


def _without_units(
    document: dict[str, Any], sections: tuple[FactorSection, ...], places: Places
) -> dict[str, Any]:
    """Copy a document with factor values and margin as plain numbers, as the campaign takes them."""
    plain = copy.deepcopy(document)
    for path in _FACTOR_VALUE_TABLES:
        if isinstance(table := value_at(plain, path), dict):
            value_at(plain, path[:-1])[path[-1]] = natural_settings(sections, table, places, path)  # type: ignore[index]
    path = ("campaign", "verification", "margin")
    if (margin := value_at(plain, path)) is not None:
        try:
            plain["campaign"]["verification"]["margin"] = Dimension("angle").to_base(margin)
        except ValueError as error:
            raise StudyError(str(error), margin, places.of(path)) from None
    return plain
