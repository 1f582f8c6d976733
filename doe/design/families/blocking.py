"""Blocks of a two-level design: the runs are split by interactions, so that no main effect is lost."""

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from doe.arguments import checked_count
from doe.errors import DesignError

SMALL = 1e-9


def block_labels(coded: NDArray[np.float64], blocks: int) -> NDArray[np.int64]:
    """Return the block of each run, 1 to ``blocks``, of a two-level design.

    The signs of log2(blocks) interactions define the blocks. They and their products (all of which are lost)
    are clear of main effects, and of interactions of two factors where possible; among those the longest,
    then the first in the order of the factors, are taken (Box, Hunter and Hunter, Statistics for
    Experimenters, 2005, section 5.16).

    Raises DesignError: a number of blocks that is no power of two, or one for which a main effect would be
    lost.
    """
    blocks = checked_count("blocks", blocks)
    if blocks == 1:
        return np.ones(len(coded), dtype=np.int64)
    count = int(math.log2(blocks))
    if 2**count != blocks or blocks >= len(coded) or not (np.abs(coded) == 1.0).all():
        raise DesignError(
            f"blocks of a two-level design must be 2, 4, ... and fewer than {len(coded)} runs, got {blocks}"
        )
    factor_count = coded.shape[1]
    words = [
        word
        for size in range(factor_count, 1, -1)
        for word in itertools.combinations(range(factor_count), size)
    ]
    mains = coded / len(coded)
    pairs = [coded[:, i] * coded[:, j] for i, j in itertools.combinations(range(factor_count), 2)]
    interactions = np.column_stack(pairs) / len(coded) if pairs else np.zeros((len(coded), 1))
    best: tuple[float, tuple[NDArray[np.float64], ...]] | None = None
    for chosen in itertools.combinations(words[: 2 ** min(factor_count, 7)], count):
        signs = tuple(coded[:, list(word)].prod(axis=1) for word in chosen)
        lost = _lost(signs)
        if np.abs(lost.T @ mains).max() > SMALL or np.abs(lost.mean(axis=0)).max() > SMALL:
            continue
        cost = float((np.abs(lost.T @ interactions) > SMALL).sum())
        if best is None or cost < best[0]:
            best = cost, signs
        if cost == 0.0:
            break
    if best is None:
        raise DesignError(f"{blocks} blocks would cost a main effect of these {len(coded)} runs")
    return 1 + sum((2**place * (sign > 0) for place, sign in enumerate(best[1])), np.zeros(len(coded), int))


def _lost(signs: tuple[NDArray[np.float64], ...]) -> NDArray[np.float64]:
    """Return the contrasts between blocks: the chosen ones and all their products."""
    products = [
        np.prod(chosen, axis=0)
        for size in range(1, len(signs) + 1)
        for chosen in itertools.combinations(signs, size)
    ]
    return np.column_stack(products)
