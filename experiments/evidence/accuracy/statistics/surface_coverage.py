"""Regions, joint fits and predictions: is the true setting, the true mean, the next observation inside."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, special, stats

from doe import Design, Factor, Goal, Sample, central_composite, fit_surface, joint_fit
from doe.response.joint_fit import PULL
from doe.response.quadratic import QuadraticForm
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

PAIRS, PAIR_TRIALS = ((2, 2), (2, 6), (3, 2), (3, 3), (5, 2), (10, 6)), 1_600
"""Measurements and responses of the directions, and trials of each."""


def surfaces() -> Iterator[Figure]:
    """Yield the coverage of regions of one response, and of predictions."""
    for number, name in enumerate(CURVED):
        yield from _reduced(name, number)


def joint_fits() -> Iterator[Figure]:
    """Yield the coverage of regions of several responses."""
    for number, correlation in enumerate((0.0, SHARED)):
        yield from _joint(correlation, 10 + number)


def directions() -> Iterator[Figure]:
    """Yield the coverage of the half widths along the directions of a joint fit."""
    for number, (count, responses) in enumerate(PAIRS):
        yield _direction(count, responses, 20 + number)


def _matrix(coded: NDArray[np.float64]) -> NDArray[np.float64]:
    a, b = coded.T
    return np.column_stack([np.ones(len(a)), a, b, a * b, a**2, b**2])


MATRIX = _matrix(DESIGN.points.to_numpy())
HAT = MATRIX @ np.linalg.pinv(MATRIX)

LEVERAGE = float((_matrix(POINT) @ np.linalg.inv(MATRIX.T @ MATRIX) @ _matrix(POINT).T)[0, 0])
"""Variance of the fitted mean at the true setting, over that of a run."""

NEAR = 1e-4
"""Relative difference that two searches for the smallest chi2 may leave."""

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


@dataclass(frozen=True)
class _Plane:
    """A fitted plane: estimated coefficients and their covariance."""

    coefficients: NDArray[np.float64]
    covariance: NDArray[np.float64]
    residual_df: float
    design: Design = DESIGN

    @property
    def quadratic_form(self) -> QuadraticForm:
        return QuadraticForm(float(self.coefficients[0]), self.coefficients[1:], np.zeros((2, 2)))

    def evaluate(self, coded: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        points = np.atleast_2d(np.asarray(coded, dtype=np.float64))
        rows = np.column_stack([np.ones(len(points)), points])
        return rows @ self.coefficients, np.sqrt(np.einsum("ij,jk,ik->i", rows, self.covariance, rows))


def _direction(count: int, responses: int, number: int) -> Figure:
    """Return what ``directions.half_width`` covers: the true setting along both directions of a joint fit."""
    rng = generator("surfaces", number)
    matrix = np.column_stack([np.ones(len(DESIGN.coded)), DESIGN.points.to_numpy()])
    inverse, df = np.linalg.inv(matrix.T @ matrix), len(matrix) - 3.0
    shares = np.empty(PAIR_TRIALS)
    for trial in range(PAIR_TRIALS):
        angle = np.pi * (np.arange(responses) + rng.uniform(size=responses)) / responses
        slopes = 12.0 * np.column_stack([np.cos(angle), np.sin(angle)])
        noise = rng.standard_normal((responses, len(matrix)))
        found = noise @ matrix @ inverse
        variance = ((noise - found @ matrix.T) ** 2).sum(axis=1) / df
        found[:, 1:] += slopes
        measured = (slopes @ POINT[0])[:, None] + rng.standard_normal((responses, count))
        targets = [Sample.of(row) for row in measured]
        planes = [_Plane(row, part * inverse, df) for row, part in zip(found, variance, strict=True)]
        point, vectors, reach = _half_widths(planes, targets)
        if trial < JOINT_CHECKED:
            pairs = zip(planes, targets, strict=True)
            fit = joint_fit({str(name): Goal(*pair) for name, pair in enumerate(pairs)}, resolution=12)
            require_same("directions", np.abs(vectors.T), fit.directions[DESIGN.names].abs(), NEAR)
            require_same("directions", reach, fit.directions["half_width"], NEAR)
            require_same("directions", point, fit.coded_point, NEAR)
        shares[trial] = (np.abs(vectors.T @ (POINT[0] - point)) <= reach).mean()
    return _figure("directions.half_width", f"{responses} responses, n = {count}", count, shares)


def _half_widths(
    planes: list[_Plane], targets: list[Sample]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the point of the smallest chi2, the directions there and the half widths along them."""
    coefficients = np.array([plane.coefficients for plane in planes])
    covariance = np.array([plane.covariance for plane in planes])
    goal, second = np.array([(target.mean, target.se**2) for target in targets]).T

    def first(point: NDArray[np.float64]) -> NDArray[np.float64]:
        row = np.array([1.0, *point])
        return np.asarray(row @ covariance @ row)

    def chi2(point: NDArray[np.float64]) -> float:
        gap = coefficients @ np.array([1.0, *point]) - goal
        return float((gap**2 / (first(point) + second)).sum() + PULL * point @ point)

    start = np.linalg.lstsq(coefficients[:, 1:], goal - coefficients[:, 0], rcond=None)[0]
    point = optimize.minimize(chi2, start, method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-9}).x
    error = first(point)
    slopes = coefficients[:, 1:] / np.sqrt(error + second)[:, None]
    vectors = np.linalg.eigh(slopes.T @ slopes)[1][:, ::-1]
    rules = [
        TwoErrors(plane.residual_df, float(target.df)) for plane, target in zip(planes, targets, strict=True)
    ]
    together = Simultaneous(rules, second, np.eye(len(planes)), error[None], 0.05)
    reach = [together.half_width(coefficients[:, 1:], vector, error) for vector in vectors.T]
    return point, vectors, np.array(reach)
