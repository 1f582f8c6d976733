"""Comparisons of means, equivalence and the noise floor: how often they are wrong."""

from collections.abc import Iterator

import numpy as np
from scipy import stats

from doe import compare_means, noise_floor
from doe.samples.two_errors import TwoErrors, false_alarms
from experiments.evidence.accuracy.statistics.coverage import (
    AT_MOST,
    CHECKED,
    EXACT,
    Figure,
    generator,
    require_same,
)

SIZES = ((2, 2), (2, 5), (3, 3), (3, 9), (4, 4), (4, 12), (5, 30))
RATIOS = (1.0 / 3.0, 1.0, 3.0)
"""Standard deviation of the first sample over that of the second."""

TRIALS = 40_000


def means() -> Iterator[Figure]:
    """Yield levels and coverage of ``compare_means`` and ``noise_floor``."""
    case = 0
    for sizes in SIZES:
        yield _worst(sizes)
        for ratio in RATIOS:
            yield from _compared(sizes, ratio, case)
            case += 1
    for count in (2, 3, 5, 10):
        yield from _floor(count, 100 + count)


def _compared(sizes: tuple[int, int], ratio: float, number: int) -> Iterator[Figure]:
    rng = generator("means", number)
    text = f"n = {sizes[0]} and {sizes[1]}, sd {ratio:.3g} and 1"
    values = [sd * rng.standard_normal((TRIALS, size)) for sd, size in zip((ratio, 1.0), sizes, strict=True)]
    difference = values[0].mean(axis=1) - values[1].mean(axis=1)
    squares = [rows.var(axis=1, ddof=1) / rows.shape[1] for rows in values]
    se, share = np.sqrt(squares[0] + squares[1]), squares[1] / (squares[0] + squares[1])
    rule = TwoErrors(sizes[0] - 1.0, sizes[1] - 1.0)
    margin = 1.0 + ratio
    for method in ("welch", "guarded") if min(sizes) >= 4 else ("guarded",):
        one, two = (
            stats.t.isf(0.5 * alpha, rule.df(share)) if method == "welch" else rule.critical(share, alpha)
            for alpha in (0.10, 0.05)
        )
        # The true difference is the margin: equivalence is claimed by mistake.
        smallest = np.abs(difference + margin) + one * se
        for trial in range(CHECKED):
            test = compare_means(values[0][trial] + margin, values[1][trial], margin, method)
            require_same("compare_means", smallest[trial], test.smallest_margin)
            low, _ = test.interval
            require_same("compare_means", difference[trial] + margin - two[trial] * se[trial], low)
        alarms = float((np.abs(difference) > two * se).mean())
        promise = AT_MOST if method == "guarded" else EXACT
        yield Figure(f"compare_means, {method}", text, 0.05, promise, alarms, TRIALS)
        passed = float((smallest < margin).mean())
        yield Figure(f"equivalence, {method}", text, 0.05, AT_MOST, passed, TRIALS)


def _worst(sizes: tuple[int, int]) -> Figure:
    """Return the largest level of the guarded test over all ratios of the variances, by quadrature."""
    first, second = (size - 1.0 for size in sizes)
    worst = float(false_alarms(first, second, 0.05, *TwoErrors(first, second).rule(0.05)).max())
    text = f"n = {sizes[0]} and {sizes[1]}, worst ratio (quadrature)"
    return Figure("compare_means, guarded", text, 0.05, AT_MOST, worst, TRIALS)


def _floor(count: int, number: int) -> Iterator[Figure]:
    values = generator("means", number).normal(5.0, 1.3, (TRIALS, count))
    mean, sd = values.mean(axis=1), values.std(axis=1, ddof=1)
    reach = stats.t.isf(0.025, count - 1) * sd / np.sqrt(count)
    low, high = (sd * np.sqrt((count - 1) / stats.chi2.isf(q, count - 1)) for q in (0.025, 0.975))
    for trial in range(CHECKED):
        floor = noise_floor(values[trial])
        ends = [mean[trial] - reach[trial], mean[trial] + reach[trial], low[trial], high[trial]]
        require_same("noise_floor", ends, [*floor.mean_interval, *floor.sd_interval])
    shares = {"mean": np.abs(mean - 5.0) <= reach, "sd": (low <= 1.3) & (high >= 1.3)}
    for name, inside in shares.items():
        yield Figure(f"noise_floor, {name}", f"n = {count}", 0.95, EXACT, float(inside.mean()), TRIALS)
