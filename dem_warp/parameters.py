"""Parameters that a person sets: numbers that know their unit and their bounds.

A scene or a law states both once, in the type of a field: ``Annotated[float, Parameter("m", above=0.0)]``.
The object checks itself by them, and whatever reads the parameter from a file takes them from here.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import get_type_hints


@dataclass(frozen=True)
class Parameter:
    """Unit and bounds of a number, which is finite in any case."""

    unit: str
    """Its SI unit, as ``"kg/m^3"``; ``"1"``: none."""
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None

    def breach(self, value: float) -> str:
        """Say which rule a value breaks; empty where it breaks none."""
        low = -math.inf if self.at_least is None else self.at_least
        if not (math.isfinite(value) and value >= low and (self.above is None or value > self.above)):
            return self._lower_rule
        unit = "" if self.unit == "1" else f" [{self.unit}]"
        if self.below is not None and not value < self.below:
            return f"must be below {self.below:g}{unit}"
        if self.at_most is not None and not value <= self.at_most:
            return f"must be at most {self.at_most:g}{unit}"
        return ""

    @property
    def _lower_rule(self) -> str:
        if self.at_least is not None:
            return f"must be finite and {self.at_least:g} or more"
        if self.above is not None:
            return f"must be {f'above {self.above:g}' if self.above else 'positive'} and finite"
        return "must be finite"


@cache
def parameters_of(kind: type) -> dict[str, Parameter]:
    """Parameters of a dataclass by name, in the order of its fields.

    Raises
    ------
    TypeError
        When a field is a number without unit and bounds.
    """
    hints = get_type_hints(kind, include_extras=True)
    for name, hint in hints.items():
        if hint in (float, int, float | None, int | None):
            raise TypeError(f"{kind.__name__}.{name}: a number needs its unit and bounds, a Parameter")
    marks = ((name, mark) for name, hint in hints.items() for mark in getattr(hint, "__metadata__", ()))
    return {name: mark for name, mark in marks if isinstance(mark, Parameter)}


def check_parameters(instance: object) -> None:
    """Check every parameter of a dataclass; one that may be left out may be None.

    Raises
    ------
    ValueError
        With class and field, the rule and the value received.
    """
    for name, parameter in parameters_of(type(instance)).items():
        value = getattr(instance, name)
        if value is not None and (rule := parameter.breach(value)):
            raise ValueError(f"{type(instance).__name__}.{name}: {rule}, got {value!r}")
