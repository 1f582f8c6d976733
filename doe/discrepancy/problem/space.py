"""Space of a search: factors, sizes of mechanisms, conditions.

A size is in natural units; a coded size is 0 at the null and 1 at the maximum, and the effect grows evenly
with it. Coded factors are -1 to 1 over their range. A row of coded parameters is all factors, then the coded
sizes of the mechanisms in the model.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from doe.discrepancy.problem.outcomes import Point
from doe.errors import RuleError

CODED_DIGITS = 9
"""Decimals of the coded parameters of a case."""

LEAST_SATURATION = 0.01
"""Least saturation, in ranges of sizes: below it all sizes but the smallest are the same."""


@dataclass(frozen=True)
class MechanismRange:
    """A mechanism of the library: an effect that the simulator can have beyond its base model."""

    name: str
    null: float
    maximum: float
    """Size without effect, and the end of its range, in its natural unit."""
    directed: bool = False
    """True if it has a direction, an azimuth; the simulator has it at azimuth 0."""
    saturation: float | None = None
    """Distance from the null over which the effect of a step falls to 1/e; None: the same effect everywhere.
    """
    removal: str = ""
    """Instruction that takes it away for a test; empty if there is none."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.null) and math.isfinite(self.maximum)) or self.null == self.maximum:
            raise RuleError(self.name, "must have a null and another maximum", (self.null, self.maximum))
        least = LEAST_SATURATION * abs(self.width)
        if self.saturation is not None and not least <= self.saturation < math.inf:
            rule = f"must saturate over at least a hundredth of its range ({least:.6g})"
            raise RuleError(self.name, rule, self.saturation)

    def coded(self, natural: float) -> float:
        """Return the coded size of a size."""
        share = (natural - self.null) / self.width
        return share if self.saturation is None else math.expm1(-share * self._fall) / math.expm1(-self._fall)

    def natural(self, coded: float) -> float:
        """Return the size of a coded size."""
        if self.saturation is None:
            return self.null + coded * self.width
        left = 1.0 + coded * math.expm1(-self._fall)
        return self.null - math.log(max(left, math.exp(-self._fall))) / self._fall * self.width

    @property
    def width(self) -> float:
        """Maximum less null."""
        return self.maximum - self.null

    @property
    def _fall(self) -> float:
        """Range of sizes, in saturations."""
        return abs(self.width) / (self.saturation or math.inf)


@dataclass(frozen=True)
class SearchSpace:
    """Names and ranges of factors, conditions and mechanisms."""

    factors: tuple[str, ...]
    """Names of the parameters that every calibration adjusts."""
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    """Ranges of the factors in natural units."""
    conditions: tuple[str, ...]
    held_out: tuple[bool, ...]
    """True where a condition takes no part in any fit."""
    mechanisms: tuple[MechanismRange, ...] = field(default=())
    """The library."""
    odd: tuple[str, ...] = field(default=())
    """Observables that change sign in a mirror which changes no condition, factor or mechanism except the
    directed ones: without a directed mechanism they are noise only."""

    def __post_init__(self) -> None:
        if not len(self.factors) == len(self.lower) == len(self.upper) or not self.factors:
            raise RuleError("SearchSpace.factors", "must be at least one, each with a range", self.factors)
        for name, low, high in zip(self.factors, self.lower, self.upper, strict=True):
            if not low < high:
                raise RuleError(f"factor {name}", "must have a lower end below its upper end", (low, high))
        if len(self.held_out) != len(self.conditions) or all(self.held_out):
            raise RuleError("SearchSpace.conditions", "must have at least one to fit", self.conditions)
        names = [*self.conditions, *self.factors, *(m.name for m in self.mechanisms)]
        if len(set(names)) < len(names):
            raise RuleError("SearchSpace", "must name each condition, factor and mechanism once", names)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the mechanisms."""
        return tuple(mechanism.name for mechanism in self.mechanisms)

    def mechanism(self, name: str) -> MechanismRange:
        """Return the mechanism of a name."""
        for mechanism in self.mechanisms:
            if mechanism.name == name:
                return mechanism
        raise RuleError("name", f"must be a mechanism of the library, one of {', '.join(self.names)}", name)

    def without(self, *names: str) -> SearchSpace:
        """Return the same space with some mechanisms withheld."""
        kept = tuple(mechanism for mechanism in self.mechanisms if mechanism.name not in names)
        return replace(self, mechanisms=kept)

    def is_held_out(self, condition: str) -> bool:
        """Return True if a condition takes no part in any fit."""
        return self.held_out[self.conditions.index(condition)]

    def natural_theta(self, coded: np.ndarray) -> np.ndarray:
        """Return factors in natural units, same shape (..., factors)."""
        lower, upper = np.array(self.lower), np.array(self.upper)
        return lower + (np.asarray(coded) + 1.0) / 2.0 * (upper - lower)

    def coded_theta(self, natural: np.ndarray) -> np.ndarray:
        """Return factors in coded units, same shape (..., factors)."""
        lower, upper = np.array(self.lower), np.array(self.upper)
        return 2.0 * (np.asarray(natural) - lower) / (upper - lower) - 1.0

    def natural_size(self, name: str, coded: float) -> float:
        """Return a mechanism's size in its natural unit."""
        return self.mechanism(name).natural(float(coded))

    def coded_size(self, name: str, natural: float) -> float:
        """Return a mechanism's size in coded units."""
        return self.mechanism(name).coded(natural)

    def point(self, coded: np.ndarray, mechanisms: tuple[str, ...], condition: str, seed: int) -> Point:
        """Return the case of one row of coded parameters.

        They are rounded, so that the last bits of a host's linear algebra make no other case.
        """
        coded = np.round(coded, CODED_DIGITS)
        theta = self.natural_theta(coded[: len(self.factors)])
        sizes = zip(mechanisms, coded[len(self.factors) :], strict=True)
        natural = sorted((name, self.natural_size(name, size)) for name, size in sizes)
        return Point(tuple(float(value) for value in theta), tuple(natural), condition, seed)
