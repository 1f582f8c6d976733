"""Box-Behnken designs: three levels without corners, for quadratic surfaces of 3 to 7 factors."""

from collections.abc import Iterable

import numpy as np

from doe.arguments import MOST, checked_count, checked_flag
from doe.design.design import Design, design_of_blocks
from doe.design.factors import Factor, numeric_factors
from doe.design.families.factorial import basic_factorial
from doe.errors import DesignError

TOGETHER: dict[int, tuple[tuple[tuple[int, ...], ...], ...]] = {
    3: (((1, 2), (1, 3), (2, 3)),),
    4: (((1, 2), (3, 4)), ((1, 4), (2, 3)), ((1, 3), (2, 4))),
    5: (((1, 2), (3, 4), (2, 5), (1, 3), (4, 5)), ((2, 3), (1, 4), (3, 5), (1, 5), (2, 4))),
    6: (((1, 2, 4), (2, 3, 5), (3, 4, 6), (1, 4, 5), (2, 5, 6), (1, 3, 6)),),
    7: (((4, 5, 6), (1, 6, 7), (2, 5, 7), (1, 2, 4), (3, 4, 7), (1, 3, 5), (2, 3, 6)),),
}
"""Factors that move together while the others stay at their centers, by block (Box and Behnken, Technometrics
2, 1960, p. 455, table 4). With 6 and 7 factors the sign of the product of the three splits each group into
two blocks."""

CENTERS = {3: 3, 4: 3, 5: 6, 6: 6, 7: 6}
"""Center runs of the published designs."""


def box_behnken(
    factors: Iterable[Factor], center: int | None = None, *, blocks: bool = False, seed: int | None = None
) -> Design:
    """Return the Box-Behnken design of 3 to 7 factors: 12, 24, 40, 48 or 56 runs and the centers.

    pyDOE3 1.6 has 60 and 84 runs with 6 and 7 factors instead of the published 48 and 56, and no blocks;
    process-improve 2.2.0 makes blocks that are not orthogonal.

    Parameters
    ----------
    center : int, optional
        Center runs in all. Default: those of the published design (3, 3, 6, 6, 6).
    blocks : bool
        Split the runs into the published orthogonal blocks: 3 with 4 factors, 2 with 5 to 7. Each gets the
        same number of center runs.
    seed : int, optional
        Seed of the run order. Default: the standard order.

    Raises
    ------
    DesignError
        Another number of factors, blocks for 3 factors, or centers that the blocks cannot share.
    """
    factors = numeric_factors(factors, "a Box-Behnken design")
    count = len(factors)
    if count not in TOGETHER:
        raise DesignError(f"factors of a Box-Behnken design must be 3 to 7, got {count}")
    pieces = _pieces(count)
    if checked_flag("blocks", blocks) and len(pieces) == 1:
        raise DesignError("the Box-Behnken design of 3 factors has no orthogonal blocks")
    if not blocks:
        pieces = [np.vstack(pieces)]
    center = CENTERS[count] if center is None else checked_count("center", center, least=0, most=MOST)
    if center % len(pieces):
        raise DesignError(f"center must be a multiple of the {len(pieces)} blocks, got {center}")
    each = np.zeros((center // len(pieces), count))
    pieces = [np.vstack([piece, each]) for piece in pieces]
    return design_of_blocks(factors, pieces, seed)


def _pieces(count: int) -> list[np.ndarray]:
    """Return the runs of each block without centers."""
    pieces = []
    for groups in TOGETHER[count]:
        rows = []
        for group in groups:
            corners = np.zeros((2 ** len(group), count))
            corners[:, [number - 1 for number in group]] = basic_factorial(len(group))
            rows.append(corners)
        pieces.append(np.vstack(rows))
    if count < 6:
        return pieces
    runs = pieces[0]
    sign = np.where(runs == 0.0, 1.0, runs).prod(axis=1)
    return [runs[sign > 0], runs[sign < 0]]
