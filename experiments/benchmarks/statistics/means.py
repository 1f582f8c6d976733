"""Comparisons of means, equivalence and the noise floor: how often they are wrong."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from doe import Sample, compare_means, noise_floor
from doe.two_errors import TwoErrors
from experiments.benchmarks.statistics.coverage import AT_MOST, EXACT, Figure, generator

SIZES = ((2, 2), (2, 5), (3, 3), (3, 9), (4, 4), (4, 12), (5, 30))
RATIOS = (1.0 / 3.0, 1.0, 3.0)
"""Standard deviation of the first sample over that of the second."""

TRIALS = 10_000


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


def _promise(sizes: tuple[int, int], method: str) -> str:
    """Welch's holds from 4 values on; the guarded test has room to spare below."""
    if method == "guarded":
        return EXACT if min(sizes) >= 4 else AT_MOST
    return EXACT


def _compared(sizes: tuple[int, int], ratio: float, number: int) -> Iterator[Figure]:
    rng = generator("means", number)
    samples = [
        [Sample.of(sd * rng.standard_normal(size)) for _ in range(TRIALS)]
        for sd, size in zip((ratio, 1.0), sizes, strict=True)
    ]
    text = f"n = {sizes[0]} and {sizes[1]}, sd {ratio:.3g} and 1"
    methods = ("welch", "guarded") if min(sizes) >= 4 else ("guarded",)
    for method in methods:
        tests = [compare_means(a, b, method=method) for a, b in zip(*samples, strict=True)]
        alarms = np.mean([not test.interval[0] <= 0.0 <= test.interval[1] for test in tests])
        yield Figure(f"compare_means, {method}", text, 0.05, _promise(sizes, method), float(alarms), TRIALS)
        margin = 1.0 + ratio  # the true difference is the margin: equivalence is claimed by mistake
        shifted = (Sample(a.mean + margin, a.sd, a.n) for a in samples[0])
        tests = [compare_means(a, b, margin, method) for a, b in zip(shifted, samples[1], strict=True)]
        passed = np.mean([test.smallest_margin < margin for test in tests])
        yield Figure(f"equivalence, {method}", text, 0.05, AT_MOST, float(passed), TRIALS)


def _worst(sizes: tuple[int, int]) -> Figure:
    """Return the largest level of the guarded test over all ratios of the variances, by quadrature."""
    worst = TwoErrors(sizes[0] - 1.0, sizes[1] - 1.0).worst_level(0.05)
    text = f"n = {sizes[0]} and {sizes[1]}, worst ratio (quadrature)"
    return Figure("compare_means, guarded", text, 0.05, AT_MOST, worst, TRIALS)


def _floor(count: int, number: int) -> Iterator[Figure]:
    values = generator("means", number).normal(5.0, 1.3, (TRIALS, count))
    floors = [noise_floor(row) for row in values]
    for name, truth in (("mean", 5.0), ("sd", 1.3)):
        ends = np.array([getattr(floor, f"{name}_interval") for floor in floors])
        share = float(((ends[:, 0] <= truth) & (truth <= ends[:, 1])).mean())
        yield Figure(f"noise_floor, {name}", f"n = {count}", 0.95, EXACT, share, TRIALS)
