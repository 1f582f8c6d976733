"""Typed setters: a place of a study, compiled to the attributes that lead there, its unit and its bounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any

from pydantic import TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from experiments.io.units import Quantity
from experiments.studyfile.mechanisms import mechanisms_section
from experiments.studyfile.physics import Physics
from experiments.studyfile.scene_sections import scene_section
from experiments.studyfile.schema import (
    Dimension,
    Section,
    SectionT,
    bounds,
    dimension_of,
    fields_of,
    first_problem,
    section_of,
    steps,
)


@dataclass(frozen=True)
class Setter:
    """Writes a quantity at one place of a study's physics."""

    path: tuple[str, ...]
    """Keys as a file has them."""
    attributes: tuple[str, ...]
    """Fields, and names of sections, that lead to it."""
    dimension: Dimension
    """Dimension of its quantity."""
    limits: tuple[float, float]
    """Lower and upper bound in the base unit, infinite where it has no bound."""
    number: TypeAdapter[Any]
    """Reads a quantity as the field does: in SI, within its bounds."""

    def write(self, changes: dict[str, Any], quantity: Quantity) -> None:
        """Add a quantity at this place to the changes of a study's physics; ValueError beyond its bounds."""
        try:
            value = self.number.validate_python(quantity)
        except ValidationError as error:
            raise ValueError(first_problem(error)) from None
        *outer, last = self.attributes
        for attribute in outer:
            changes = changes.setdefault(attribute, {})
        changes[last] = value


def setter_at(parameter: str) -> Setter:
    """Compile the setter of a place, as ``contact.grain-grain.static_friction``; ValueError without one."""
    # A place may lead elsewhere once a library has grown; laws are loaded for a place in one of them alone.
    laws = (mechanisms_section(),) if parameter.startswith("mechanism.") else ()
    return _compiled(parameter, scene_section(), *laws)


@cache
def _compiled(parameter: str, *libraries: type[Section]) -> Setter:
    path = tuple(parameter.split("."))
    # laws are choices, which no factor varies; a set is named as a whole
    found = steps(Physics, path) if path[0] != "solver" else []
    field = found[-1][1] if found else None
    dimension = dimension_of(field) if field else None
    if field is None or dimension is None:
        raise ValueError('must lead to a quantity of the study, e.g. "contact.grain-grain.static_friction"')
    return Setter(path, tuple(name for name, _ in found), dimension, bounds(field), _reader(field))


def _reader(field: FieldInfo) -> TypeAdapter[Any]:
    """Build the reader of a field's values."""
    kind: Any = Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation
    return TypeAdapter(kind)


def changed(value: Any, change: Any) -> Any:
    """Copy a section, or sections by name, with changes nested as it is."""
    if not isinstance(change, dict):
        return change
    old = value if isinstance(value, dict) else vars(value)
    new = {name: changed(old[name], each) for name, each in change.items()}
    return value | new if isinstance(value, dict) else value.model_copy(update=new)


def revised(section: SectionT, change: Mapping[str, Any]) -> SectionT:
    """Copy a section with values by key, nested as in a file; ValueError where one breaks a rule."""
    known, update = fields_of(type(section)), {}
    for key, value in change.items():
        if key not in known:
            raise ValueError(f"unknown key {key!r}")
        attribute, field = known[key]
        update[attribute] = _revised(getattr(section, attribute), field, value)
    return type(section).model_validate(section.model_copy(update=update))


def _revised(old: Any, field: FieldInfo, value: object) -> Any:
    if not isinstance(value, Mapping):
        return _reader(field).validate_python(value)
    if isinstance(old, dict):
        return old | {name: _revised(old.get(name), field, each) for name, each in value.items()}
    kind = section_of(field)
    if kind is not None and not isinstance(old, kind):  # missing, or of a library that has grown
        return kind.model_validate({**getattr(old, "given", {}), **value})
    return revised(old, value)
