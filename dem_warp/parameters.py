"""Parameters that a person sets: numbers with unit and bounds, and named choices.

The type of a field has both: ``Annotated[float, Parameter("m", above=0.0)]``.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, get_args, get_origin, get_type_hints

UNITS = (
    "1", "m", "m^3", "s", "1/s", "Hz", "m/s", "kg", "kg/s", "kg/m^3", "N", "N/m", "Pa", "J/m^2", "J/m^3",
    "rad",
)  # fmt: skip
"""Units that a parameter may have; a study file knows a dimension for each."""


LATER = {"later": True}
"""Metadata of a field added after cases had keys: at its default it is not in the key, which stays valid."""


@dataclass(frozen=True)
class Parameter:
    """Unit and bounds of a finite number."""

    unit: str
    """SI unit, e.g. ``"kg/m^3"``; ``"1"`` for a number without unit."""
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None

    def __post_init__(self) -> None:
        require_choice("Parameter.unit", self.unit, UNITS)

    def check(self, place: str, value: float) -> None:
        """Raise ValueError with the place and the rule that a value breaks, if any."""
        if rule := self._broken(value):
            unit = "" if self.unit == "1" else f" [{self.unit}]"
            raise ValueError(f"{place}: must be {rule}{unit}, got {value!r}")

    def _broken(self, value: float) -> str:
        if self.above is not None and not self.above < value < math.inf:
            return f"{f'above {self.above:g}' if self.above else 'positive'} and finite"
        if self.at_least == 0.0 and not 0.0 <= value < math.inf:
            return "finite and 0 or more"
        if not math.isfinite(value):
            return "finite"
        if self.at_least is not None and value < self.at_least:
            return f"at least {self.at_least:g}"
        if self.below is not None and value >= self.below:
            return f"below {self.below:g}"
        if self.at_most is not None and value > self.at_most:
            return f"at most {self.at_most:g}"
        return ""


@cache
def parameters_of(kind: type) -> dict[str, Parameter]:
    """Return the parameters of a dataclass by name, in the order of its fields."""
    hints = get_type_hints(kind, include_extras=True)
    for name, hint in hints.items():
        if hint in (float, int, float | None, int | None):
            raise TypeError(f"{kind.__name__}.{name}: a number needs its unit and bounds, a Parameter")
    marks = ((name, mark) for name, hint in hints.items() for mark in getattr(hint, "__metadata__", ()))
    return {name: mark for name, mark in marks if isinstance(mark, Parameter)}


@cache
def choices_of(kind: type) -> dict[str, tuple[Any, ...]]:
    """Return the values that each field with named choices (Literal) may have, by field."""
    hints = get_type_hints(kind)
    return {name: get_args(hint) for name, hint in hints.items() if get_origin(hint) is Literal}


def check_parameters(instance: object) -> None:
    """Check every parameter and every named choice of a dataclass; None passes if it is optional."""
    kind: Any = type(instance)
    for name, known in choices_of(kind).items():
        require_choice(f"{kind.__name__}.{name}", getattr(instance, name), known)
    for name, parameter in parameters_of(kind).items():
        if (value := getattr(instance, name)) is not None:
            parameter.check(f"{kind.__name__}.{name}", value)


def require_choice(place: str, value: Any, known: tuple[Any, ...]) -> None:
    """Raise ValueError with the place unless a value is one of the known ones."""
    if value not in known:
        raise ValueError(f"{place}: must be one of {', '.join(map(str, known))}, got {value!r}")
