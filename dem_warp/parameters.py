"""Parameters that a person sets: numbers that know their unit and their bounds.

A scene or a law states both once, in the type of a field: ``Annotated[float, Parameter("m", above=0.0)]``.
The object checks itself by them, and whatever reads the parameter from a file takes them from here.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import get_type_hints

UNITS = (
    "1", "m", "m^3", "s", "1/s", "Hz", "m/s", "kg", "kg/s", "kg/m^3", "N", "N/m", "Pa", "J/m^2", "J/m^3",
    "rad",
)  # fmt: skip
"""Units that a parameter may have; a study file knows a dimension for each."""


LATER = {"later": True}
"""Metadata of a field that came after cases had keys: at its default a case does not tell of it, so that its
key stays."""


@dataclass(frozen=True)
class Parameter:
    """Unit and bounds of a number, which is finite in any case.

    Raises
    ------
    ValueError
        When the unit is not one of `UNITS`.
    """

    unit: str
    """Its SI unit, as ``"kg/m^3"``; ``"1"``: none."""
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None

    def __post_init__(self) -> None:
        if self.unit not in UNITS:
            raise ValueError(f"Parameter.unit: must be one of {', '.join(UNITS)}, got {self.unit!r}")

    def breach(self, value: float) -> str:
        """Rule that a value breaks, with the unit; empty where it breaks none."""
        unit = "" if self.unit == "1" else f" [{self.unit}]"
        return f"must be {rule}{unit}" if (rule := self._broken(value)) else ""

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
    for name, parameter in parameters_of(type(instance)).items():  # type: ignore[arg-type]
        value = getattr(instance, name)
        if value is not None and (rule := parameter.breach(value)):
            raise ValueError(f"{type(instance).__name__}.{name}: {rule}, got {value!r}")
