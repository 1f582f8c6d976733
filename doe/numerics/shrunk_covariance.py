"""Covariance of few rows, shrunk towards equal and independent columns."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def shrunk_covariance(rows: Array) -> tuple[Array, float]:
    """Return the covariance of rows about zero, shape (columns, columns), and the share of its target in it.

    The target is the identity times the mean variance. The share minimises the expected squared error
    (O. Ledoit and M. Wolf, Journal of Multivariate Analysis 88 (2004) 365-411, lemma 3.1 to 3.4).
    """
    count, size = rows.shape
    squares = rows**2
    covariance, variances = rows.T @ rows / count, squares.sum(axis=0) / count
    if size == 1:
        return covariance, 0.0
    mean = variances.sum() / size
    apart = np.sum((rows.T @ rows) ** 2) / count**2
    noise = (np.sum(squares.T @ squares) / count - apart) / (size * count)
    distance = (apart - 2.0 * mean * variances.sum() + size * mean**2) / size
    shrunk = min(float(noise), float(distance))
    share = shrunk / float(distance) if shrunk else 0.0
    return (1.0 - share) * covariance + share * mean * np.eye(size), share
