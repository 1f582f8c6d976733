"""Distributions of a diameter, by number or by volume, from a table or a formula."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

NODES = 64
"""Gauss nodes of an integral over a class."""


class Distribution(Protocol):
    """Cumulative distribution of a diameter [m]; shares go from 0 to 1 with the diameter."""

    def quantile(self, share: float) -> float: ...

    def moment(self, power: int, low: float, high: float) -> float: ...


@dataclass(frozen=True)
class Tabulated:
    """Shares between diameters; within an interval the cumulative share is linear in the logarithm.

    An interval without width is a share of one diameter.
    """

    lows: tuple[float, ...]
    highs: tuple[float, ...]
    """Ends of the intervals, rising [m]."""
    shares: tuple[float, ...]
    """Share of each interval; the sum is 1."""

    @cached_property
    def _below(self) -> np.ndarray:
        """Share below each interval, and 1."""
        return np.concatenate([[0.0], np.cumsum(self.shares)]) / sum(self.shares)

    def quantile(self, share: float) -> float:
        """Return the diameter [m] of a share."""
        place = int(np.clip(np.searchsorted(self._below, share, side="left") - 1, 0, len(self.shares) - 1))
        return self._diameter(place, share)

    def moment(self, power: int, low: float, high: float) -> float:
        """Integrate a power of the diameter over the shares between two [m^power]."""
        total = 0.0
        for place in range(len(self.shares)):
            start, end = max(low, self._below[place]), min(high, self._below[place + 1])
            if end > start:
                total += (end - start) * _mean_power(
                    self._diameter(place, start), self._diameter(place, end), power
                )
        return float(total)

    def _diameter(self, place: int, share: float) -> float:
        start, end = self._below[place : place + 2]
        part = np.clip((share - start) / (end - start), 0.0, 1.0) if end > start else 0.0
        low, high = self.lows[place], self.highs[place]
        return float(low * (high / low) ** part)


def _mean_power(low: float, high: float, power: int) -> float:
    """Return the mean of a power of a diameter with an evenly distributed logarithm."""
    if high <= low * (1.0 + 1e-12):
        return low**power
    return float((high**power - low**power) / (power * np.log(high / low)))


@dataclass(frozen=True)
class Continuous:
    """Frozen distribution of ``scipy.stats``."""

    law: Any

    def quantile(self, share: float) -> float:
        """Return the diameter [m] of a share."""
        return float(self.law.ppf(share))

    def moment(self, power: int, low: float, high: float) -> float:
        """Integrate a power of the diameter over the shares between two [m^power]."""
        nodes, weights = np.polynomial.legendre.leggauss(NODES)
        if low > 0.0 and high < 1.0:
            # over the diameter, where the density is smooth
            ends = np.log(self.law.ppf([low, high]))
            diameters = np.exp(ends.mean() + np.ptp(ends) / 2 * nodes)
            return float(np.ptp(ends) / 2 * weights @ (diameters ** (power + 1) * self.law.pdf(diameters)))
        ends = self.law.ppf([max(low, 0.0), min(high, 1.0)])
        return float(self.law.expect(lambda d: d**power, lb=max(ends[0], 0.0), ub=ends[1]))
