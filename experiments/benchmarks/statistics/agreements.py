"""Agreement: the misfit without noise, its bias, slope and rank correlation, at few runs and many."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from doe import agreement
from experiments.benchmarks.statistics.coverage import AT_LEAST, EXACT, Figure, generator

RUNS = (3, 5, 10, 30)
NOISES = (0.0, 0.5, 1.0)
"""Noise variances of the values, and of the reference, over the square of the misfit."""

MISFITS = ("scattered", "shifted")
"""Misfits drawn about zero, and one for all runs; both of root mean square 1."""

SLOPE = 0.8
SPREAD = 6.0
"""Standard deviation of the true reference over the misfit."""

TRIALS = 4_000


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
    inside, low = np.zeros(2), 0.0
    for _ in range(TRIALS):
        error = rng.standard_normal(runs) if misfit == "scattered" else np.ones(runs)
        values = truth + error + np.sqrt(noise) * rng.standard_normal(runs)
        reference = truth + np.sqrt(noise) * rng.standard_normal(runs)
        found = agreement(values, reference, noise, noise)
        left, bias = found.rmse_without_noise, found.bias
        mean = 0.0 if misfit == "scattered" else 1.0
        rounding = 1e-12
        inside += [
            left.low <= 1.0 + rounding and left.high + rounding >= 1.0,
            bias.low <= mean + rounding and mean <= bias.high + rounding,
        ]
        low += left.value < np.sqrt((error**2).mean()) * (1.0 - rounding)
    case = f"{runs} runs, noise {noise:g}, {misfit}"
    promise = EXACT if misfit == "scattered" else AT_LEAST
    yield Figure("agreement, rmse_without_noise", case, 0.95, promise, inside[0] / TRIALS, TRIALS)
    if noise > 0.0:
        yield Figure("agreement, estimate below", case, 0.5, EXACT, low / TRIALS, TRIALS)
        yield Figure("agreement, bias", case, 0.95, EXACT, inside[1] / TRIALS, TRIALS)


def _lines(runs: int, noise: float, number: int) -> Iterator[Figure]:
    """Yield what the intervals of slope and rank correlation cover."""
    rng = generator("agreements", number)
    inside = np.zeros(2)
    true_rho = 6.0 / np.pi * np.arcsin(0.5 * _correlation(noise))
    for _ in range(TRIALS):
        truth = SPREAD * rng.standard_normal(runs)
        values = SLOPE * truth + rng.standard_normal(runs) + np.sqrt(noise) * rng.standard_normal(runs)
        reference = truth + np.sqrt(noise) * rng.standard_normal(runs)
        found = agreement(values, reference, noise, noise)
        slope, rank = found.slope, found.spearman
        inside += [slope.low <= SLOPE <= slope.high, rank.low <= true_rho <= rank.high]
    case = f"{runs} runs, noise {noise:g}"
    yield Figure("agreement, slope", case, 0.95, EXACT, inside[0] / TRIALS, TRIALS)
    yield Figure("agreement, spearman", case, 0.95, EXACT, inside[1] / TRIALS, TRIALS)


def _correlation(noise: float) -> float:
    """Return the correlation of values and reference in `_lines`."""
    values = SLOPE**2 * SPREAD**2 + 1.0 + noise
    return SLOPE * SPREAD**2 / np.sqrt(values * (SPREAD**2 + noise))
