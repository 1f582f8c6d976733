"""Scatter of measured replicates beside that of the model: of the runs themselves, and of their readings.

Observables of one run scatter together, as the model's do. Readings err each by itself. So of what replicates
scatter beyond the model, the part that keeps its correlations is the runs', and the rest is the readings'.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from doe.discrepancy.problem.replicates import Measured


@dataclass(frozen=True, eq=False)
class Scatter:
    """Deviations of the replicates of all conditions from their means."""

    products: Mapping[str, np.ndarray]
    """By condition: sums of the products of two observables' deviations, over the replicates that have both,
    (observables, observables)."""
    freedom: Mapping[str, np.ndarray]
    """Degrees of freedom of those sums."""

    @classmethod
    def of(cls, measured: Measured, observables: Sequence[str], conditions: Sequence[str]) -> Scatter:
        """Collect those of some conditions; an observable that was not measured has no degrees of freedom."""
        own = [measured.observables.index(name) for name in observables if name in measured.observables]
        at = [column for column, name in enumerate(observables) if name in measured.observables]
        products, freedom = {}, {}
        for condition in conditions:
            rows = measured.values[condition][:, own]
            present = np.isfinite(rows).astype(float)
            size = len(observables)
            counts, sums = np.zeros((size, size)), np.zeros((size, size))
            counts[np.ix_(at, at)] = np.maximum(present.T @ present - 1.0, 0.0)
            covariance = measured.covariance(condition)[np.ix_(own, own)]
            sums[np.ix_(at, at)] = np.where(np.isfinite(covariance), covariance, 0.0)
            products[condition], freedom[condition] = sums * counts, counts
        return cls(products, freedom)

    def excess(self, covariances: Mapping[str, np.ndarray], known: float, size: int) -> Excess:
        """Estimate what the replicates scatter more than a model.

        In standard deviations of the model the mean product of the deviations of two observables is

            M_ij = h R_ij + d_ij r_i,

        R being the model's correlation: h comes from the products of different observables, r from what it
        leaves of the squares. h and the mean of all r are as much nearer to nothing as their standard errors
        make them (James and Stein 1961, positive part), each r nearer to that mean (Efron and Morris 1973).
        Less scatter than the model's is chance.

        Parameters
        ----------
        covariances : mapping
            By condition, that of one run of the model, (observables, observables).
        known : float
            Degrees of freedom that it comes from.
        size : int
            Number of the observables.
        """
        moments, likeness, freedom = np.zeros((3, size, size))
        for condition, products in self.products.items():
            covariance = covariances[condition]
            scale = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
            moments += products / scale
            likeness += self.freedom[condition] * covariance / scale
            freedom += self.freedom[condition]
        seen = np.diag(freedom) > 0.0
        if not seen.any():
            return Excess(1.0, np.zeros(size))
        part = np.ix_(seen, seen)
        weight = np.maximum(freedom[part], 1.0)
        reading = np.zeros(size)
        runs, reading[seen] = _parted(moments[part] / weight, likeness[part] / weight, freedom[part], known)
        return Excess(runs, reading)


@dataclass(frozen=True, eq=False)
class Excess:
    """Scatter of replicates in variances of one run of a model."""

    runs: float
    """Of the runs, with the model's correlations; 1: as the model's."""
    reading: np.ndarray
    """Of the readings, each by itself; 0: none, (observables,)."""

    @property
    def ratio(self) -> np.ndarray:
        """Standard deviation of one replicate in that of one run, (observables,)."""
        return np.asarray(np.sqrt(self.runs + self.reading))

    def added_to(self, covariance: np.ndarray) -> np.ndarray:
        """Covariance of one replicate, of that of one run, (observables, observables)."""
        return self.runs * covariance + np.diag(self.reading * np.diag(covariance))


NOTHING = Scatter({}, {})
"""Replicates of which none is known."""


def _parted(
    moments: np.ndarray, correlation: np.ndarray, freedom: np.ndarray, known: float
) -> tuple[float, np.ndarray]:
    """Part mean products of deviations (n, n) as `Scatter.excess` says, into h and r (n,)."""
    error = 1.0 / np.maximum(freedom, 1.0) + 1.0 / known
    others = correlation * (1.0 - np.eye(len(moments))) * freedom
    length = float(np.sum(others * correlation))
    runs = 1.0
    if length > 0.0:
        others = others / length
        found = float(np.sum(others * moments)) - 1.0
        whole = correlation * max(1.0 + found, 1.0)
        np.fill_diagonal(whole, np.diag(moments))
        # The variance of tr(A M), M being Wishart's of mean W, is 2 tr(A W A W) over its degrees of freedom.
        turned = others @ whole
        runs += _drawn(found, 2.0 * float(np.sum(turned * turned.T)) * float(np.diag(error).mean()))
    raw, errors = np.diag(moments) - runs, 2.0 * np.diag(moments) ** 2 * np.diag(error)
    mean = float(raw.mean())
    total = float(np.sum(moments**2 * error)) * 2.0 / len(raw) ** 2
    between = max(float(np.mean((raw - mean) ** 2 - errors)), 0.0)
    spread = between + errors
    # what has no scatter at all is known without error
    own = np.divide(between, spread, out=np.zeros_like(spread), where=spread > 0.0)
    centre = _drawn(mean, total)
    return runs, np.maximum(centre + own * (raw - centre), 0.0)


def _drawn(value: float, variance: float) -> float:
    """Draw an estimate towards nothing; what is below its standard error is nothing."""
    return max(value - variance / value, 0.0) if value > 0.0 else 0.0
