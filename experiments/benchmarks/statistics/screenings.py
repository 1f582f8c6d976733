"""Screening: how often an inert factor is found significant, with and without an interaction."""

from __future__ import annotations

from collections.abc import Iterator

from doe import Factor, plackett_burman, screen
from experiments.benchmarks.statistics.coverage import AT_MOST, EXACT, Figure, generator

TRIALS = 3_000

INTERACTION = 6.0
"""Strong effect of the product of two factors, over the standard deviation of a run."""

DESIGNS = ((12, 5, 1), (12, 5, 3), (12, 8, 3), (8, 7, 1), (8, 7, 3), (12, 11, 1), (12, 11, 2), (20, 12, 1))
"""Runs, factors and replicates."""


def screenings() -> Iterator[Figure]:
    """Yield false alarms of the default error: of inert effects, and under one strong interaction."""
    for number, (runs, factors, replicates) in enumerate(DESIGNS):
        yield _alarms(runs, factors, replicates, 0.0, number)
        if runs % 8:  # in 8 or 16 runs an interaction falls wholly onto one column, which nothing tells apart
            yield _alarms(runs, factors, replicates, INTERACTION, 100 + number)


def _alarms(runs: int, factors: int, replicates: int, interaction: float, number: int) -> Figure:
    """Return the share of inert factors with p below .05."""
    rng = generator("screenings", number)
    design = plackett_burman([Factor(f"x{i}", -1.0, 1.0) for i in range(factors)], runs)
    mean = 0.5 * interaction * design.points["x0"] * design.points["x1"]
    alarms, rule = 0.0, ""
    for _ in range(TRIALS):
        result = screen(design, mean.to_numpy()[:, None] + rng.standard_normal((runs, replicates)))
        alarms += float((result.table["p"] < 0.05).mean())
        rule = result.error_rule
    what = "one strong interaction" if interaction else "all inert"
    case = f"{factors} factors in {runs} runs x {replicates}, {what} ({rule})"
    return Figure("screen", case, 0.05, AT_MOST if interaction else EXACT, alarms / TRIALS, TRIALS)
