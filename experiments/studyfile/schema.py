"""Sections of a study file as pydantic models: quantities as field types, and errors with their places."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args, get_origin

import numpy as np
from annotated_types import Ge, Gt, Le, Lt
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    GetCoreSchemaHandler,
    PlainValidator,
    ValidationError,
    ValidationInfo,
    field_validator,
)
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from dem_warp.solids import read_mesh
from dem_warp.walls import Triangles
from experiments.io.errors import Problem, StudyError
from experiments.io.texts import nearest_name
from experiments.io.units import Quantity, unit_size
from experiments.studyfile.places import KeyPath, Places, value_at

SectionT = TypeVar("SectionT", bound=BaseModel)

_NESTED = "nested"
"""Type of an error that holds those inside a value."""


@dataclass(frozen=True)
class Dimension:
    """Marks a float field as a quantity: it is read with its unit and held in the base unit."""

    name: str
    """A key of ``units.UNITS``, or ``""`` for a plain number."""
    plain: str = ""
    """Unit of a number that is written without one; ``""``: a number needs its unit."""

    def to_base(self, value: object) -> float:
        """Read a quantity and convert it; ValueError where it is none of the dimension."""
        quantity = Quantity.parse(value)
        return Quantity(quantity.number, quantity.unit or self.plain).to_base(self.name)

    def to_unit(self, value: object, unit: str) -> float:
        """Read a quantity and express it in a unit of the dimension; ValueError where it has another."""
        quantity = Quantity.parse(value)
        return quantity.number if quantity.unit == unit else self.to_base(quantity) / self.size(unit)

    def size(self, unit: str) -> float:
        """Size of a unit in the base unit of the dimension."""
        return unit_size(unit or self.plain, self.name)

    def read(self, value: object, info: ValidationInfo) -> object:
        """Read a quantity of a file; a program, which has no context, may give a number in the base unit."""
        return self.to_base(value) if info.context or not isinstance(value, float) else value

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_before_validator_function(self.read, handler(source))


def _existing(path: Path, info: ValidationInfo) -> Path:
    found = Path((info.context or {}).get("folder", ".")) / path
    if not os.path.isfile(found):  # does not raise for a name that is too long
        raise ValueError(f"no such file: {found}")
    return found


Number = Annotated[float, Dimension("")]
Length = Annotated[float, Dimension("length")]
Pressure = Annotated[float, Dimension("pressure")]
Density = Annotated[float, Dimension("density")]
Mass = Annotated[float, Dimension("mass")]
Time = Annotated[float, Dimension("time")]
Angle = Annotated[float, Dimension("angle")]
"""A measured angle, in degrees."""
RawQuantity = Annotated[Quantity, PlainValidator(Quantity.parse)]
"""A quantity of any dimension, kept as written."""
StudyFile = Annotated[Path, AfterValidator(_existing)]
"""A file, relative to the study file."""

MOST_TRIANGLES = 5000
"""Triangles of the largest body: every case has them all."""


def _read_body(value: object, info: ValidationInfo) -> object:
    """Read a mesh file [mm] into triangles [m]; what is no path stays as it is."""
    if not isinstance(value, str | Path):
        return value
    path = _existing(Path(value), info)
    corners = np.round(read_mesh(path).triangles, 9)
    if len(corners) > MOST_TRIANGLES:
        raise ValueError(f"{path}: must have at most {MOST_TRIANGLES:,} triangles, got {len(corners):,}")
    return tuple(map(tuple, corners.reshape(-1, 9).tolist()))


BodyFile = Annotated[Triangles | None, BeforeValidator(_read_body)]
"""Triangles of a mesh file, relative to the study file."""


class Section(BaseModel):
    """A frozen section: an unknown key is an error, so that a misspelt value is never ignored."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    @field_validator("*", mode="before")
    @classmethod
    def _number_is_no_truth_value(cls, value: object, info: ValidationInfo) -> object:
        """Refuse true and false for a number: Python counts with them."""
        if isinstance(value, bool) and info.field_name is not None:
            kind = cls.model_fields[info.field_name].annotation
            kinds = [kind, *get_args(kind)]
            if int in kinds or any(
                get_origin(each) is Annotated and get_args(each)[0] is int for each in kinds
            ):
                raise ValueError("must be a whole number, not true or false")
        return value


@dataclass(frozen=True)
class Generated:
    """Marks a field as a section whose keys are known when a file is read, those of plug-ins included."""

    section: Callable[[], type[Section]]
    """Builds the section."""
    name: str = ""
    """Default of a field that takes a name as well as a section."""

    def read(self, value: object, info: ValidationInfo) -> Section:
        try:
            return self.section().model_validate(value, context=info.context)
        except ValidationError as error:
            raise nested_error(error.errors()) from None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self.read)


