"""Emulators of curves: a simulated function of a place, as a smooth function of the settings of a model.

The curves of a design are split into principal components. The scores of each are kriged over the coded
settings, with a linear trend and a fitted noise. The emulator's own covariance is what the components leave
out and what kriging does not know.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe.errors import RuleError
from doe.numerics.kriging import Kriging, fit_noisy_kriging
from doe.numerics.one_thread import in_one_thread

Array = NDArray[np.float64]

LEAST_CURVES = 3
"""Least number of curves beyond the terms of a linear trend."""

KEPT_VARIANCE = 0.999
"""Part of the curves' variance that the components hold."""

MOST_COMPONENTS = 6
"""Largest number of components."""


@dataclass(frozen=True, eq=False)
class CurveEmulator:
    """Curves at the same places, as a function of coded settings."""

    mean: Array
    """Mean curve of the design, shape (places,)."""
    components: Array
    """Unit vectors, shape (components, places)."""
    trends: Array
    """Constant and slopes of each score, shape (components, 1 + settings)."""
    trend_error: Array
    """Covariance of constant and slopes for a noise of 1, shape (1 + settings, 1 + settings)."""
    processes: tuple[Kriging, ...]
    """Part of each score that the trend misses."""
    noises: Array
    """Variance of the noise of one run in each score, shape (components,)."""
    remainder: Array
    """Variance that the components leave out, shape (places,)."""

    @classmethod
    @in_one_thread
    def of(cls, settings: ArrayLike, curves: ArrayLike) -> CurveEmulator:
        """Fit an emulator.

        Parameters
        ----------
        settings
            Coded settings of the runs, about -1 to +1, shape (runs, settings).
        curves
            Shape (runs, places).

        Raises
        ------
        RuleError
            Too few runs, or a value that is not finite.
        """
        x, rows = np.array(settings, dtype=np.float64), np.array(curves, dtype=np.float64)
        if x.ndim != 2 or rows.ndim != 2 or len(x) != len(rows):
            raise RuleError("curves", "must have a row for each run", f"shapes {x.shape} and {rows.shape}")
        least = x.shape[1] + 1 + LEAST_CURVES
        if len(x) < least:
            raise RuleError("curves", f"must be {least} or more", len(x))
        if not (np.isfinite(x).all() and np.isfinite(rows).all()):
            raise RuleError("curves", "must be finite", "NaN or infinity")
        mean = rows.mean(axis=0)
        _, sizes, directions = np.linalg.svd(rows - mean, full_matrices=False)
        share = np.cumsum(sizes**2) / max(float(np.sum(sizes**2)), np.finfo(float).tiny)
        count = min(int(np.searchsorted(share, KEPT_VARIANCE)) + 1, MOST_COMPONENTS, len(sizes))
        components = directions[:count]
        scores = (rows - mean) @ components.T
        left = rows - mean - scores @ components
        basis = _with_constant(x)
        trends = np.linalg.lstsq(basis, scores, rcond=None)[0].T
        fitted = [fit_noisy_kriging(x, miss) for miss in (scores - basis @ trends.T).T]
        return cls(
            mean,
            components,
            trends,
            np.asarray(np.linalg.pinv(basis.T @ basis), dtype=np.float64),
            tuple(process for process, _ in fitted),
            np.array([noise for _, noise in fitted]),
            left.var(axis=0),
        )

    def scores(self, settings: ArrayLike) -> tuple[Array, Array]:
        """Return expected scores at coded settings and error variances, both (points, components)."""
        x = np.atleast_2d(np.asarray(settings, dtype=np.float64))
        basis = _with_constant(x)
        means = basis @ self.trends.T
        variances = np.einsum("ij,jk,ik->i", basis, self.trend_error, basis)[:, None] * self.noises
        for number, process in enumerate(self.processes):
            means[:, number] += process.mean(x)
            variances[:, number] += process.variance(x)
        return means, variances

    def predict(self, settings: ArrayLike) -> tuple[Array, Array]:
        """Return expected curves and their variances without the noise of a run, both (points, places)."""
        scores, variances = self.scores(settings)
        return self.mean + scores @ self.components, variances @ self.components**2 + self.remainder

    def covariance(self, variances: Array, places: ArrayLike) -> Array:
        """Return the covariance at some places, given as numbers, for variances of the scores."""
        own = self.components[:, np.asarray(places)]
        return np.asarray(own.T * variances @ own + np.diag(self.remainder[np.asarray(places)]))


def _with_constant(x: Array) -> Array:
    return np.column_stack([np.ones(len(x)), x])
