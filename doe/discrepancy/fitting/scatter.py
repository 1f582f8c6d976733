"""Scatter of measured replicates beyond that of the model: of the runs themselves, and of their readings.

Observables of one run scatter together, as the model's do. Errors of readings are independent. So the part of
the excess scatter that keeps the model's correlations is due to the runs, and the rest to the readings.
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
    """Sums of the products of two observables' deviations by condition, over the replicates that have both,
    (observables, observables)."""
    freedom: Mapping[str, np.ndarray]
    """Degrees of freedom of those sums by condition."""

    @classmethod
    def of(cls, measured: Measured, observables: Sequence[str], conditions: Sequence[str]) -> Scatter:
        """Collect the scatter of some conditions; unmeasured observables have no degrees of freedom."""
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
        """Estimate the scatter of the replicates beyond that of a model.

        In standard deviations of the model the mean product of the deviations of two observables is M_ij = h
        R_ij + d_ij r_i with the model's correlation R: h comes from the products of different observables, r
        from the remainder of the squares. h and the mean of all r are shrunk to zero by their standard errors
        (James and Stein 1961, positive part), each r to that mean (Efron and Morris 1973). Less scatter than
        the model's is chance. ``known`` is the number of degrees of freedom of the model's covariances,
        ``size`` that of observables.
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
    """Scatter of the runs, with the model's correlations; 1: equal to the model's."""
    reading: np.ndarray
    """Independent scatter of the readings, (observables,)."""

    @property
    def ratio(self) -> np.ndarray:
        """Standard deviation of one replicate over that of one run, (observables,)."""
        return np.asarray(np.sqrt(self.runs + self.reading))

    def added_to(self, covariance: np.ndarray) -> np.ndarray:
        """Return the covariance of one replicate from that of one run, (observables, observables)."""
        return self.runs * covariance + np.diag(self.reading * np.diag(covariance))


NOTHING = Scatter({}, {})
"""Scatter without replicates."""


def _parted(
    moments: np.ndarray, correlation: np.ndarray, freedom: np.ndarray, known: float
) -> tuple[float, np.ndarray]:
    """Split mean products of deviations (n, n) into h and r (n,) (`Scatter.excess`)."""
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
    # an observable without scatter is known without error
    own = np.divide(between, spread, out=np.zeros_like(spread), where=spread > 0.0)
    centre = _drawn(mean, total)
    return runs, np.maximum(centre + own * (raw - centre), 0.0)


def _drawn(value: float, variance: float) -> float:
    """Shrink an estimate towards zero; below its standard error it is zero."""
    return max(value - variance / value, 0.0) if value > 0.0 else 0.0
