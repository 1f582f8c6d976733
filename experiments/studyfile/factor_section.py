"""``[[factor]]`` sections: the parameters of a study that its designs vary."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Annotated, Any

from pydantic import Field, PlainValidator, ValidationInfo, field_validator, model_validator

from doe import Factor
from experiments.io.errors import StudyError
from experiments.io.texts import nearest_name
from experiments.io.units import Quantity
from experiments.studyfile.places import Places, nested, value_at
from experiments.studyfile.schema import Dimension, RawQuantity, Section
from experiments.studyfile.setters import Setter, setter_at


def _read_parameters(value: object) -> tuple[str, ...]:
    """Read the place of a parameter, or a list of places."""
    places = (value,) if isinstance(value, str) else tuple(value) if isinstance(value, list | tuple) else ()
    if not places or not all(isinstance(place, str) for place in places):
        raise ValueError("must be the place of a parameter, or a list of places")
    for place in places:
        setter_at(place)
    return places


Parameters = Annotated[tuple[str, ...], PlainValidator(_read_parameters)]
"""One place of the study, or several."""


class FactorSection(Section):
    """One factor. Its natural unit is the unit of ``low``."""

    name: str = Field(pattern=r"^[A-Za-z_]\w*$", max_length=100)
    """Short name: a column of every table, and what ``--set`` takes."""
    label: str
    """Its meaning, in words."""
    parameter: Parameters
    """The parameter's place in the study, as ``contact.grain-grain.static_friction``; or several places of
    one value."""
    low: RawQuantity
    """Lower end of the range."""
    high: RawQuantity
    """Upper end of the range."""

    @field_validator("low", "high")
    @classmethod
    def _has_the_dimension(cls, level: Quantity, info: ValidationInfo) -> Quantity:
        for parameter in info.data.get("parameter", ()):
            setter_at(parameter).dimension.to_base(level)
        return level

    @model_validator(mode="after")
    def _range_is_physical(self) -> FactorSection:
        low, high = self.low.number, self.natural(self.high)
        least, most = self.limits
        if not low < high:
            raise ValueError(f"low must be below high, got {self.low} and {self.high}")
        if low < least or high > most:
            raise ValueError(f"low and high must stay within {least:g} and {most:g} {self.unit}".rstrip())
        return self

    @cached_property
    def setters(self) -> tuple[Setter, ...]:
        """Setter of each of its places."""
        return tuple(setter_at(parameter) for parameter in self.parameter)

    @property
    def paths(self) -> tuple[tuple[str, ...], ...]:
        """Key path of each of its places."""
        return tuple(setter.path for setter in self.setters)

    @property
    def unit(self) -> str:
        return self.low.unit

    @property
    def dimension(self) -> Dimension:
        return self.setters[0].dimension

    @property
    def limits(self) -> tuple[float, float]:
        """Hard physical limits in the natural unit, infinite where it has no bound."""
        least, most = zip(*(setter.limits for setter in self.setters), strict=True)
        size = self.dimension.size(self.unit)
        return max(least) / size, min(most) / size

    def natural(self, value: object) -> float:
        """Read a quantity (``"34 MPa"``, 0.46) in the natural unit; ValueError where it has another."""
        return self.dimension.to_unit(value, self.unit)

    def write(self, changes: dict[str, Any], value: float, places: Places) -> None:
        """Add a value in the natural unit to the changes of a study; StudyError beyond its limits."""
        for setter in self.setters:
            try:
                setter.write(changes, Quantity(float(value), self.unit))
            except ValueError as error:
                raise StudyError(places.of(setter.path), str(error), value) from None

    @property
    def middle(self) -> Quantity:
        return Quantity(self.factor().center, self.unit)

    @property
    def table(self) -> dict[str, Any]:
        """Section as a study file writes it."""
        levels = {name: getattr(self, name).written for name in ("low", "high")}
        return {"name": self.name, "label": self.label, "parameter": list(self.parameter), **levels}

    def factor(self) -> Factor:
        """Build the factor of the designs."""
        return Factor(self.name, self.low.number, self.natural(self.high), self.unit)


class FactorTable(Section):
    """All factors of a study."""

    factor: tuple[FactorSection, ...] = ()
    """The factors as written, in order."""

    @model_validator(mode="after")
    def _each_once(self) -> FactorTable:
        names = [section.name for section in self.factor]
        places = [place for section in self.factor for place in section.parameter]
        for key, values in (("name", names), ("parameter", places)):
            if twice := sorted({value for value in values if values.count(value) > 1}):
                raise ValueError(f"no two factors may have the same {key}; given twice: {', '.join(twice)}")
        return self


def natural_value(sections: Iterable[FactorSection], name: str, value: object) -> float:
    """Read a factor's value with its unit in natural units; ValueError where there is no such factor."""
    by_name = {section.name: section for section in sections}
    if name not in by_name:
        raise ValueError(f"must name a factor, {nearest_name(name, list(by_name))}")
    return by_name[name].natural(value)


def merge(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Merge one document over another, table by table; any other value replaces the one below it."""
    merged = dict(base)
    for key, value in over.items():
        below = merged.get(key)
        if isinstance(value, Mapping) and isinstance(below, Mapping):
            value = merge(below, value)
        merged[key] = value
    return merged


def rescaled(
    document: Mapping[str, Any], over: Mapping[str, Any], places: Places
) -> tuple[dict[str, Any], Places]:
    """Merge a scale over a document; its ``factor.NAME`` changes the factor of that name, or is refused."""
    changes, rows = over.get("factor"), document.get("factor")
    if not isinstance(changes, Mapping) or not isinstance(rows, list):
        return merge(document, over), places
    names = [str(value_at(row, ("name",))) for row in rows]
    for name, change in changes.items():
        place = places.of(("factor", name, *(list(change)[:1] if isinstance(change, Mapping) else ())))
        if not isinstance(change, Mapping):
            raise StudyError(place, "must be a table", change, "Write e.g. low = 0.2 in it.")
        if name not in names:
            raise StudyError(place, f"must name a factor, {nearest_name(name, names)}", name)
    merged = [merge(row, changes.get(name, {})) for name, row in zip(names, rows, strict=True)]
    return merge(document, {**over, "factor": merged}), places.numbered("factor", names)


def with_factor_values(
    document: Mapping[str, Any], sections: Iterable[FactorSection], settings: Mapping[str, float]
) -> dict[str, Any]:
    """Copy a document and write a value into every factor's parameter: the setting, or the factor's middle.

    Settings are values by factor name, in natural units.
    """
    written = dict(document)
    for section in sections:
        value = section.middle
        if section.name in settings:
            value = Quantity(settings[section.name], section.unit)
        for path in section.paths:
            written = merge(written, nested(path, value.written))
    return written


def check_one_home(document: Mapping[str, Any], sections: Iterable[FactorSection], places: Places) -> None:
    """Refuse a factor whose parameter also has a fixed value.

    Raises
    ------
    StudyError
        At the fixed value.
    """
    homes = [(section.name, path) for section in sections for path in section.paths]
    for name, path in homes:
        if (value := value_at(document, path)) is not None:
            problem = f"has a fixed value and is varied by the factor {name!r}"
            raise StudyError(places.of(path), problem, value, "Remove one of them.")
