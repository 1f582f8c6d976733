"""Intervals of the sizes of mechanisms, from the profile of the likelihood."""

import numpy as np
from scipy import stats

from doe.discrepancy.fitting.model_fit import Fitted, minimise

PROFILE_POINTS = 61


def coded_size_interval(fitted: Fitted, number: int, coverage: float = 0.9) -> tuple[float, float]:
    """Return the profile-likelihood interval of a coded size, by the number of its mechanism.

    It ends where q, with all else refitted, has risen by the point of chi2 for the coverage. The weights stay
    those of the optimum; their contribution to the score's slope there is taken out of the residuals, so that
    q is least at the optimum, too. An error due to noise in the slopes grows with the size, as an error of
    the divisor does in a quotient (Fieller 1954): it opens no way to the null. Where nothing fits, the score
    may prefer another size than q, one whose predictions are more uncertain: the interval holds both.
    """
    column = len(fitted.x) - len(fitted.mechanisms) + number
    se = max(float(fitted.coded_size_errors[number]), 1e-3)
    low, high = max(fitted.x[column] - 5.0 * se, 0.0), min(fitted.x[column] + 5.0 * se, 1.0)
    grid = np.unique(np.append(np.linspace(low, high, PROFILE_POINTS), fitted.x[column]))
    starts = np.repeat(fitted.x[None], len(grid), axis=0)
    starts[:, column] = grid
    lower = np.repeat(fitted.model.lower[None], len(grid), axis=0)
    upper = np.repeat(fitted.model.upper[None], len(grid), axis=0)
    lower[:, column] = upper[:, column] = grid
    slopes = fitted.sensitivities
    left = fitted.residuals - slopes @ (np.linalg.pinv(slopes) @ fitted.residuals)
    target = fitted.stack.predict(fitted.x[None])[0] + np.linalg.solve(fitted.whitening, left)
    _, q = minimise(fitted.stack, fitted.whitening, target, starts, lower, upper)
    wider = _variances(fitted, number, grid) / fitted.spread[column, column]
    rise = q - q.min() - stats.chi2.ppf(coverage, 1) * wider
    inside, value = np.flatnonzero(rise <= 0.0), float(fitted.x[column])
    ends = _crossing(grid, rise, inside[0], -1), _crossing(grid, rise, inside[-1], 1)
    return min(ends[0], value), max(ends[1], value)


def _variances(fitted: Fitted, number: int, sizes: np.ndarray) -> np.ndarray:
    """Return the variances of the error of a coded size, if it were one of these sizes."""
    value, whole = fitted.coded_sizes[number], fitted.coded_size_errors[number] ** 2
    none = min(fitted.null_size_errors[number] ** 2, whole)
    return np.asarray(none + (whole - none) * (sizes / value if value > 0.0 else 1.0) ** 2)


def _crossing(grid: np.ndarray, rise: np.ndarray, inside: int, step: int) -> float:
    outside = inside + step
    if not 0 <= outside < len(grid):
        return float(grid[inside])
    share = rise[inside] / (rise[inside] - rise[outside])
    return float(grid[inside] + share * (grid[outside] - grid[inside]))
