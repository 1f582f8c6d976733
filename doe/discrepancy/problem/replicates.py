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
    """Standard deviations of the calibration errors that all measurements of one observable share."""

    offset: float = 0.0
    """Offset of every value, in its natural unit."""
    scale: float = 0.0
    """Relative error of every value."""
    instrument: str = ""
    """Name of the instrument: its observables share one error of scale, each by its own standard deviation,
    e.g. lengths that are read off one ruler. Empty: the error is the observable's own."""

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
    """Columns of the values: observables measured in at least one replicate."""
    values: Mapping[str, np.ndarray]
    """Values by condition, each (replicates, observables); NaN where an observable was not measured, and in
    the whole row of a failed replicate."""
    reasons: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Reason of each failed replicate by condition, empty for the others. Default: none failed."""
    pictures: Mapping[str, tuple[Path, ...]] = field(default_factory=dict)
    """Pictures of the data by condition."""
    calibration: Mapping[str, Calibration] = field(default_factory=dict)
    """Calibration error by observable, the same in all conditions. Default: no error."""
    views: Mapping[str, float] = field(default_factory=dict)
    """Azimuth of the view by condition [deg]. Default: 0, as in the simulator."""
    kinds: tuple[tuple[str, ...], ...] = ()
    """Observables measured in one unit, which a slip of units affects together."""
    notes: tuple[str, ...] = ()
    """Remarks for the reader: too few replicates, values that contradict one another, ..."""

    def __post_init__(self) -> None:
        for what, names in (("conditions", self.conditions), ("observables", self.observables)):
            if not names or len(set(names)) < len(names):
                raise RuleError(f"Measured.{what}", "must be at least one, each once", names)
        if set(self.values) != set(self.conditions):
            raise RuleError("Measured.values", "must be by condition, for all of them", sorted(self.values))
        if strange := [name for name in self.calibration if name not in self.observables]:
            raise RuleError("Measured.calibration", "must be of measured observables", strange)
        formed = {name: tuple("" for _ in rows) for name, rows in self.values.items()}
        object.__setattr__(self, "reasons", {**formed, **self.reasons})
        for name, rows in self.values.items():
            self._check(name, np.asarray(rows))

    def _check(self, name: str, rows: np.ndarray) -> None:
        place = f"Measured.values[{name!r}]"
        if rows.ndim != 2 or len(rows) == 0 or rows.shape[1] != len(self.observables):
            rule = f"must have a row per replicate and {len(self.observables)} columns, one per observable"
            raise RuleError(place, rule, f"shape {rows.shape}")
        if np.isinf(rows).any():
            raise RuleError(place, "must be finite, or NaN where nothing was measured", "an infinite value")
        if len(self.reasons[name]) != len(rows):
            rule = "must have one entry per replicate, empty where it did not fail"
            raise RuleError(f"Measured.reasons[{name!r}]", rule, self.reasons[name])
        if np.isfinite(rows[[bool(reason) for reason in self.reasons[name]]]).any():
            raise RuleError(place, "must be NaN in the row of a failed replicate", "a number")

    def finished_count(self, condition: str) -> int:
        """Return the number of replicates of a condition that did not fail."""
        return sum(not reason for reason in self.reasons[condition])

    def counts(self, condition: str) -> np.ndarray:
        """Return the number of replicates with each observable, (observables,)."""
        return np.isfinite(self.values[condition]).sum(axis=0)

    def mean(self, condition: str) -> np.ndarray:
        """Return the mean of each observable over the replicates that have it; NaN without replicates."""
        rows, counts = self.values[condition], self.counts(condition)
        sums = np.where(np.isfinite(rows), rows, 0.0).sum(axis=0)
        return np.divide(sums, counts, out=np.full(len(counts), np.nan), where=counts > 0)

    def covariance(self, condition: str) -> np.ndarray:
        """Return the covariance of one replicate, (observables, observables).

        s_ij = sum of (x_i - mean_i)(x_j - mean_j) over the replicates that have both, over their number less
        1, with the means over the same replicates; NaN where fewer than two have both.
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
        """Keep some observables, in their order here; all replicates stay.

        Raises
        ------
        RuleError
            None of them was measured.
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
