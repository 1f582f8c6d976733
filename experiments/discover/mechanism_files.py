"""The library of mechanisms: physical effects that a study may lack.

A mechanism is one more parameter of a study, which the study leaves where it has no effect. Each is one file
in ``mechanisms/``, named after it; to add one is to add a file. A package from outside adds the path of one.
A range may be given in a scale of the grain, so that it fits any; `library_for` turns it into the study's
units.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from dem_warp import Case, effective_moduli
from dem_warp.laws.conventions import Rolling
from dem_warp.model import GRAVITY
from dem_warp.registry import Registry
from experiments.io.toml_files import read_toml
from experiments.io.units import Quantity
from experiments.studyfile import Study, StudyError
from experiments.studyfile.factor_section import Parameters
from experiments.studyfile.mechanism_factor import MechanismFactor, with_mechanisms
from experiments.studyfile.physics import Physics
from experiments.studyfile.places import Places, value_at
from experiments.studyfile.schema import Section, field_at, validated
from experiments.studyfile.setters import setter_at

FORMER_NAMES = {"contact_cohesion": "contact_adhesion"}
"""Names by which older studies and banks know mechanisms."""

LONG_LEVER: frozenset[Rolling] = frozenset({"own_spin", "own_spin_whole_step", "deme"})
"""Choices of rolling whose lever is the distance to the grain's centre; others have the reduced radius R*."""

ScaleName = Literal["grain weight / radius", "grain volume", "grain stiffness"]


class Scaled(Section):
    """A value as a multiple of a scale of the grain."""

    times: float = Field(gt=0.0)
    """The multiple."""
    of: ScaleName
    """The scale."""

    def value(self, scales: Mapping[str, float]) -> float:
        return self.times * scales[self.of]


class MechanismFile(Section):
    """A file of the library."""

    title: str
    """Its name in physics."""
    sentence: str
    """Explanation in plain language."""
    kind: Literal["law", "scene", "population"]
    """Place where it acts: in the contacts, in the test, or as a property of the grains."""
    parameters: Parameters
    """Place of the parameter in a study; of one value, where there are several."""
    unit: str
    """Unit of its size, ``1`` for a plain number."""
    null: float = Field(ge=0.0)
    """Size at which it has no effect; a study may start from more."""
    maximum: Scaled | Annotated[float, Field(gt=0.0)]
    """Largest size that is searched."""
    reduced_maximum: float | None = Field(default=None, gt=0.0)
    """The largest where the study's resistance to rolling has the lever R*. Default: the same."""
    source: str
    """Source of law and range."""
    confirm: str
    """The further experiment that would show it."""
    removal: str = ""
    """Instruction that takes it away for a test. Default: there is none."""
    directed: bool = False
    """It has a direction: the test has it along x, a laboratory anywhere."""
    saturation: float | None = Field(default=None, gt=0.0)
    """Distance from the null over which what a step adds falls to 1/e. Default: all steps add the same."""
    companions: dict[str, Scaled | float | str] = Field(default_factory=dict)
    """Further settings that it needs in a study, by place; without effect while it is at its null."""


def _check(name: str, path: object, known: Mapping[str, Path]) -> None:
    """Check the file of a mechanism from outside."""
    if not isinstance(path, Path):
        raise TypeError(f"must be the Path of a TOML file, got {path!r}")
    _read(path)


FILES: Mapping[str, Path] = Registry(
    "dem_warp.mechanisms",
    {path.stem: path for path in Path(__file__).parent.glob("mechanisms/*.toml")},
    _check,
)
"""The files of the library, by the names of the mechanisms."""


