"""Regions, joint fits and predictions: is the true setting, the true mean, the next observation inside."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from doe import Factor, Goal, Sample, central_composite, fit_surface, joint_fit
from doe.samples.simultaneous import Simultaneous
from doe.samples.two_errors import TwoErrors
from experiments.evidence.accuracy.statistics.coverage import (
    AT_LEAST,
    CHECKED,
    EXACT,
    Figure,
    generator,
    require_same,
)

FACTORS = (Factor("A", -1.0, 1.0), Factor("B", -1.0, 1.0))
DESIGN = central_composite(FACTORS, center=5)
POINT = np.array([[0.4, -0.5]])
"""The true setting, coded."""

MEASUREMENTS = (2, 3, 4, 5, 10)
JOINT_MEASUREMENTS, RESPONSES = (2, 3, 5), (2, 6)
SPREADS = (0.3, 1.0, 3.0)
"""Standard deviation of a measurement over that of a run."""

FITS, DRAWS = 10_000, 5
"""Fitted surfaces, and measured targets for each."""

JOINT_TRIALS, JOINT_CHECKED = 1_500, 5
"""Joint fits of each case, and those of them that go through ``joint_fit`` itself."""

SHARED = 0.8
"""Correlation of the errors of the responses of one run, where they hang together."""

CURVED = {
    "plane": (1.0, -0.8, 0.0, 0.0, 0.0),
    "curved": (1.0, -0.8, 0.5, 0.9, -0.7),
    "faint": (0.6, 0.3, 0.3, 0.4, 0.2),
}
"""True slopes, interaction and squares over the standard deviation of a run."""

PAIRS, SLOPES, INTERVAL_TRIALS = ((2, 2), (2, 6), (3, 3), (5, 2), (10, 6)), (2.0, 12.0), 800
"""Measurements and responses of the intervals, slopes over the error of a run, and trials of each."""

RESOLUTION = 200
"""Cells along each factor of the intervals: a tenth of the narrowest."""


def surfaces() -> Iterator[Figure]:
    """Yield the coverage of regions of one response, and of predictions."""
    for number, name in enumerate(CURVED):
        yield from _reduced(name, number)


def joint_fits() -> Iterator[Figure]:
    """Yield the coverage of regions of several responses."""
    for number, correlation in enumerate((0.0, SHARED)):
        yield from _joint(correlation, 10 + number)


def intervals() -> Iterator[Figure]:
    """Yield the coverage of the intervals of a joint fit's factors, each by itself."""
    for number, ((count, responses), slope) in enumerate(product(PAIRS, SLOPES)):
        yield _interval(count, responses, slope, 20 + number)


def _matrix(coded: NDArray[np.float64]) -> NDArray[np.float64]:
    a, b = coded.T
    return np.column_stack([np.ones(len(a)), a, b, a * b, a**2, b**2])


MATRIX = _matrix(DESIGN.points.to_numpy())
HAT = MATRIX @ np.linalg.pinv(MATRIX)

LEVERAGE = float((_matrix(POINT) @ np.linalg.inv(MATRIX.T @ MATRIX) @ _matrix(POINT).T)[0, 0])
"""Variance of the fitted mean at the true setting, over that of a run."""

QUADRATURE = 24
"""Nodes for what the errors of the fits share."""


@dataclass(frozen=True)
class _Fits:
    """Quadratic fits of drawn responses, at the true setting; each array has the shape of the draws."""

    error: NDArray[np.float64]
    """Fitted less true mean."""
    se: NDArray[np.float64]
    sd: NDArray[np.float64]
    """Root of the residual mean square."""
    df: float

    @classmethod
    def of(cls, noise: NDArray[np.float64]) -> _Fits:
        """Return the fits of the errors of runs, shape (..., runs): the true surface is in the model."""
        row, df = _matrix(POINT)[0], len(MATRIX) - MATRIX.shape[1]
        coefficients = noise @ np.linalg.pinv(MATRIX).T
        sd = np.sqrt(((noise - noise @ HAT) ** 2).sum(axis=-1) / df)
        return cls(coefficients @ row, sd * np.sqrt(LEVERAGE), sd, float(df))


