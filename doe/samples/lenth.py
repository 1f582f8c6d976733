"""Lenth's pseudo standard error, and how large inert effects look against it."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

LENTH_DRAWS = 100_000
"""Drawn sets of inert effects behind Lenth's limits: that of 8 runs and .05 is known to 0.4 % of itself."""

SEED = 1
"""Of the drawing: the same effects give the same limits."""


def pseudo_error(effects: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Lenth's pseudo standard error of each row of effects."""
    size = np.abs(effects)
    limit = 2.5 * 1.5 * np.median(size, axis=1, keepdims=True)
    return np.asarray(1.5 * np.nanmedian(np.where(size <= limit, size, np.nan), axis=1))


@cache
def orthogonal_null(count: int) -> NDArray[np.float64]:
    """Return the absolute t of so many inert effects of equal variance, drawn again and again, ascending."""
    effects = np.random.default_rng(SEED).standard_normal((LENTH_DRAWS, count))
    return np.sort(np.abs(effects) / pseudo_error(effects)[:, None], axis=None)
