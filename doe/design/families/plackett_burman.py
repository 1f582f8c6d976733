"""Plackett-Burman designs: two-level screening in N = 4, 8, 12, ... runs."""

import math
from collections.abc import Iterable

import pandas as pd

from doe.arguments import checked_count
from doe.design.design import Design, numbered
from doe.design.factors import Factor, two_level_factors
from doe.design.families.hadamard import constructible, screening_matrix, worst_alias
from doe.errors import DesignError

DEFAULT_RUNS = 12
"""Smallest default size: in 12 runs no interaction hides wholly in one factor's column."""

RESOLUTION_V = {16: 5, 32: 6, 64: 8, 128: 11}
"""Most factors of a regular fraction of resolution V, by its runs."""

MOST_RUNS = 1_000
"""Larger matrices take minutes."""


def plackett_burman(factors: Iterable[Factor], runs: int | None = None, seed: int | None = None) -> Design:
    """Return the Plackett-Burman design of the factors.

    Every column is orthogonal to every other. The factors take the first columns, the rest are dummies
    (``dummy1``, ...): what they estimate is error and interactions. Where N is a power of two up to 16,
    interactions of two factors fall wholly into single columns; elsewhere they spread over many. In 12, 20,
    24, 28 and 36 runs these are the published tables; in more, the matrix and the order of its columns in
    which an interaction of the factors falls least onto another factor. The design's ``notes`` say how much
    that is, and where a design in the same number of runs keeps main effects and interactions apart.

    Own code: pyDOE3 1.6.2 refuses 28, 36, 44, 52 and 56 runs, and lays interactions wholly onto factors in 24
    and 48. process-improve 2.2.0 has all sizes, but lays .6 of an interaction onto one of the first six
    factors in 40 runs, .39 in 52 and .29 in 56, where these columns lay none, .08 and none.

    Parameters
    ----------
    factors : iterable of Factor
        Numbers, or categories of two levels.
    runs : int, optional
        A multiple of 4 above the number of factors; default 12, or the next size that holds them.
    seed : int, optional
        Seed of the run order; None keeps the standard order.

    Raises
    ------
    DesignError
        Too few runs for the factors, or a size for which no construction is known here.
    """
    factors = two_level_factors(factors, "a Plackett-Burman design")
    if runs is None:
        runs = max(DEFAULT_RUNS, 4 * math.ceil((len(factors) + 1) / 4))
        while not constructible(runs):
            runs += 4
    runs = checked_count("runs", runs, most=MOST_RUNS)
    if runs < len(factors) + 1:
        raise DesignError(f"{len(factors)} factors need at least {len(factors) + 1} runs, got {runs}")
    matrix = screening_matrix(runs, len(factors))
    names = [factor.name for factor in factors]
    dummies = tuple(f"dummy{number}" for number in range(1, runs - len(factors)))
    table = numbered(pd.DataFrame(matrix, columns=[*names, *dummies]))
    notes = _notes(runs, len(factors), worst_alias(matrix[:, : len(factors)]))
    return Design(factors, table, seed, dummies, notes=notes)


def _notes(runs: int, factor_count: int, worst: float) -> tuple[str, ...]:
    """Say how far interactions fall onto factors, and which design of the same size does better."""
    notes = []
    if worst > 0.0:
        share = "the whole of it" if worst > 1.0 - 1e-9 else f"{100.0 * worst:.0f} % of it"
        notes.append(f"an interaction of two factors biases a third one's effect by up to {share}")
    if factor_count <= RESOLUTION_V.get(runs, 0):
        notes.append(
            f"fractional_factorial has resolution V or more in the same {runs} runs: main effects and "
            "interactions of two factors are all kept apart"
        )
    elif worst > 0.0 and factor_count <= runs // 2 and runs % 8 == 0:
        other = (
            "fractional_factorial"
            if runs & (runs - 1) == 0
            else f"foldover(plackett_burman(factors, {runs // 2}))"
        )
        if runs & (runs - 1) == 0 or (factor_count < runs // 2 and constructible(runs // 2)):
            notes.append(
                f"{other} has resolution IV in the same {runs} runs: no interaction of two factors falls "
                "onto a factor"
            )
    return tuple(notes)
