"""Mirror symmetry of an emulator: what a mirror turns over is noise, but for effects with a direction.

Without it an emulator takes the noise of its bank for a small effect, which other mechanisms then buy.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from doe.discrepancy.emulation.condition_surfaces import Addition, Surfaces


def symmetric_base(base: Surfaces, odd: np.ndarray) -> Surfaces:
    """Take out of a base what it has of observables that a mirror turns over, (observables,).

    Their scatter is that of its runs; a mirror turns over its correlation with the others, which so is none.
    """
    noise = replace(base.noise, correlation=_parted(base.noise.correlation, odd))
    return replace(base, base=base.base.silenced(odd), noise=noise, silent=odd)


def symmetric_addition(addition: Addition, odd: np.ndarray, silent: np.ndarray) -> Addition:
    """Take out of a mechanism what symmetry forbids, (observables,); nothing of one that has a direction."""
    polynomial = addition.polynomial.silenced(silent)
    correlation = _parted(addition.correlation, odd) if silent.any() else addition.correlation
    return replace(addition, polynomial=polynomial, correlation=correlation, silent=silent)


def _parted(correlation: np.ndarray, odd: np.ndarray) -> np.ndarray:
    return np.where(odd[:, None] == odd, correlation, 0.0)
