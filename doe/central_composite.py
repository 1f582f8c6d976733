"""Central composite designs: a two-level part, axial points and replicated centers."""

import itertools
import math
from collections.abc import Iterable

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from doe.design import Design, numbered
from doe.errors import DesignError
from doe.factors import Factor, checked_factors

FULL_FACTORIAL_LIMIT = 5

FRACTIONS: dict[int, tuple[tuple[int, ...], ...]] = {
    6: ((0, 1, 2, 3, 4),),
    7: ((0, 1, 2, 3, 4, 5),),
    8: ((0, 1, 2, 3), (0, 1, 4, 5)),
    9: ((0, 2, 3, 5, 6), (1, 2, 4, 5, 6)),
    10: ((0, 1, 2, 6), (1, 2, 3, 4), (0, 2, 3, 5)),
}
"""Columns whose product is each further factor's: smallest regular fractions of resolution V or more
(Box, Hunter and Hunter, Statistics for Experimenters, 2005, table 6.22; Montgomery, Design and Analysis of
Experiments, appendix). Main effects and two-factor interactions stay clear of one another."""


def central_composite(
    factors: Iterable[Factor], alpha: str | float = "rotatable", center: int = 5, seed: int | None = None
) -> Design:
    """Return the central composite design (Box and Wilson 1951) of 1 to 10 factors.

    Standard order: the two-level part (first factor fastest; full up to 5 factors, else a fraction of
    resolution V), the axial points -alpha and +alpha of each factor, the center runs.

    Parameters
    ----------
    factors : iterable of Factor
    alpha : {"rotatable", "face", "spherical"} or float
        Coded distance of the axial points. ``"rotatable"``: fourth root of the number of two-level runs, so
        that the variance of a prediction depends on the distance from the center alone; ``"face"``: 1;
        ``"spherical"``: square root of the number of factors.
    center : int
        Number of center runs.
    seed : int, optional
        Seed of the run order; None keeps the standard order.

    Raises
    ------
    DesignError
        More than 10 factors, an unknown alpha or one that is not positive, a negative number of center runs.
    """
    factors = checked_factors(factors)
    if center < 0:
        raise DesignError(f"center is the number of center runs and not negative, received {center}")
    corners = two_level_part(len(factors))
    distance = _axial_distance(alpha, len(factors), len(corners))
    axial = np.kron(np.eye(len(factors)), [[-distance], [distance]])
    coded = np.vstack([corners, axial, np.zeros((center, len(factors)))])
    names = [factor.name for factor in factors]
    return Design(factors, numbered(pd.DataFrame(coded, columns=names)), seed)


def two_level_part(factor_count: int) -> NDArray[np.float64]:
    """Return the -1 / +1 runs: all corners up to 5 factors, else a fraction of resolution V or more."""
    if factor_count > max(FRACTIONS):
        raise DesignError(
            f"a central composite design takes 1 to {max(FRACTIONS)} factors, received {factor_count}"
        )
    further = FRACTIONS.get(factor_count, ())
    basic = np.array(list(itertools.product([-1.0, 1.0], repeat=factor_count - len(further))))[:, ::-1]
    return np.column_stack([basic, *(basic[:, list(word)].prod(axis=1) for word in further)])


def _axial_distance(alpha: str | float, factor_count: int, corner_count: int) -> float:
    named = {"rotatable": corner_count**0.25, "face": 1.0, "spherical": math.sqrt(factor_count)}
    if isinstance(alpha, str):
        if alpha not in named:
            raise DesignError(f"alpha is one of {', '.join(named)} or a number, received {alpha!r}")
        return named[alpha]
    if not (math.isfinite(alpha) and alpha > 0.0):
        raise DesignError(f"alpha must be positive and finite, received {alpha}")
    return float(alpha)
