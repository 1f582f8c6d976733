"""Meaning of the names in a discovery: titles, units, and numbers with both."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from doe.discrepancy import Interval
from experiments.report.kit.numbers import MISSING, enumeration, fixed, open_end, trimmed
from experiments.studyfile.factor_section import FactorSection
from experiments.studyfile.mechanism_factor import MechanismFactor
from experiments.studyfile.observables import Observable

SHOWN_UNITS = {"m": (1e3, "mm"), "deg": (1.0, "°"), "1": (1.0, "")}
"""Units that a reader likes better: the factor, and the unit."""

GAP = "\u00a0"
"""A space that does not break."""

SIZE_DIGITS = 3
"""Significant digits of the size of a mechanism."""


AT_MAXIMUM = 1e-6
"""Distance from the largest size below which an interval ends there, as a share: rounding of its coding."""


@dataclass(frozen=True)
class Terms:
    """The vocabulary of a page."""

    mechanisms: Mapping[str, MechanismFactor]
    observables: Mapping[str, Observable]
    factors: Mapping[str, FactorSection]

    @classmethod
    def of(
        cls,
        library: Sequence[MechanismFactor],
        observables: Sequence[Observable],
        factors: Sequence[FactorSection],
    ) -> Terms:
        """Collect the vocabulary by name."""
        return cls(
            {mechanism.name: mechanism for mechanism in library},
            {observable.name: observable for observable in observables},
            {factor.name: factor for factor in factors},
        )

    def title(self, name: str) -> str:
        """Name a mechanism in words; "base" is the model without one."""
        return self.mechanisms[name].title if name in self.mechanisms else spaced(name)

    def titles(self, names: Iterable[str], joined: str = "and") -> str:
        """Name mechanisms in words: "A", "A and B", "A, B and C"."""
        return enumeration(map(self.title, names), joined)

    def in_words(self, text: str) -> str:
        """Write a note with mechanisms and observables in words."""
        known = {*self.observables, *self.mechanisms}
        return re.sub(r"\w+", lambda word: self.title(word[0]) if word[0] in known else word[0], text)

    def value(self, name: str, value: float) -> str:
        """Write the size of a mechanism with its unit; `MISSING` where there is none."""
        if not math.isfinite(value):
            return MISSING
        return f"{trimmed(value, SIZE_DIGITS)}{self._unit(name)}"

    def size(self, name: str, size: Interval) -> str:
        """Write the size of a mechanism with its 90 % interval."""
        low, high = self._ends(name, size)
        return f"{self.value(name, size.value)} (90 % interval {low} to {high})"

    def short_size(self, name: str, size: Interval) -> str:
        """Write a size for a table: value, interval, unit."""
        low, high = self._ends(name, size)
        return f"{trimmed(size.value, SIZE_DIGITS)}{GAP}[{low},{GAP}{high}]{self._unit(name)}"

    def sizes(self, names: Sequence[str], sizes: Sequence[Interval]) -> str:
        """Write the sizes of several mechanisms in words."""
        return enumeration(self.size(name, size) for name, size in zip(names, sizes, strict=True))

    def scale(self, observable: str) -> tuple[float, str]:
        """Factor and unit in which an observable is shown."""
        unit = self.observables[observable].unit
        return SHOWN_UNITS.get(unit, (1.0, unit))

    def axis(self, observable: str) -> str:
        """Name an observable with the unit in which it is shown."""
        unit = self.scale(observable)[1]
        return f"{spaced(observable)} [{unit}]" if unit else spaced(observable)

    def at_maximum(self, name: str, size: Interval) -> bool:
        """Return True if a size's interval ends at the largest size that was explored."""
        return size.high >= self.mechanisms[name].maximum * (1.0 - AT_MAXIMUM)

    def _ends(self, name: str, size: Interval) -> tuple[str, str]:
        form = open_end("high") if self.at_maximum(name, size) else "{}"
        return trimmed(size.low, SIZE_DIGITS), form.format(trimmed(size.high, SIZE_DIGITS))

    def _unit(self, name: str) -> str:
        unit = self.mechanisms[name].unit.replace("^2", "²").replace("^3", "³")
        return {"1": "", "deg": "°"}.get(unit, f" {unit}")


def spaced(name: str) -> str:
    """Write a name of a table as words."""
    return name.replace("_", " ")


def percent(share: float, decimals: int = 0) -> str:
    """Write a share as a percentage."""
    return f"{fixed(100.0 * share, decimals)}{GAP}%"


def condition_name(condition: str, held_out: bool) -> str:
    """Name a condition, and say if it took no part in the fit."""
    return f"{condition} (held out)" if held_out else condition