def _true_mean(coded: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    a, b = coded.T
    return np.column_stack([a, b, a * b, a**2, b**2]) @ np.array(CURVED[name])


def _reduced(name: str, number: int) -> Iterator[Figure]:
    """Yield what a surface covers after backward elimination at .05, as every campaign fits it."""
    rng = generator("surfaces", number)
    noise = rng.standard_normal((FITS, len(DESIGN.coded)))
    fits = _Fits.of(noise)
    _check_reduced(name, noise[:CHECKED], fits)
    t = stats.t.isf(0.025, fits.df)
    fresh = rng.standard_normal(FITS)
    mean = float((np.abs(fits.error) <= t * fits.se).mean())
    single = float((np.abs(fits.error - fresh) <= t * np.hypot(fits.se, fits.sd)).mean())
    yield Figure("predict, mean", f"{name}, reduced", 0.95, EXACT, mean, FITS)
    yield Figure("predict, observation", f"{name}, reduced", 0.95, EXACT, single, FITS)
    for count in MEASUREMENTS:
        for spread in SPREADS:
            case = f"{name}, reduced, n = {count}, spread {spread:g}"
            promise = AT_LEAST if count < 3 else EXACT
            share = float(_agreeing(rng, fits, count, spread).mean())
            yield Figure("compatible_region", case, 0.95, promise, share, FITS)


def _check_reduced(name: str, noise: NDArray[np.float64], fits: _Fits) -> None:
    """Hold the vectorised fits against ``reduce``, ``predict`` and the region's rule themselves."""
    mean, truth = _true_mean(DESIGN.points.to_numpy(), name), _true_mean(POINT, name)[0]
    point = dict(zip(DESIGN.names, POINT[0], strict=True))
    for trial, error in enumerate(noise):
        surface = fit_surface(DESIGN, mean + error).reduce(0.05)
        low, high = surface.predict(point, coded=True)[["prediction_low", "prediction_high"]].iloc[0]
        reach = stats.t.isf(0.025, fits.df) * np.hypot(fits.se[trial], fits.sd[trial])
        expected = truth + fits.error[trial] + np.array([-reach, reach])
        require_same("predict", expected, [low, high])
        target = Sample(truth + 0.5, 0.7, 3)
        share = target.se**2 / (fits.se[trial] ** 2 + target.se**2)
        limit = TwoErrors(fits.df, 2.0).critical(share, 0.05) * np.hypot(fits.se[trial], target.se)
        agreed = abs(fits.error[trial] - 0.5) <= limit
        require_same("compatible_region", agreed, surface.agrees(point, target, coded=True))


def _measured(
    rng: np.random.Generator, shape: tuple[int, ...], count: int, spread: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return drawn means of some measurements, and their estimated variances."""
    means = spread * rng.standard_normal(shape) / np.sqrt(count)
    return means, spread**2 * rng.chisquare(count - 1, shape) / (count - 1) / count


def _agreeing(rng: np.random.Generator, fits: _Fits, count: int, spread: float) -> NDArray[np.bool_]:
    """Return in which draws a measured target does not contradict the true setting, by the region's rule."""
    target, variance = _measured(rng, (DRAWS, *fits.error.shape), count, spread)
    total = fits.se**2 + variance
    critical = TwoErrors(fits.df, count - 1.0).critical(variance / total, 0.05)
    return np.asarray(np.abs(fits.error - target) <= critical * np.sqrt(total))


def _joint(correlation: float, number: int) -> Iterator[Figure]:
    """Yield what a joint region covers: responses by run, independent or hanging together.

    The estimated errors are drawn; given them, the probability that all responses agree is computed. So a
    trial is worth many of those that draw the differences too.
    """
    rng = generator("surfaces", number)
    own = rng.standard_normal((JOINT_TRIALS, max(RESPONSES), len(DESIGN.coded)))
    shared = rng.standard_normal((JOINT_TRIALS, 1, len(DESIGN.coded)))
    noise = np.sqrt(correlation) * shared + np.sqrt(1.0 - correlation) * own
    every = _Fits.of(noise)
    kind = f"correlated {correlation:g}" if correlation else "independent"
    for responses in RESPONSES:
        for count in JOINT_MEASUREMENTS:
            for spread in SPREADS:
                target, variance = _measured(rng, (JOINT_TRIALS, responses), count, spread)
                reach = np.empty((JOINT_TRIALS, responses))
                for trial in range(JOINT_TRIALS):
                    part = noise[trial, :responses]
                    reach[trial] = _reach(every, part, trial, variance[trial], count)
                    if trial < JOINT_CHECKED:
                        found = _through_joint_fit(part, target[trial], variance[trial], count)
                        differences = every.error[trial, :responses] - target[trial]
                        require_same("joint_fit", found, (np.abs(differences) <= reach[trial]).all())
                shares = all_within(reach, correlation, spread**2 / count)
                case = f"{responses} responses, {kind}, n = {count}, spread {spread:g}"
                yield _figure("joint_fit", case, count, shares)


def _figure(name: str, case: str, count: int, shares: NDArray[np.float64]) -> Figure:
    """Return a figure of .95 from the shares of its trials; exact from three measurements on."""
    promise = AT_LEAST if count < 3 else EXACT
    return Figure(name, case, 0.95, promise, float(shares.mean()), len(shares), float(shares.std()))


def all_within(reach: NDArray[np.float64], correlation: float, variance: float) -> NDArray[np.float64]:
    """Return the probability of each trial that no difference of fit and target is larger than its reach.

    The true errors of the fits have one variance and correlation, the targets' means a variance of their own:
    given what the fits share, the differences are independent. The mean over it is a quadrature.
    """
    nodes, weights = np.polynomial.hermite_e.hermegauss(QUADRATURE if correlation else 1)
    shift, reach = np.sqrt(correlation * LEVERAGE) * nodes[:, None], reach[:, None]
    sd = np.sqrt((1.0 - correlation) * LEVERAGE + variance)
    inside = (special.ndtr((reach - shift) / sd) - special.ndtr((-reach - shift) / sd)).prod(axis=-1)
    return np.asarray(inside @ weights / weights.sum())


def _reach(
    every: _Fits, noise: NDArray[np.float64], trial: int, variance: NDArray[np.float64], count: int
) -> NDArray[np.float64]:
    """Return the largest differences at the true setting that agree, by the rule of ``joint_fit`` there."""
    first = every.se[trial, : len(variance)] ** 2
    residuals = noise - noise @ HAT
    rules = [TwoErrors(every.df, count - 1.0)] * len(variance)
    test = Simultaneous(rules, variance, np.atleast_2d(np.corrcoef(residuals)), first[None], 0.05)
    return test.reach(first[None])[0]


def _through_joint_fit(
    noise: NDArray[np.float64], target: NDArray[np.float64], variance: NDArray[np.float64], count: int
) -> bool:
    """Tell the same by surfaces and ``joint_fit`` themselves, whose level is interpolated between nodes."""
    goals = {
        str(name): Goal(fit_surface(DESIGN, row), Sample(mean, np.sqrt(part * count), count))
        for name, (row, mean, part) in enumerate(zip(noise, target, variance, strict=True))
    }
    point = dict(zip(DESIGN.names, POINT[0], strict=True))
    return joint_fit(goals, resolution=40).agrees(point)


def _interval(count: int, responses: int, slope: float, number: int) -> Figure:
    """Return what ``JointFit.intervals`` hold: the true value of each factor, others free."""
    rng, held = generator("surfaces", number), np.empty((INTERVAL_TRIALS, 2))
    for trial in range(INTERVAL_TRIALS):
        angle = np.pi * (np.arange(responses) + rng.uniform(size=responses)) / responses
        slopes = slope * np.column_stack([np.cos(angle), np.sin(angle)])
        goals: dict[str, Goal] = {}
        for row in slopes:
            runs = DESIGN.points.to_numpy() @ row + rng.standard_normal(len(MATRIX))
            measured = POINT[0] @ row + rng.standard_normal(count)
            goals[str(len(goals))] = Goal(fit_surface(DESIGN, runs), Sample.of(measured))
        found = joint_fit(goals, resolution=RESOLUTION).intervals
        held[trial] = (found["low"] <= POINT[0]) & (POINT[0] <= found["high"])
    case = f"{responses} responses, n = {count}, slopes of {slope:g} errors"
    shares = held.mean(axis=1)
    found, spread = float(shares.mean()), float(shares.std())
    return Figure("JointFit.intervals", case, 0.95, AT_LEAST, found, len(shares), spread)
