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
from doe.numerics.kriging import Kriging, fit_kriging, fit_noisy_kriging
from doe.numerics.one_thread import in_one_thread

Array = NDArray[np.float64]

LEAST_CURVES = 3
"""Least number of curves beyond the terms of a linear trend."""

KEPT_VARIANCE = 0.999
"""Part of the curves' variance that the components hold."""

MOST_COMPONENTS = 6
"""Largest number of components."""

NOISE_ROUNDS = 2
"""Rounds in which a noise that varies and the kriging are found, each from the other."""

GROWTH_SD, NEWTON_STEPS = 3.0, 30
"""Prior standard deviation of the terms of the logarithm of that noise, and steps to find them."""


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
    """Variance of the noise of one run in each score, at the middle of the settings, shape (components,)."""
    remainder: Array
    """Variance that the components leave out, shape (places,)."""
    growth: Array
    """Slopes of the logarithm of that noise with the settings and their products of two, 0 where it is the
    same everywhere, shape (components, terms)."""
    standard: Array
    """Scores of each run as the others predict them, over the standard deviation that is expected, shape
    (runs, components)."""

    @classmethod
    @in_one_thread
    def of(cls, settings: ArrayLike, curves: ArrayLike, varying: bool = False) -> CurveEmulator:
        """Fit an emulator.

        Parameters
        ----------
        settings
            Coded settings of the runs, about -1 to +1, shape (runs, settings).
        curves
            Shape (runs, places).
        varying
            The noise of a run varies with the settings: its logarithm is a quadratic of them, by what each
            run differs from the prediction of the others.

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
        fitted = [_fitted(x, miss, varying) for miss in (scores - basis @ trends.T).T]
        return cls(
            mean,
            components,
            trends,
            np.asarray(np.linalg.pinv(basis.T @ basis), dtype=np.float64),
            tuple(process for process, *_ in fitted),
            np.array([noise for _, noise, _ in fitted]),
            left.var(axis=0),
            np.array([growth for *_, growth in fitted]),
            np.column_stack([process.standard for process, *_ in fitted]),
        )

    def noise(self, settings: ArrayLike) -> Array:
        """Return the noise variances of one run in the scores at coded settings, (points, components)."""
        x = np.atleast_2d(np.asarray(settings, dtype=np.float64))
        return np.asarray(self.noises * np.exp(_bent(x) @ self.growth.T))

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


def _fitted(x: Array, miss: Array, varying: bool) -> tuple[Kriging, float, Array]:
    """Krige a score; return also its noise at the middle, and the terms of the noise's logarithm."""
    process, noise = fit_noisy_kriging(x, miss)
    terms = np.column_stack([np.ones(len(x)), _bent(x)])
    log = np.append(np.log(noise), np.zeros(_bent(x).shape[1]))
    for _ in range(NOISE_ROUNDS * varying):
        log = _log_variance(terms, np.exp(terms @ log) * process.standard**2, log)
        process = fit_kriging(x, miss, np.exp(terms @ log))
    return process, float(np.exp(log[0])) if varying else noise, log[1:]


def _log_variance(terms: Array, squares: Array, log: Array) -> Array:
    """Fit the logarithm of a variance to squares: a penalised gamma likelihood, by Fisher scoring."""
    penalty = np.diag([0.0, *[GROWTH_SD**-2] * (len(log) - 1)])
    for _ in range(NEWTON_STEPS):
        surplus = terms.T @ (squares / np.exp(terms @ log) - 1.0)
        step = np.linalg.solve(0.5 * terms.T @ terms + penalty, 0.5 * surplus - penalty @ log)
        log = log + np.clip(step, -1.0, 1.0)
    return log


def _bent(x: Array) -> Array:
    """Return settings and their products of two, (points, terms)."""
    return np.column_stack([x, *(x[:, i] * x[:, j] for i in range(x.shape[1]) for j in range(i + 1))])


def _with_constant(x: Array) -> Array:
    return np.column_stack([np.ones(len(x)), x])
