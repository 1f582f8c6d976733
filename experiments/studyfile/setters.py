"""Typed setters: a place of a study, compiled to the attributes that lead there, its unit and its bounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from pydantic import BaseModel, TypeAdapter, ValidationError

from experiments.studyfile.mechanisms import mechanisms_section
from experiments.studyfile.scene_sections import scene_section
from experiments.studyfile.schema import (
    Dimension,
    Section,
    SectionT,
    annotation,
    bounds,
    dimension_of,
    message,
    steps,
)
from experiments.studyfile.sections import Physics
from experiments.studyfile.units import Quantity


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
    """Lower and upper bound in the base unit, infinite where there is none."""
    number: TypeAdapter[Any]
    """Reads a quantity as the field does: in SI, within its bounds."""

    @classmethod
    def at(cls, parameter: str) -> Setter:
        """Compile the setter of a place, as ``contact.grain-grain.static_friction``.

        Raises
        ------
        ValueError
            When there is no quantity.
        """
        # A place may lead elsewhere once a library has grown.
        return _compiled(parameter, scene_section(), mechanisms_section())

    def write(self, changes: dict[str, Any], quantity: Quantity) -> None:
        """Add a quantity at this place to the changes of a study's physics.

        Raises
        ------
        ValueError
            When it leaves the bounds.
        """
        try:
            value = self.number.validate_python(quantity)
        except ValidationError as error:
            raise ValueError(message(error.errors()[0])) from None
        *outer, last = self.attributes
        for attribute in outer:
            changes = changes.setdefault(attribute, {})
        changes[last] = value


def changed(section: SectionT, changes: Mapping[str, Any]) -> SectionT:
    """Copy a section, each section inside that changes copied once; `changes` are nested as it is."""
    return section.model_copy(update=_changed_values(vars(section), changes))


def _changed_values(values: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    def new(value: Any, change: Any) -> Any:
        if not isinstance(change, dict):
            return change
        return (
            changed(value, change) if isinstance(value, BaseModel) else value | _changed_values(value, change)
        )

    return {name: new(values[name], change) for name, change in changes.items()}


@cache
def _compiled(parameter: str, *libraries: type[Section]) -> Setter:
    path = tuple(parameter.split("."))
    trail = steps(Physics, path)
    dimension = dimension_of(trail[-1].field) if trail else None
    if dimension is None:
        raise ValueError('must lead to a quantity of the study, as "contact.grain-grain.static_friction"')
    attributes = tuple(step.attribute for step in trail)
    field = trail[-1].field
    return Setter(path, attributes, dimension, bounds(field), TypeAdapter(annotation(field)))
