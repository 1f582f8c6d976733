"""Definitive screening designs: three levels, main effects clear of all effects of second order."""

from collections.abc import Iterable

import numpy as np

from doe.arguments import MOST, checked_count
from doe.design.design import Design, design_of_blocks
from doe.design.factors import Factor, numeric_factors
from doe.design.families.hadamard import conference_matrix, has_conference
from doe.errors import DesignError

MOST_FACTORS = 60


def definitive_screening(
    factors: Iterable[Factor], *, spare: int = 0, center: int = 1, seed: int | None = None
) -> Design:
    """Return the definitive screening design: a conference matrix, its mirror image and the center.

    Main effects are orthogonal to one another and to every interaction and square; squares can be estimated;
    no two interactions coincide wholly (Jones and Nachtsheim, J. Qual. Technol. 43, 2011, p. 1; the
    construction from conference matrices: Xiao, Lin and Bai, 44, 2012, p. 2). With m columns 2 m + 1 runs.

    Parameters
    ----------
    factors : iterable of Factor
        Three or more numbers.
    spare : int
        Columns beyond the factors, which are left out: 2 give four more runs and enough degrees of freedom
        for tests (Jones and Nachtsheim, Technometrics 59, 2017, p. 319).
    center : int
        Center runs, one or more.
    seed : int, optional
        Seed of the run order. Default: the standard order.
    """
    factors = numeric_factors(factors, "a definitive screening design")
    if not 3 <= len(factors) <= MOST_FACTORS:
        raise DesignError(
            f"factors of a definitive screening design must be 3 to {MOST_FACTORS}, got {len(factors)}"
        )
    center = checked_count("center", center, most=MOST)
    order = len(factors) + checked_count("spare", spare, least=0)
    if order > 2 * MOST_FACTORS:
        raise DesignError(f"factors and spare columns must be at most {2 * MOST_FACTORS}, got {order}")
    while not has_conference(order):
        order += 1
    half = conference_matrix(order)[:, : len(factors)]
    rows = np.stack([half, -half], axis=1).reshape(-1, len(factors))
    return design_of_blocks(factors, [np.vstack([rows, np.zeros((center, len(factors)))])], seed)
