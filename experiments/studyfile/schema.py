"""Sections of a study file as pydantic models: quantities as field types, and errors with their places."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, PlainValidator, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, ErrorDetails, core_schema

from experiments.errors import Problem, StudyError
from experiments.studyfile.places import KeyPath, Places, value_at
from experiments.studyfile.units import Quantity

SectionT = TypeVar("SectionT", bound=BaseModel)


@dataclass(frozen=True)
class Dimension:
    """Marks a float field as a quantity: it is read with its unit and held in SI (degrees for angles)."""

    name: str
    """A key of ``units.UNITS``, or ``""`` for a plain number."""

    def to_base(self, value: object) -> float:
        """Read a quantity and convert it."""
        return Quantity.parse(value).to_base(self.name)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.to_base, handler(source))


Number = Annotated[float, Dimension("")]
Length = Annotated[float, Dimension("length")]
Pressure = Annotated[float, Dimension("pressure")]
Density = Annotated[float, Dimension("density")]
Speed = Annotated[float, Dimension("speed")]
Rate = Annotated[float, Dimension("rate")]
Frequency = Annotated[float, Dimension("frequency")]
Time = Annotated[float, Dimension("time")]
Angle = Annotated[float, Dimension("angle")]
RawQuantity = Annotated[Quantity, PlainValidator(Quantity.parse)]
"""A quantity of any dimension, kept as written."""


class Section(BaseModel):
    """A frozen section: an unknown key is an error, so that a misspelt value is never ignored."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def field_at(model: type[BaseModel], path: KeyPath) -> FieldInfo | None:
    """Find the field that a key path leads to; None when there is none."""
    field = None
    section: type[BaseModel] | None = model
    named = False  # whether the next key is the name of one section among several
    for key in path:
        if isinstance(key, int) or named:
            named = False
            continue
        if section is None or (field := _fields(section).get(key)) is None:
            return None
        section, named = _section_of(field), get_origin(field.annotation) is dict
    return field


def dimension_of(field: FieldInfo) -> Dimension | None:
    """Find the dimension of a quantity's field, be it optional or not; None for any other field."""
    inner = [mark for kind in get_args(field.annotation) for mark in getattr(kind, "__metadata__", ())]
    return next((mark for mark in (*field.metadata, *inner) if isinstance(mark, Dimension)), None)


def bounds(field: FieldInfo) -> tuple[float, float]:
    """Lower and upper bound of a number field in SI, infinite where there is none."""
    lower, upper = float("-inf"), float("inf")
    for mark in field.metadata:
        if isinstance(mark, (Ge, Gt)):
            lower = float(mark.ge if isinstance(mark, Ge) else mark.gt)  # type: ignore[arg-type]
        elif isinstance(mark, (Le, Lt)):
            upper = float(mark.le if isinstance(mark, Le) else mark.lt)  # type: ignore[arg-type]
    return lower, upper


def nearest_name(name: str, known: list[str]) -> str:
    """Suggest what a misspelt name may have meant, as the end of a sentence."""
    near = difflib.get_close_matches(name, known, n=1)
    return f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known) or 'none'}"


def validated(model: type[SectionT], document: Mapping[str, Any], places: Places) -> SectionT:
    """Validate a document.

    Raises
    ------
    StudyError
        With every rule that is broken, the value received and its place.
    """
    try:
        return model.model_validate(document, context={"folder": places.folder})
    except ValidationError as error:
        first, *more = (_problem(model, document, places, details) for details in error.errors())
        raise StudyError(first.rule, first.value, first.place, tuple(more)) from None


def _problem(
    model: type[BaseModel], document: Mapping[str, Any], places: Places, details: ErrorDetails
) -> Problem:
    path = details["loc"]
    value = value_at(document, path)
    match details["type"]:
        case "extra_forbidden":
            owner = _section_at(model, path[:-1])
            rule = f"unknown key, {nearest_name(str(path[-1]), list(_fields(owner)) if owner else [])}"
        case "missing":
            rule = "is required"
        case _:
            rule = details["msg"].removeprefix("Value error, ").replace("Input should be", "must be")
    return Problem(rule, "nothing" if value is None else repr(value), places.of(path))


def _fields(section: type[BaseModel]) -> dict[str, FieldInfo]:
    return {field.alias or name: field for name, field in section.model_fields.items()}


def _section_at(model: type[BaseModel], path: KeyPath) -> type[BaseModel] | None:
    if not path:
        return model
    field = field_at(model, path)
    return _section_of(field) if field else None


def _section_of(field: FieldInfo) -> type[BaseModel] | None:
    """Return the section that a field holds, also when it is optional or one of several."""
    kinds = (field.annotation, *get_args(field.annotation))
    return next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel)), None)
