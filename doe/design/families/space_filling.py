"""Space-filling designs for simulations: Latin hypercubes and Sobol points (``scipy.stats.qmc``)."""

from collections.abc import Iterable
from typing import Literal

import numpy as np
from scipy.stats import qmc

from doe.arguments import MOST, checked_choice, checked_count, checked_seed
from doe.design.design import Design, design_of_blocks
from doe.design.factors import Factor, numeric_factors
from doe.errors import DesignError

OPTIMIZE = ("random-cd", "lloyd")


def latin_hypercube(
    factors: Iterable[Factor],
    runs: int,
    *,
    seed: int,
    optimize: Literal["random-cd", "lloyd"] | None = "random-cd",
) -> Design:
    """Return a Latin hypercube: each factor has one run in each of as many slices as runs.

    Parameters
    ----------
    optimize : {"random-cd", "lloyd"} or None
        Even out the points: by exchanges that lower the centered discrepancy, which keep the slices, or by
        moving them apart, which does not (see ``scipy.stats.qmc.LatinHypercube``).
    """
    factors = numeric_factors(factors, "a Latin hypercube")
    runs = checked_count("runs of a Latin hypercube", runs, least=2, most=MOST)
    if optimize is not None:
        checked_choice("optimize, unless it is None,", optimize, OPTIMIZE)
    rng = np.random.default_rng(checked_count("seed", seed, least=0))
    sampler = qmc.LatinHypercube(len(factors), optimization=optimize, rng=rng)
    return _design(factors, sampler.random(runs))


def sobol(factors: Iterable[Factor], runs: int, *, seed: int | None = None) -> Design:
    """Return the first points of a Sobol sequence, which fill the box evenly at every power of two.

    Parameters
    ----------
    runs : int
        A power of two: other numbers lose the balance of the sequence.
    seed : int, optional
        Seed of Owen's scrambling. Default: the plain sequence, whose first run has every factor low.
    """
    factors = numeric_factors(factors, "a Sobol design")
    runs = checked_count("runs of a Sobol design", runs, least=2, most=MOST)
    if runs & (runs - 1):
        below = 1 << max(runs.bit_length() - 1, 1)
        raise DesignError(
            f"runs of a Sobol design must be a power of two, such as {below} or {2 * below}, got {runs}"
        )
    seed = checked_seed(seed)
    sampler = qmc.Sobol(len(factors), scramble=seed is not None, rng=np.random.default_rng(seed or 0))
    return _design(factors, sampler.random_base2(runs.bit_length() - 1))


def _design(factors: tuple[Factor, ...], unit: np.ndarray) -> Design:
    """Return the design of points in the unit cube."""
    return design_of_blocks(factors, [2.0 * unit - 1.0], None)
