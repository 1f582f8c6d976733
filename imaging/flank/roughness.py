"""Standard error of a slope along a rough flank that may be curved.

The outline of grains is correlated over about a grain. Its residuals are averaged in bins; a cubic is the
shape, and the rest a stationary process with a finite correlation length (the spherical model of
geostatistics). The length is unknown: each one of a grid is weighted by its restricted likelihood (Patterson
and Thompson, Biometrika 58, 1971).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from imaging.geometry import FloatArray

BINS = 48
"""Bins of a flank: at least one for each grain of heaps of up to a hundred grains across."""
LEAST_BINS = 6
"""Fewest bins that separate shape from roughness."""
REACHES = (1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0)
"""Correlation lengths [bins]; the first means no correlation, the last is a sixth of the flank."""
SHAPE_TERMS = 4
"""Terms of the cubic: a flank may be hollow at its foot and round at its tip."""


@dataclass(frozen=True)
class SlopeError:
    """Variance of a slope, in units of (height over position) squared, and its degrees of freedom."""

    variance: float
    dof: float


def slope_error(x: FloatArray, residual: FloatArray) -> SlopeError:
    """Estimate the error of a least-squares slope from residuals at increasing, about even positions."""
    count = min(BINS, len(x))
    if count < LEAST_BINS:
        return _white(x, residual)
    edges = np.linspace(0, len(x), count + 1).astype(np.intp)
    means = np.add.reduceat(residual, edges[:-1]) / np.diff(edges)
    scale = float(means @ means)
    if scale <= 1e-18 * count:
        return SlopeError(0.0, float(count - SHAPE_TERMS))
    projections, constants, slope_variances = _model(count)
    squares = np.maximum(np.einsum("i,kij,j->k", means, projections, means), 1e-12 * scale)
    free = count - SHAPE_TERMS
    likelihood = constants - 0.5 * free * np.log(squares)
    weight = np.exp(likelihood - likelihood.max())
    weight /= weight.sum()
    width = float(x[-1] - x[0]) / (len(x) - 1) * len(x) / count
    variances = squares / free * slope_variances / width**2
    # The error is uncertain by a factor: average its logarithm, and take the spread off the freedom.
    logarithms = np.log(variances)
    mean = float(weight @ logarithms)
    spread = float(weight @ (logarithms - mean) ** 2) + 2.0 / free
    return SlopeError(float(np.exp(mean)), max(2.0 / spread, 1.0))


def _white(x: FloatArray, residual: FloatArray) -> SlopeError:
    dof = max(len(x) - 2.0, 1.0)
    return SlopeError(float(residual @ residual) / dof / float(((x - x.mean()) ** 2).sum()), dof)


@cache
def _model(count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return terms of the likelihood of each correlation length, for a number of bins.

    Projections (k, n, n) give the weighted squares without the shape, constants (k,) the part of the log
    likelihood that does not depend on the data, variances (k,) the slope's at unit variance.
    """
    place = np.arange(count, dtype=np.float64)
    centered = (place - place.mean()) / count
    shape = np.vander(centered, SHAPE_TERMS)
    slope = (place - place.mean()) / ((place - place.mean()) ** 2).sum()
    away = np.abs(place[:, None] - place)
    projections, constants, variances = [], [], []
    for reach in REACHES:
        near = np.minimum(away / max(reach, 1e-9), 1.0)
        correlation = 1.0 - 1.5 * near + 0.5 * near**3
        inverse = np.linalg.inv(correlation)
        gram = shape.T @ inverse @ shape
        projections.append(inverse - inverse @ shape @ np.linalg.solve(gram, shape.T @ inverse))
        logarithms = np.linalg.slogdet(correlation)[1] + np.linalg.slogdet(gram)[1]
        constants.append(-0.5 * logarithms)
        variances.append(float(slope @ correlation @ slope))
    return np.array(projections), np.array(constants), np.array(variances)