def steps(model: type[BaseModel], path: KeyPath) -> list[tuple[str, FieldInfo]]:
    """Follow a key path through sections: attribute and field of each key; empty where there is no field."""
    found: list[tuple[str, FieldInfo]] = []
    section: type[BaseModel] | None = model
    named = False  # whether the next key is the name of one section among several
    for key in path:
        if named or isinstance(key, int):
            found.append((str(key), found[-1][1]))
            named = False
        elif section is None or key not in (known := fields_of(section)):
            return []
        else:
            found.append(known[key])
            section, named = section_of(known[key][1]), get_origin(known[key][1].annotation) is dict
    return found


def field_at(model: type[BaseModel], path: KeyPath) -> FieldInfo | None:
    """Find the field that a key path leads to; None when there is none."""
    found = steps(model, path)
    return found[-1][1] if found else None


def dimension_of(field: FieldInfo) -> Dimension | None:
    """Find the dimension of a quantity's field, be it optional or not; None for any other field."""
    return next((mark for mark in marks_of(field) if isinstance(mark, Dimension)), None)


def bounds(field: FieldInfo) -> tuple[float, float]:
    """Lower and upper bound of a number field in the base unit, infinite where it has no bound."""
    lower, upper = float("-inf"), float("inf")
    for mark in marks_of(field):
        if isinstance(mark, (Ge, Gt)):
            lower = float(mark.ge if isinstance(mark, Ge) else mark.gt)  # type: ignore[arg-type]
        elif isinstance(mark, (Le, Lt)):
            upper = float(mark.le if isinstance(mark, Le) else mark.lt)  # type: ignore[arg-type]
    return lower, upper


def fields_of(section: type[BaseModel]) -> dict[str, tuple[str, FieldInfo]]:
    """Attribute and field of each key of a section."""
    return {field.alias or name: (name, field) for name, field in section.model_fields.items()}


def section_of(field: FieldInfo) -> type[BaseModel] | None:
    """Return the section that a field holds, also when it is optional or one of several."""
    for mark in marks_of(field):
        if isinstance(mark, Generated):
            return mark.section()
    kinds = (field.annotation, *get_args(field.annotation))
    return next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel)), None)


def marks_of(field: FieldInfo) -> Iterator[Any]:
    """Yield the marks of a field's type, or of its items where it is optional or holds several."""
    yield from field.metadata
    for kind in get_args(field.annotation):
        yield from getattr(kind, "__metadata__", ())


def validated(
    model: type[SectionT], document: Mapping[str, Any], places: Places, at: KeyPath = (), **context: object
) -> SectionT:
    """Validate the values of a section by key, which is at a key path of the file.

    Validators take the further facts of ``context``. Raise StudyError with every rule that is broken, the
    value received and its place.
    """
    try:
        return model.model_validate(document, context={"folder": places.folder, **context})
    except ValidationError as error:
        problems = (_problem(model, document, places, at, *each) for each in _flat(error.errors()))
        raise StudyError.of(problems) from None


def first_problem(error: ValueError) -> str:
    """Return the first rule that an error of a section is about."""
    if not isinstance(error, ValidationError):
        return str(error)
    return message(next(_flat(error.errors()))[1])


def nested_error(errors: Any) -> PydanticCustomError:
    """Hand errors inside a value on to `validated`, each with its place ``loc`` from that value on."""
    return PydanticCustomError(_NESTED, "is wrong", {"errors": errors})


def message(details: Mapping[str, Any]) -> str:
    """Return the rule of a pydantic error, in the words of a study's errors."""
    return details["msg"].removeprefix("Value error, ").replace("Input should be", "must be")


def _flat(errors: Any, outer: KeyPath = ()) -> Iterator[tuple[KeyPath, Mapping[str, Any]]]:
    for each in errors:
        path = (*outer, *each["loc"])
        if each["type"] == _NESTED:
            yield from _flat(each["ctx"]["errors"], path)
        else:
            yield path, each


def _problem(
    model: type[BaseModel],
    document: Mapping[str, Any],
    places: Places,
    at: KeyPath,
    path: KeyPath,
    details: Mapping[str, Any],
) -> Problem:
    value = value_at(document, path)
    match details["type"]:
        case "extra_forbidden":
            field = field_at(model, path[:-1])
            owner = section_of(field) if field else model
            rule = f"unknown key, {nearest_name(str(path[-1]), list(fields_of(owner)) if owner else [])}"
        case "missing":
            rule = "is required"
        case _:
            rule = message(details)
    shown = "nothing" if value is None else "" if isinstance(value, Mapping) else repr(value)
    return Problem(places.of((*at, *path)), rule, shown)
