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
"""Smallest default size: in 12 runs no interaction coincides wholly with one factor's column."""

RESOLUTION_V = {16: 5, 32: 6, 64: 8, 128: 11}
"""Largest number of factors of a regular fraction of resolution V, by its runs."""

MOST_RUNS = 1_000
"""Largest number of runs; larger matrices take minutes."""


def plackett_burman(factors: Iterable[Factor], runs: int | None = None, seed: int | None = None) -> Design:
    """Return the Plackett-Burman design of the factors.

    Every column is orthogonal to every other. The factors take the first columns, the rest are dummies
    (``dummy1``, ...), which estimate error and interactions. Where N is a power of two up to 16, interactions
    of two factors coincide with single columns; elsewhere they spread over many. In 12, 20, 24, 28 and 36
    runs these are the published tables; in more, the matrix and the order of its columns in which an
    interaction of the factors affects another factor least. The design's ``notes`` state that effect, and a
    design of the same size that separates main effects and interactions.

    pyDOE3 1.6.2 rejects 28, 36, 44, 52 and 56 runs, and aliases interactions wholly with factors in 24 and
    48; process-improve 2.2.0 aliases .6 of an interaction with one of the first six factors in 40 runs.

    Parameters
    ----------
    factors : iterable of Factor
        Numbers, or categories of two levels.
    runs : int, optional
        A multiple of 4 above the number of factors. Default: 12, or the next size that holds them.
    seed : int, optional
        Seed of the run order. Default: the standard order.

    Raises
    ------
    DesignError
        Too few runs for the factors, or a size without a construction here.
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
    """Describe the bias of effects by interactions, and a better design of the same size."""
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