def library_for(study: Study, files: Mapping[str, Path] = FILES) -> tuple[MechanismFactor, ...]:
    """Read the mechanisms that a study may lack from files by their names, in alphabetical order.

    Without those that the study cannot have: its test has no such setting, a factor varies it already, it is
    at the maximum, or something else in the study excludes it. Raise StudyError when a file breaks a rule.
    """
    scales = grain_scales(study.case({}, seed=0))
    found = (_mechanism(name, path, study, scales) for name, path in sorted(files.items()))
    return tuple(mechanism for mechanism in found if mechanism is not None and _can_have(study, mechanism))


def with_maximum(study: Study, mechanism: MechanismFactor, size: Quantity) -> MechanismFactor:
    """Give a mechanism of its `library_for` another largest size; StudyError where it cannot be."""
    place = f"{study.file}: discover.maxima.{mechanism.name}"
    try:
        maximum = _in_unit(mechanism.parameters[0], size, mechanism.unit)
    except ValueError as error:
        raise StudyError(place, str(error), str(size)) from error
    if maximum <= mechanism.null:
        raise StudyError(place, f"must be above {mechanism.null:g}, where it has no effect", str(size))
    changed = replace(mechanism, maximum=maximum)
    try:
        with_mechanisms(study, [changed])
    except StudyError as error:
        rule = f"must be a size that the study can have: {error.problem}"
        raise StudyError(place, rule, str(size)) from error
    return changed


def grain_scales(case: Case) -> dict[str, float]:
    """Scales of the grains of a case: weight over radius [N/m], volume [m3], stiffness as simulated [Pa].

    The radius is that of a sphere of the mean volume; the stiffness is the effective Young's modulus of two
    grains.
    """
    volume = case.grains.mean(lambda shape: shape.volume)
    radius = (3.0 * volume / (4.0 * math.pi)) ** (1.0 / 3.0)
    weight = volume * case.grain_material.density * GRAVITY
    stiffness, _ = effective_moduli(case.grain_material, case.grain_material)
    return {"grain weight / radius": weight / radius, "grain volume": volume, "grain stiffness": stiffness}


def _mechanism(name: str, path: Path, study: Study, scales: Mapping[str, float]) -> MechanismFactor | None:
    """Read a file for a study; None where the study cannot have the mechanism."""
    file = _read(path)
    null, *others = (_start(study, tuple(place.split(".")), file) for place in file.parameters)
    has_reduced = file.reduced_maximum is not None and study.solver.laws.rolling not in LONG_LEVER
    maximum = _number(file.reduced_maximum if has_reduced else file.maximum, scales)
    if null is None or any(other != null for other in others) or null >= maximum:
        return None
    companions = tuple((place, _number(value, scales)) for place, value in file.companions.items())
    kept = {"title", "sentence", "kind", "parameters", "unit", "source", "confirm", "directed", "saturation"}
    shared = file.model_dump(include=kept | {"removal"})
    return MechanismFactor(name, null, maximum, **shared, companions=companions)


def _read(path: Path) -> MechanismFile:
    text, document = read_toml(path)
    return validated(MechanismFile, document, Places.read(path, text))


def _can_have(study: Study, mechanism: MechanismFactor) -> bool:
    try:
        with_mechanisms(study, [mechanism])
    except StudyError:
        return False
    return True


def _start(study: Study, path: tuple[str, ...], file: MechanismFile) -> float | None:
    """Value that a study has at a place, in the mechanism's unit; None where it cannot have the mechanism."""
    varied = any(path in section.paths for section in study.factor_sections)
    other_test = path[0] == "scene" and value_at(study.document, path[:2]) is None
    if varied or other_test:
        return None
    written = value_at(study.document, path)
    if written is None:
        field = field_at(Physics, path)
        default = field.default if field else None
        return float(default) if isinstance(default, float) else file.null
    return _in_unit(".".join(path), written, file.unit)


def _in_unit(place: str, written: Any, unit: str) -> float:
    return setter_at(place).dimension.to_unit(written, "" if unit == "1" else unit)


def _number(value: Any, scales: Mapping[str, float]) -> Any:
    return value.value(scales) if isinstance(value, Scaled) else value
