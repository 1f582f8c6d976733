"""Parts of an emulator that are kriged, as a fit chose them: kept with its bank, nobody need search again.

The search for lengths takes nearly all of a fit, and on the threshold of `FAILURE_LEVEL` rounding may decide.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from doe.discrepancy.emulation.kriging import Covariance, Kriging
from doe.errors import RuleError

BASE = -1
"""Number that stands for no mechanism."""
_PLACE = 3
"""Columns of a table that say which part a row is."""


@dataclass(frozen=True, eq=False)
class KrigedParts:
    """Covariances of the parts that are kriged; all others are polynomials alone."""

    runs: str
    """Hash of the runs that they were found from (`Bank.runs_sha256`)."""
    covariances: Mapping[tuple[int, int], Mapping[int, Covariance]]
    """By numbers of condition and mechanism (`BASE`: without one), then by column of the emulator."""

    @classmethod
    def of(cls, runs: str, kriging: Mapping[tuple[int, int], Mapping[int, Kriging]]) -> KrigedParts:
        """Take the covariances out of fitted surfaces."""
        parts = {key: {column: one.covariance for column, one in own.items()} for key, own in kriging.items()}
        return cls(runs, parts)

    def of_surface(self, condition: int, mechanism: int) -> Mapping[int, Covariance]:
        """Covariances of one surface by column."""
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
        """Read what `table` returned.

        Raises
        ------
        RuleError
            When a place is no whole number, or an amplitude or a length is not positive.
        """
        if table.ndim != 2 or table.shape[1] <= _PLACE or table.dtype.kind != "f":
            raise RuleError("is a table of numbers, a row for each part", table.shape, "Bank.kriged")
        parts: dict[tuple[int, int], dict[int, Covariance]] = {}
        for row in table:
            scales = row[_PLACE:][~np.isnan(row[_PLACE:])]
            if not (np.isfinite(scales).all() and (scales > 0.0).all() and len(scales) > 1):
                raise RuleError("has positive amplitudes and lengths", row, "Bank.kriged")
            if not (row[:_PLACE] == np.round(row[:_PLACE])).all() or row[:_PLACE].min() < BASE or row[2] < 0:
                raise RuleError("numbers its parts by whole numbers", row, "Bank.kriged")
            condition, mechanism, column = (int(number) for number in row[:_PLACE])
            parts.setdefault((condition, mechanism), {})[column] = Covariance(float(scales[0]), scales[1:])
        return cls(runs, parts)
