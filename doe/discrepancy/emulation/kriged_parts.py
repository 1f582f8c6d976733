"""Kriged parts of an emulator as a fit chose them, kept with its bank.

The search for lengths takes nearly all of a fit, and rounding may decide if a polynomial fails.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from doe.errors import RuleError
from doe.numerics.kriging import Covariance, Kriging, fit_kriging, krige

BETTER = 0.97
"""Ratio of mean squares of leave-one-out errors below which kriging is kept."""
BASE = -1
"""Number that means no mechanism."""
_PLACE = 3
"""Columns of a table that identify the part in a row."""


@dataclass(frozen=True, eq=False)
class KrigedParts:
    """Covariances of the parts that are kriged; all others are polynomials alone."""

    runs: str
    """Hash of the runs that they were found from (`Bank.runs_sha256`)."""
    covariances: Mapping[tuple[int, int], Mapping[int, Covariance]]
    """Covariances by numbers of condition and mechanism (`BASE`: without one), then by column of the
    emulator."""

    @classmethod
    def of(cls, runs: str, kriging: Mapping[tuple[int, int], Mapping[int, Kriging]]) -> KrigedParts:
        """Take the covariances out of fitted surfaces."""
        parts = {key: {column: one.covariance for column, one in own.items()} for key, own in kriging.items()}
        return cls(runs, parts)

    def of_surface(self, condition: int, mechanism: int) -> Mapping[int, Covariance]:
        """Return the covariances of one surface by column."""
        return self.covariances.get((condition, mechanism), {})

    def table(self) -> np.ndarray:
        """Return a row for each part: condition, mechanism, column, amplitude, lengths, NaN beyond them."""
        rows = [
            np.array([*place, column, one.amplitude, *one.length])
            for place, own in self.covariances.items()
            for column, one in own.items()
        ]
        widest = max((len(row) for row in rows), default=_PLACE + 1)
        filled = [np.append(row, np.full(widest - len(row), np.nan)) for row in rows]
        return np.array(filled).reshape(-1, widest)

    @classmethod
    def from_table(cls, runs: str, table: np.ndarray) -> KrigedParts:
        """Read the table that `table` returned.

        Raises RuleError: a place that is no whole number, or an amplitude or a length that is not positive.
        """
        if table.ndim != 2 or table.shape[1] <= _PLACE or table.dtype.kind != "f":
            raise RuleError("Bank.kriged", "must be a table of numbers, a row for each part", table.shape)
        parts: dict[tuple[int, int], dict[int, Covariance]] = {}
        for row in table:
            scales = row[_PLACE:][~np.isnan(row[_PLACE:])]
            if not (np.isfinite(scales).all() and (scales > 0.0).all() and len(scales) > 1):
                raise RuleError("Bank.kriged", "must have positive amplitudes and lengths", row)
            if not (row[:_PLACE] == np.round(row[:_PLACE])).all() or row[:_PLACE].min() < BASE or row[2] < 0:
                raise RuleError("Bank.kriged", "must number its parts by whole numbers", row)
            condition, mechanism, column = (int(number) for number in row[:_PLACE])
            parts.setdefault((condition, mechanism), {})[column] = Covariance(float(scales[0]), scales[1:])
        return cls(runs, parts)


@dataclass(frozen=True, eq=False)
class Rest:
    """Part of some runs that polynomials miss, in columns (n, observables)."""

    points: np.ndarray
    """Coded points, (n, parameters)."""
    missed: np.ndarray
    noise: np.ndarray
    """Missed values, and variances of their noise."""
    weights: np.ndarray
    """Weights of the squares that are compared where a run is left out."""

    def kriged(self, suspects: np.ndarray, known: Mapping[int, Covariance] | None) -> dict[int, Kriging]:
        """Krige the known columns, or the suspect ones, and keep those of these that improve."""
        if known is not None:
            return {column: self._as_known(column, covariance) for column, covariance in known.items()}
        columns = np.flatnonzero(suspects).tolist()
        found = {column: fit_kriging(*self._data(column)) for column in columns}
        return {column: one for column, one in found.items() if self._is_better(column, one)}

    def _as_known(self, column: int, covariance: Covariance) -> Kriging:
        if column >= self.missed.shape[1] or len(covariance.length) != self.points.shape[1]:
            rule = "must have kriged parts of its own columns and factors"
            raise RuleError("Bank.kriged", rule, f"column {column}, {len(covariance.length)} lengths")
        try:
            return krige(*self._data(column), covariance)
        except (np.linalg.LinAlgError, ValueError) as error:
            rule = "must have kriged parts whose covariance can be inverted"
            raise RuleError("Bank.kriged", rule, f"an amplitude of {covariance.amplitude:g}") from error

    def _data(self, column: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.points, self.missed[:, column], self.noise[:, column]

    def _is_better(self, column: int, smooth: Kriging) -> bool:
        weights, plain = self.weights[:, column], self.missed[:, column]
        return bool(np.mean(weights * smooth.leave_one_out**2) < BETTER * np.mean(weights * plain**2))
