"""Screening: how often an inert factor is found significant, with and without an interaction."""

from collections.abc import Iterator

import numpy as np

from doe import Factor, plackett_burman, screen
from experiments.evidence.accuracy.statistics.coverage import (
    AT_MOST,
    CHECKED,
    EXACT,
    Figure,
    generator,
    require_same,
)

TRIALS = 10_000

INTERACTION = 6.0
"""Strong effect of the product of two factors, over the standard deviation of a run."""

ALIASED = 0.07
"""Level under a strong interaction in 20 runs: it falls on one column by 60 %, on the others by 20 %."""

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
    values = mean.to_numpy()[:, None] + rng.standard_normal((TRIALS, runs, replicates))
    spare = runs - 1 - factors
    matrix = np.column_stack([np.ones(runs), design.coded.to_numpy()])
    effects = 2.0 * np.einsum("ij,tj->ti", np.linalg.inv(matrix), values.mean(axis=2))[:, 1:]
    rule = "dummies" if spare else "lenth"
    if spare:  # a dummy's effect has the standard error of a factor's
        error = np.sqrt((effects[:, factors:] ** 2).mean(axis=1))
    else:
        size = np.abs(effects)
        trimmed = np.where(size < 2.5 * 1.5 * np.median(size, axis=1, keepdims=True), size, np.nan)
        error = 1.5 * np.nanmedian(trimmed, axis=1)
    t = np.abs(effects[:, :factors]) / error[:, None]
    for trial in range(CHECKED):
        result = screen(design, values[trial])
        require_same("screen", t[trial], result.table["t"].abs())
        if result.error_rule != rule:
            raise ValueError(f"the default error is {result.error_rule}, the record holds {rule}")
        critical = result.critical_t(0.05)
        require_same("screen", result.table["p"] < 0.05, t[trial] > critical)
    alarms = float((t > critical).mean())
    what = "one strong interaction" if interaction else "all inert"
    case = f"{factors} factors in {runs} runs x {replicates}, {what} ({rule})"
    stated = ALIASED if interaction and runs == 20 else 0.05
    return Figure("screen", case, stated, AT_MOST if interaction else EXACT, alarms, TRIALS)
