"""Central composite designs: a two-level part, axial points and replicated centers."""

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from doe.arguments import MOST, checked_count, checked_flag, checked_number
from doe.design.design import Design, design_of_blocks
from doe.design.factors import Factor, numeric_factors
from doe.design.families.blocking import block_labels
from doe.design.families.factorial import basic_factorial
from doe.errors import DesignError

FRACTIONS: dict[int, tuple[tuple[int, ...], ...]] = {
    5: ((0, 1, 2, 3),),
    6: ((0, 1, 2, 3, 4),),
    7: ((0, 1, 2, 3, 4, 5),),
    8: ((0, 1, 2, 3), (0, 1, 4, 5)),
    9: ((0, 2, 3, 5, 6), (1, 2, 4, 5, 6)),
    10: ((0, 1, 2, 6), (1, 2, 3, 4), (0, 2, 3, 5)),
}
"""Columns whose product is each further factor's: smallest regular fractions of resolution V or more
(Box, Hunter and Hunter, Statistics for Experimenters, 2005, table 6.22; Montgomery, Design and Analysis of
Experiments, appendix). Main effects and two-factor interactions stay clear of one another."""

ALPHAS = ("rotatable", "face", "spherical", "orthogonal", "blocks")


def central_composite(
    factors: Iterable[Factor],
    alpha: str | float = "rotatable",
    center: int | tuple[int, int] = 5,
    seed: int | None = None,
    *,
    blocks: int = 1,
    full: bool = False,
) -> Design:
    """Return the central composite design (Box and Wilson 1951) of 1 to 10 factors.

    Standard order: the two-level part (first factor fastest; all corners up to 4 factors, else a fraction of
    resolution V, so that 5 factors take 16 corners), the axial points -alpha and +alpha of each factor, the
    center runs. With blocks, each block's center runs follow its other runs. pyDOE3 1.6.2 has no fractions
    and no blocks.

    Parameters
    ----------
    alpha : {"rotatable", "face", "spherical", "orthogonal", "blocks"} or float
        Coded distance of the axial points. ``"rotatable"``: fourth root of the number of two-level runs, so
        that the variance of a prediction depends on the distance from the center alone; ``"face"``: 1;
        ``"spherical"``: square root of the number of factors; ``"orthogonal"``: the squares' coefficients are
        uncorrelated with one another (Myers, Montgomery and Anderson-Cook, Response Surface Methodology,
        section 8.1); ``"blocks"``: the axial block is orthogonal to the others, so that blocks and model do
        not disturb each other (Box and Hunter, Ann. Math. Stat. 28, 1957, p. 232; orthogonal in R's rsm).
    center : int or (int, int)
        Center runs; two numbers: in each block of corners, and in the axial block. One number with blocks is
        that of every block.
    seed : int, optional
        Seed of the run order. Default: the standard order.
    blocks : int
        1: no blocks; 2: corners, then axial points; 3 or 5: the corners in two or four blocks, then the axial
        points.
    full : bool
        Take all corners from 5 factors on too.

    Raises
    ------
    DesignError
        More than 10 factors, a category, an unknown or not positive alpha, a negative number of center runs,
        blocks that would cost a main effect.
    """
    factors = numeric_factors(factors, "a central composite design")
    blocks = checked_count("blocks", blocks)
    corners = two_level_part(len(factors), checked_flag("full", full))
    parts = _corner_blocks(corners, blocks)
    cube, star = _centers(center, blocks)
    distance = _axial_distance(alpha, len(factors), len(corners), cube * len(parts), star)
    axial = np.kron(np.eye(len(factors)), [[-distance], [distance]])
    centers = np.zeros((max(cube, star), len(factors)))
    pieces = [np.vstack([part, centers[:cube]]) for part in parts] + [np.vstack([axial, centers[:star]])]
    return design_of_blocks(factors, pieces if blocks > 1 else [np.vstack(pieces)], seed)


def two_level_part(factor_count: int, full: bool = False) -> NDArray[np.float64]:
    """Return the -1 / +1 runs: all corners up to 4 factors, else a fraction of resolution V or more."""
    if factor_count > max(FRACTIONS):
        raise DesignError(
            f"factors of a central composite design must be 1 to {max(FRACTIONS)}, got {factor_count}"
        )
    further = () if full else FRACTIONS.get(factor_count, ())
    basic = basic_factorial(factor_count - len(further))
    return np.column_stack([basic, *(basic[:, list(word)].prod(axis=1) for word in further)])


def _corner_blocks(corners: NDArray[np.float64], blocks: int) -> list[NDArray[np.float64]]:
    if blocks not in (1, 2, 3, 5):
        raise DesignError(f"blocks of a central composite design must be 1, 2, 3 or 5, got {blocks}")
    labels = block_labels(corners, max(blocks - 1, 1))
    return [corners[labels == label] for label in range(1, int(labels.max()) + 1)]


def _centers(center: int | tuple[int, int], blocks: int) -> tuple[int, int]:
    """Return the center runs of each block of corners and of the axial points."""
    if not isinstance(center, tuple):
        count = checked_count("center", center, least=0, most=MOST)
        return (count if blocks > 1 else 0), count
    if len(center) != 2:
        raise DesignError(f"center must be one or two numbers of center runs, got {center}")
    cube, star = (checked_count("center", count, least=0, most=MOST) for count in center)
    return cube, star


def _axial_distance(
    alpha: str | float, factor_count: int, corner_count: int, cube_centers: int, star_centers: int
) -> float:
    axial_count = 2 * factor_count
    total = corner_count + axial_count + cube_centers + star_centers
    named = {
        "rotatable": corner_count**0.25,
        "face": 1.0,
        "spherical": math.sqrt(factor_count),
        "orthogonal": math.sqrt(0.5 * (math.sqrt(corner_count * total) - corner_count)),
        "blocks": math.sqrt(
            0.5 * corner_count * (axial_count + star_centers) / (corner_count + cube_centers)
        ),
    }
    if isinstance(alpha, str):
        if alpha not in named:
            raise DesignError(f"alpha must be one of {', '.join(ALPHAS)} or a number, got {alpha!r}")
        return named[alpha]
    return checked_number("alpha", alpha, above=0.0)
