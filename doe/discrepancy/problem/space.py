"""What is free in a search for a missing mechanism: factors, sizes of mechanisms, conditions.

The statistics work in coded units: factors from -1 to 1 over their range, sizes from 0 at the null to 1 at
the maximum. A row of coded parameters is all factors, then the sizes of the mechanisms that are in the model.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from experiments.discover.library import Mechanism
from experiments.discover.simulator import Point
from experiments.errors import InputError
from experiments.studyfile import Study

CODED_DIGITS = 9
"""Decimals of the coded parameters of a case."""


@dataclass(frozen=True)
class MechanismRange:
    """A mechanism of the library, as the statistics see it.

    Attributes
    ----------
    name : str
    null, maximum : float
        Where it is absent and the end of its range, in its natural units.
    """

    name: str
    null: float
    maximum: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.null) and math.isfinite(self.maximum)) or self.null == self.maximum:
            raise InputError("needs a null and another maximum", (self.null, self.maximum), self.name)


@dataclass(frozen=True)
class SearchSpace:
    """Names and ranges of everything that may vary.

    Attributes
    ----------
    factors : tuple of str
        Names of the study's factors.
    lower, upper : tuple of float
        Their ranges in natural units.
    conditions : tuple of str
    held_out : tuple of bool
        Whether each condition takes no part in any fit.
    mechanisms : tuple of MechanismRange
        The library.
    """

    factors: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    conditions: tuple[str, ...]
    held_out: tuple[bool, ...]
    mechanisms: tuple[MechanismRange, ...] = field(default=())

    def __post_init__(self) -> None:
        if not len(self.factors) == len(self.lower) == len(self.upper) or not self.factors:
            raise InputError(
                "needs a range for each of at least one factor", self.factors, "SearchSpace.factors"
            )
        for name, low, high in zip(self.factors, self.lower, self.upper, strict=True):
            if not low < high:
                raise InputError("must run from its lower to its upper end", (low, high), f"factor {name}")
        if len(self.held_out) != len(self.conditions) or all(self.held_out):
            raise InputError("needs at least one condition to fit", self.conditions, "SearchSpace.conditions")
        names = [*self.conditions, *self.factors, *(m.name for m in self.mechanisms)]
        if len(set(names)) < len(names):
            raise InputError(
                "are named once each", names, "conditions, factors and mechanisms of SearchSpace"
            )

    @classmethod
    def of(cls, study: Study, library: Sequence[Mechanism]) -> SearchSpace:
        """Collect what varies in a search with a study and mechanisms of its library."""
        return cls(
            tuple(factor.name for factor in study.factors),
            tuple(factor.low for factor in study.factors),
            tuple(factor.high for factor in study.factors),
            tuple(condition.name for condition in study.conditions),
            tuple(condition.held_out for condition in study.conditions),
            tuple(MechanismRange(one.name, one.null, one.maximum) for one in library),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the mechanisms."""
        return tuple(mechanism.name for mechanism in self.mechanisms)

    def mechanism(self, name: str) -> MechanismRange:
        """Return the mechanism of a name."""
        for mechanism in self.mechanisms:
            if mechanism.name == name:
                return mechanism
        raise InputError(f"must be a mechanism of the library, one of {', '.join(self.names)}", name, "name")

    def without(self, *names: str) -> SearchSpace:
        """Return the same space with some mechanisms withheld."""
        kept = tuple(mechanism for mechanism in self.mechanisms if mechanism.name not in names)
        return replace(self, mechanisms=kept)

    def is_held_out(self, condition: str) -> bool:
        """Whether a condition takes no part in any fit."""
        return self.held_out[self.conditions.index(condition)]

    def natural_theta(self, coded: np.ndarray) -> np.ndarray:
        """Factors in natural units, same shape (..., factors)."""
        lower, upper = np.array(self.lower), np.array(self.upper)
        return lower + (np.asarray(coded) + 1.0) / 2.0 * (upper - lower)

    def coded_theta(self, natural: np.ndarray) -> np.ndarray:
        """Factors in coded units, same shape (..., factors)."""
        lower, upper = np.array(self.lower), np.array(self.upper)
        return 2.0 * (np.asarray(natural) - lower) / (upper - lower) - 1.0

    def natural_size(self, name: str, coded: float) -> float:
        """Size of a mechanism in its natural units."""
        mechanism = self.mechanism(name)
        return mechanism.null + float(coded) * (mechanism.maximum - mechanism.null)

    def coded_size(self, name: str, natural: float) -> float:
        """Size of a mechanism in coded units."""
        mechanism = self.mechanism(name)
        return (natural - mechanism.null) / (mechanism.maximum - mechanism.null)

    def point(self, coded: np.ndarray, mechanisms: tuple[str, ...], condition: str, seed: int) -> Point:
        """Return the case of one row of coded parameters.

        Rounded, so that the last bits of a host's linear algebra make no other case.
        """
        coded = np.round(coded, CODED_DIGITS)
        theta = self.natural_theta(coded[: len(self.factors)])
        sizes = zip(mechanisms, coded[len(self.factors) :], strict=True)
        natural = sorted((name, self.natural_size(name, size)) for name, size in sizes)
        return Point(tuple(float(value) for value in theta), tuple(natural), condition, seed)
