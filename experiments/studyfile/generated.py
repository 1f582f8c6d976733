"""Sections generated from the engine's own dataclasses: keys, units, bounds and defaults are theirs.

A section holds what the engine takes, SI. An angle that the engine has in radians is written, and its bounds
are shown, in degrees: `_number` alone converts it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from typing import Annotated, Any, ClassVar, Self, get_args, get_type_hints

from annotated_types import Ge, Gt, Le, Lt
from pydantic import AfterValidator, Field, create_model, model_validator

from dem_warp import Parameter
from dem_warp.parameters import parameters_of
from dem_warp.walls import Triangles
from experiments.io.units import dimension_of_unit
from experiments.studyfile.schema import BodyFile, Dimension, Section


class EngineSection(Section):
    """Parameters of an object of the engine."""

    engine: ClassVar[type[Any]]
    """Class of the object."""
    plain_numbers: ClassVar[bool] = False
    """A number without a unit is taken in SI."""
    trial_arguments: ClassVar[Mapping[str, Any]] = {}
    """Other arguments of the class, to try the parameters with."""

    @model_validator(mode="after")
    def _can_be(self) -> Self:
        self.build(**self.trial_arguments)
        return self

    def build(self, **others: Any) -> Any:
        """Build the object; ValueError when it breaks a rule of the engine."""
        return self.engine(**others, **dict(self))


class LibrarySection(Section):
    """A section for each thing of a library, by name."""

    @property
    def given(self) -> dict[str, Any]:
        """Sections that the study has, in the order of the library."""
        sections = ((field.alias, getattr(self, name)) for name, field in type(self).model_fields.items())
        return {str(alias): section for alias, section in sections if section is not None}


@cache
def section_for(engine: type, base: type[EngineSection] = EngineSection) -> type[EngineSection]:
    """Generate the section of an engine's dataclass; without what another section describes."""
    hints, parameters = get_type_hints(engine, include_extras=True), parameters_of(engine)
    keys: dict[str, Any] = {}
    for each in fields(engine):
        kind = hints[each.name]
        if is_dataclass(kind):
            continue
        if kind == Triangles | None:
            kind = BodyFile
        if each.name in parameters:
            kind = _number(kind, parameters[each.name], base.plain_numbers)
        keys[each.name] = (kind, ... if each.default is MISSING else each.default)
    section = create_model(f"{engine.__name__}Section", __base__=base, __module__=engine.__module__, **keys)
    section.engine = engine
    return section


@cache
def library_section(section: type[Section], base: type[EngineSection], *library: tuple[str, type]) -> Any:
    """Generate the section of a library from the name and the class of each thing."""
    keys: dict[str, Any] = {
        name.replace("-", "_"): (section_for(engine, base) | None, Field(default=None, alias=name))
        for name, engine in library
    }
    return create_model(section.__name__, __base__=section, **keys)


def _number(kind: Any, parameter: Parameter, plain: bool) -> Any:
    """Type of a number in a study file, from its type and unit in the engine."""
    bare, *_ = get_args(kind)
    number, *optional = get_args(bare) or (bare,)
    turned = parameter.unit == "rad"
    limits = ((Gt, parameter.above), (Ge, parameter.at_least), (Lt, parameter.below), (Le, parameter.at_most))
    given = [(mark, limit) for mark, limit in limits if limit is not None]
    marks: list[Any] = [mark(math.degrees(limit) if turned else limit) for mark, limit in given]
    if number is float:
        unit = parameter.unit if plain and parameter.unit != "1" else ""
        marks.insert(0, Dimension(dimension_of_unit(parameter.unit), unit))
    if turned:
        marks.append(AfterValidator(math.radians))
    found: Any = Annotated[(number, *marks)]  # type: ignore[valid-type]
    return found | None if optional else found
