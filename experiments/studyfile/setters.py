"""Typed setters: a place of a study, compiled to the attributes that lead there, its unit and its bounds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any

from pydantic import TypeAdapter, ValidationError

from experiments.io.units import Quantity
from experiments.studyfile.mechanisms import mechanisms_section
from experiments.studyfile.scene_sections import scene_section
from experiments.studyfile.schema import Dimension, Section, bounds, dimension_of, message, steps
from experiments.studyfile.sections import Physics


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


def setter_at(parameter: str) -> Setter:
    """Compile the setter of a place, as ``contact.grain-grain.static_friction``.

    Raises
    ------
    ValueError
        When there is no quantity.
    """
    # A place may lead elsewhere once a library has grown; laws are loaded for a place in one of them alone.
    laws = (mechanisms_section(),) if parameter.startswith("mechanism.") else ()
    return _compiled(parameter, scene_section(), *laws)


@cache
def _compiled(parameter: str, *libraries: type[Section]) -> Setter:
    path = tuple(parameter.split("."))
    # laws are choices, which no factor varies; a set is named as a whole
    trail = steps(Physics, path) if path[0] != "solver" else []
    field = trail[-1][1] if trail else None
    dimension = dimension_of(field) if field else None
    if field is None or dimension is None:
        raise ValueError('must lead to a quantity of the study, as "contact.grain-grain.static_friction"')
    kind: Any = Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation
    return Setter(path, tuple(name for name, _ in trail), dimension, bounds(field), TypeAdapter(kind))


def changed(value: Any, change: Any) -> Any:
    """Copy a section, or sections by name, with changes nested as it is."""
    if not isinstance(change, dict):
        return change
    old = value if isinstance(value, dict) else vars(value)
    new = {name: changed(old[name], each) for name, each in change.items()}
    return value | new if isinstance(value, dict) else value.model_copy(update=new)
