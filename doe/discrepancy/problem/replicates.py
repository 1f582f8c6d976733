"""Measured data: the observables of each replicate of each condition."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from doe.errors import RuleError


@dataclass(frozen=True)
class Calibration:
    """Standard deviations of what may be off alike in every measurement of one observable."""

    offset: float = 0.0
    """Added to every value, in its natural unit."""
    scale: float = 0.0
    """Share of every value."""
    instrument: str = ""
    """Name of what it was measured by: all observables of one instrument have one error of scale, each by its
    own standard deviation, as lengths that are read off one ruler; empty: the error is its own."""

    def __post_init__(self) -> None:
        for name in ("offset", "scale"):
            if not (math.isfinite(value := getattr(self, name)) and value >= 0.0):
                raise RuleError(f"Calibration.{name}", "must be a number, 0 or more", value)


@dataclass(frozen=True, eq=False)
class Measured:
    """Replicates measured under a few conditions, in the units of the simulator."""

    conditions: tuple[str, ...]
    """Conditions with at least one replicate."""
    observables: tuple[str, ...]
    """Columns of the values: what was measured in at least one replicate."""
    values: Mapping[str, np.ndarray]
    """By condition; NaN where an observable was not measured, and everywhere in the row of a replicate that
    failed, each (replicates, observables)."""
    reasons: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """By condition: reason of each replicate that failed, empty where it did not; left out: none did."""
    pictures: Mapping[str, tuple[Path, ...]] = field(default_factory=dict)
    """By condition: pictures that came with the data."""
    calibration: Mapping[str, Calibration] = field(default_factory=dict)
    """By observable, what its instrument may be off by in all conditions; left out: nothing."""
    views: Mapping[str, float] = field(default_factory=dict)
    """By condition: azimuth that it was seen from [deg]; left out: 0, as the simulator is."""
    kinds: tuple[tuple[str, ...], ...] = ()
    """Observables that are measured in one unit, which a slip of units takes all together."""
    notes: tuple[str, ...] = ()
    """Remarks that a reader must know: too few replicates, values that contradict one another, ..."""

    def __post_init__(self) -> None:
        for what, names in (("conditions", self.conditions), ("observables", self.observables)):
            if not names or len(set(names)) < len(names):
                raise RuleError(f"Measured.{what}", "needs at least one, each once", names)
        if set(self.values) != set(self.conditions):
            raise RuleError("Measured.values", "holds every condition and no other", sorted(self.values))
        if strange := [name for name in self.calibration if name not in self.observables]:
            raise RuleError("Measured.calibration", "is of measured observables", strange)
        formed = {name: tuple("" for _ in rows) for name, rows in self.values.items()}
        object.__setattr__(self, "reasons", {**formed, **self.reasons})
        for name, rows in self.values.items():
            self._check(name, np.asarray(rows))

    def _check(self, name: str, rows: np.ndarray) -> None:
        place = f"Measured.values[{name!r}]"
        if rows.ndim != 2 or len(rows) == 0 or rows.shape[1] != len(self.observables):
            rule = f"is a row a replicate, with a column for each of {len(self.observables)} observables"
            raise RuleError(place, rule, f"shape {rows.shape}")
        if np.isinf(rows).any():
            raise RuleError(place, "is finite, or NaN where nothing was measured", "an infinite value")
        if len(self.reasons[name]) != len(rows):
            rule = "has one entry a replicate, empty where it did not fail"
            raise RuleError(f"Measured.reasons[{name!r}]", rule, self.reasons[name])
        if np.isfinite(rows[[bool(reason) for reason in self.reasons[name]]]).any():
            raise RuleError(place, "is NaN in the row of a replicate that failed", "a number")

    def finished_count(self, condition: str) -> int:
        """Replicates of a condition that did not fail."""
        return sum(not reason for reason in self.reasons[condition])

    def counts(self, condition: str) -> np.ndarray:
        """Replicates in which each observable was measured, (observables,)."""
        return np.isfinite(self.values[condition]).sum(axis=0)

    def mean(self, condition: str) -> np.ndarray:
        """Mean of each observable over the replicates that have it, (observables,); NaN where none has."""
        rows, counts = self.values[condition], self.counts(condition)
        sums = np.where(np.isfinite(rows), rows, 0.0).sum(axis=0)
        return np.divide(sums, counts, out=np.full(len(counts), np.nan), where=counts > 0)

    def covariance(self, condition: str) -> np.ndarray:
        """Covariance of one replicate, (observables, observables), over the replicates that have both.

        s_ij = sum over those of (x_i - mean_i)(x_j - mean_j), over their number less 1, the means over the
        same replicates; NaN where fewer than two have both.
        """
        rows = self.values[condition]
        size = rows.shape[1]
        covariance = np.full((size, size), np.nan)
        for i in range(size):
            for j in range(i, size):
                both = rows[np.isfinite(rows[:, i]) & np.isfinite(rows[:, j])][:, [i, j]]
                if len(both) >= 2:
                    deviation = both - both.mean(axis=0)
                    covariance[i, j] = covariance[j, i] = np.prod(deviation, axis=1).sum() / (len(both) - 1)
        return covariance

    def only(self, observables: Iterable[str]) -> Measured:
        """Keep some observables, in their order here; replicates stay, even those that have none left.

        Raises
        ------
        RuleError
            When none of them was measured.
        """
        wanted = set(observables)
        kept = [index for index, name in enumerate(self.observables) if name in wanted]
        if not kept:
            rule = f"must name measured observables, of {', '.join(self.observables)}"
            raise RuleError("observables", rule, sorted(wanted))
        names = tuple(self.observables[index] for index in kept)
        return replace(
            self,
            observables=names,
            values={name: rows[:, kept] for name, rows in self.values.items()},
            kinds=tuple(tuple(name for name in kind if name in names) for kind in self.kinds),
            calibration={name: one for name, one in self.calibration.items() if name in names},
        )
