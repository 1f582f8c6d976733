"""Joint regions with direct readings: is the true setting inside."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import special

from doe import FactorSurface, Goal, Sample, StatedValue, fit_surface, joint_fit
from doe.samples.simultaneous import Simultaneous
from doe.samples.two_errors import TwoErrors
from experiments.evidence.accuracy.statistics.coverage import AT_LEAST, EXACT, Figure, generator, require_same
from experiments.evidence.accuracy.statistics.surface_coverage import (
    DESIGN,
    HAT,
    JOINT_CHECKED,
    LEVERAGE,
    MATRIX,
    POINT,
)

TRIALS = 2_000
"""Drawn sets of measurements of each case."""

SETS = ((1, 1), (1, 2), (2, 2))
"""Simulated responses and factors with a direct reading."""

READINGS, MODELS = (1, 2, 3, 10), (0.0, 1.0)
"""Readings of a factor (1: the error is stated), and sd of the model over the standard error of the mean."""

COUNT = 5
"""Measurements of each simulated response, which scatter as the runs do."""


def direct_readings() -> Iterator[Figure]:
    """Yield the coverage of joint regions of simulated responses and direct readings."""
    for number, (size, readings, model) in enumerate(product(SETS, READINGS, MODELS)):
        yield covered(*size, readings, model, number)


def covered(
    responses: int, factors: int, readings: int, model: float, number: int, trials: int = TRIALS
) -> Figure:
    """Return the coverage of one case.

    The estimated errors are drawn; given them, the probability that all agree at the truth is computed.
    """
    rng, df = generator("direct", number), float(len(MATRIX) - MATRIX.shape[1])
    model_sd = model / np.sqrt(readings)
    rules = [TwoErrors(df, COUNT - 1.0)] * responses
    rules += [TwoErrors(np.inf, readings - 1.0 if readings > 1 else np.inf)] * factors
    true = np.array([LEVERAGE + 1.0 / COUNT] * responses + [model_sd**2 + 1.0 / readings] * factors)
    shares = np.empty(trials)
    for trial in range(trials):
        noise = rng.standard_normal((responses, len(MATRIX)))
        residuals = noise - noise @ HAT
        first = np.r_[LEVERAGE * (residuals**2).sum(axis=1) / df, np.full(factors, model_sd**2)]
        second = rng.chisquare(COUNT - 1, responses) / (COUNT - 1) / COUNT
        spread = rng.chisquare(readings - 1, factors) / (readings - 1) if readings > 1 else np.ones(factors)
        second = np.r_[second, spread / readings]
        correlation = np.eye(responses + factors)
        correlation[:responses, :responses] = np.atleast_2d(np.corrcoef(residuals))
        test = Simultaneous(rules, second, correlation, first[None], 0.05)
        reach = test.reach(first[None])[0]
        shares[trial] = (2.0 * special.ndtr(reach / np.sqrt(true)) - 1.0).prod()
        if trial < JOINT_CHECKED:
            error = np.sqrt(true) * rng.standard_normal(responses + factors)
            found = _through_joint_fit(noise, error, second, readings, model_sd)
            require_same("joint_fit, direct", found, (np.abs(error) <= reach).all())
    promise = AT_LEAST if readings == 2 else EXACT
    stated = "stated" if readings == 1 else f"n = {readings}"
    case = f"{responses} responses, {factors} read, {stated}, model {model:g}"
    return Figure("joint_fit, direct", case, 0.95, promise, float(shares.mean()), trials, float(shares.std()))


def _through_joint_fit(
    noise: NDArray[np.float64],
    error: NDArray[np.float64],
    variance: NDArray[np.float64],
    readings: int,
    model_sd: float,
) -> bool:
    """Tell the same by surfaces and ``joint_fit`` themselves, for given differences at the true setting."""
    point, sd, count = dict(zip(DESIGN.names, POINT[0], strict=True)), np.sqrt(variance), len(noise)
    goals: dict[str, Goal] = {}
    for row, off, own in zip(noise, error, sd, strict=False):
        surface = fit_surface(DESIGN, row)
        target = Sample(float(surface.evaluate(POINT)[0][0]) - off, own * np.sqrt(COUNT), COUNT)
        goals[f"response {len(goals)}"] = Goal(surface, target)
    for factor, off, own in zip(point, error[count:], sd[count:], strict=False):
        value = point[factor] - off
        sample = (
            StatedValue(value, own) if readings == 1 else Sample(value, own * np.sqrt(readings), readings)
        )
        goals[factor] = Goal(FactorSurface(DESIGN, factor, model_sd), sample)
    return joint_fit(goals, resolution=40).agrees(point)
