"""Classes of size in place of a continuous spread, for codes with templates of grains."""

from __future__ import annotations

import numpy as np

from dem_warp import GrainPopulation
from dem_warp.population import SIZE_LIMIT

CLASSES = 5
"""Classes of size; with n of them the first 2 n moments are those of the spread."""

_NODES = 200
"""Nodes of the quadrature that the moments are integrated by."""


def classes_of(grains: GrainPopulation) -> tuple[tuple[float, float], ...]:
    """Return the sizes of a population, and the share of the number of grains of each."""
    if grains.classes is None:
        return size_classes(grains.size_mean, grains.size_sd)
    return tuple(zip(grains.classes.sizes, grains.classes.fractions, strict=True))


def sizes_text(grains: GrainPopulation) -> str:
    """Describe the sizes of a population in words."""
    if grains.classes is None:
        return f"{grains.size_mean:g} +- {grains.size_sd:g} of the shape, normal, cut at {SIZE_LIMIT:g} sd"
    low, high = grains.size_range
    return f"{len(grains.classes.sizes)} classes from {low:.4g} to {high:.4g} of the shape"


def size_classes(mean: float, sd: float, count: int = CLASSES) -> tuple[tuple[float, float], ...]:
    """Return sizes, and the share of the number of grains of each.

    They are the nodes and weights of the Gauss quadrature of the normal distribution that a population draws
    its sizes from, cut at its limit: mean and variance of the sizes and mean mass are the population's. An
    `sd`, before the cut, of 0 gives one class.

    References
    ----------
    Golub and Welsch, Mathematics of Computation 23 (1969) 221-230, by the discretised Stieltjes procedure.
    """
    if sd == 0.0:
        return ((mean, 1.0),)
    # a study may name an engine without a test being written for it
    from scipy.linalg import eigh_tridiagonal
    from scipy.special import roots_legendre

    nodes, weights = roots_legendre(_NODES)
    nodes = nodes * SIZE_LIMIT
    weights = weights * np.exp(-0.5 * nodes**2)
    weights /= weights.sum()
    squares: list[float] = []
    below, present, norm = np.zeros(_NODES), np.ones(_NODES), 1.0
    for _ in range(count - 1):
        # the weight is even: each polynomial is the node times the last one, less a part of the one before
        above = nodes * present - (squares[-1] if squares else 0.0) * below
        next_norm = float(weights @ above**2)
        squares.append(next_norm / norm)
        below, present, norm = present, above, next_norm
    sizes, vectors = eigh_tridiagonal(np.zeros(count), np.sqrt(squares))
    return tuple(
        (float(mean + sd * size), float(first**2)) for size, first in zip(sizes, vectors[0], strict=True)
    )
