"""Agreement: the misfit without noise, its bias, slope and rank correlation, at few runs and many."""

from collections.abc import Iterator

import numpy as np
from scipy import stats

from doe import agreement
from experiments.evidence.accuracy.statistics.coverage import (
    AT_LEAST,
    CHECKED,
    EXACT,
    Figure,
    generator,
    require_same,
)

RUNS = (3, 5, 10, 30)
NOISES = (0.0, 0.5, 1.0)
"""Noise variances of the values, and of the reference, over the square of the misfit."""

MISFITS = ("scattered", "shifted")
"""Misfits drawn about zero, and one for all runs; both of root mean square 1."""

SLOPE = 0.8
SPREAD = 6.0
"""Standard deviation of the true reference over the misfit."""

TRIALS = 40_000
"""Allowed difference of slope and rank correlation: an eighth."""

ROUNDING = 1e-12


def agreements() -> Iterator[Figure]:
    """Yield the coverage of the intervals of ``agreement``, and how often its estimate is too low."""
    number = 0
    for runs in RUNS:
        for noise in NOISES:
            for misfit in MISFITS:
                yield from _misfits(runs, noise, misfit, number)
                number += 1
            yield from _lines(runs, noise, 100 + number)


def _misfits(runs: int, noise: float, misfit: str, number: int) -> Iterator[Figure]:
    """Yield what the intervals of root mean square and bias cover."""
    rng = generator("agreements", number)
    truth = np.linspace(10.0, 34.0, runs)
    shape = (TRIALS, runs)
    error = rng.standard_normal(shape) if misfit == "scattered" else np.ones(shape)
    reference = truth + np.sqrt(noise) * rng.standard_normal(shape)
    values = truth + error + np.sqrt(noise) * rng.standard_normal(shape)
    difference = values - reference
    total = (difference**2).sum(axis=1)
    ends = np.sqrt(np.maximum(total[:, None] / stats.chi2.isf([0.025, 0.975], runs) - 2.0 * noise, 0.0))
    bias = difference.mean(axis=1)
    reach = stats.t.isf(0.025, runs - 1) * difference.std(axis=1, ddof=1) / np.sqrt(runs)
    for trial in range(CHECKED):
        found = agreement(values[trial], reference[trial], noise, noise)
        left = found.rmse_without_noise
        require_same("agreement", ends[trial], [left.low, left.high])
        require_same("agreement", bias[trial] + reach[trial], found.bias.high)
    inside = (ends[:, 0] <= 1.0 + ROUNDING) & (ends[:, 1] >= 1.0 - ROUNDING)
    near = np.abs(bias - (0.0 if misfit == "scattered" else 1.0)) <= reach
    case = f"{runs} runs, noise {noise:g}, {misfit}"
    promise = EXACT if misfit == "scattered" else AT_LEAST
    yield Figure("agreement, rmse_without_noise", case, 0.95, promise, float(inside.mean()), TRIALS)
    if noise > 0.0:
        yield Figure("agreement, bias", case, 0.95, EXACT, float(near.mean()), TRIALS)
        size = np.sqrt((error**2).mean(axis=1))
        # The estimate is below the truth where the sum of squares is below its median at the truth.
        below = float(
            (stats.ncx2.cdf(total / (2.0 * noise), runs, runs * size**2 / (2.0 * noise)) < 0.5).mean()
        )
        yield Figure("agreement, estimate below", case, 0.5, EXACT, below, TRIALS)


def _lines(runs: int, noise: float, number: int) -> Iterator[Figure]:
    """Yield what the intervals of slope and rank correlation cover."""
    rng = generator("agreements", number)
    true_rho = 6.0 / np.pi * np.arcsin(0.5 * _correlation(noise))
    shape = (TRIALS // 8, runs)
    truth = SPREAD * rng.standard_normal(shape)
    values = SLOPE * truth + rng.standard_normal(shape) + np.sqrt(noise) * rng.standard_normal(shape)
    reference = truth + np.sqrt(noise) * rng.standard_normal(shape)
    inside = np.zeros(2)
    for row, column in zip(values, reference, strict=True):
        found = agreement(row, column, noise, noise)
        slope, rank = found.slope, found.spearman
        inside += [slope.low <= SLOPE <= slope.high, rank.low <= true_rho <= rank.high]
    share = inside / len(values)
    case = f"{runs} runs, noise {noise:g}"
    few = AT_LEAST if runs < 5 else EXACT
    yield Figure("agreement, slope", case, 0.95, few, share[0], len(values))
    yield Figure("agreement, spearman", case, 0.95, AT_LEAST, share[1], len(values))


def _correlation(noise: float) -> float:
    """Return the correlation of values and reference in `_lines`."""
    values = SLOPE**2 * SPREAD**2 + 1.0 + noise
    return SLOPE * SPREAD**2 / np.sqrt(values * (SPREAD**2 + noise))
