"""Regions, joint fits and predictions: is the true setting, the true mean, the next observation inside."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe import Design, Factor, Goal, Sample, central_composite, fit_surface, joint_fit
from doe.quadratic import QuadraticForm
from doe.two_errors import TwoErrors
from experiments.benchmarks.statistics.coverage import AT_LEAST, EXACT, Figure, generator

FACTORS = (Factor("A", -1.0, 1.0), Factor("B", -1.0, 1.0))
DESIGN = central_composite(FACTORS, center=5)
POINT = np.array([[0.4, -0.5]])
"""The true setting, coded."""

MEASUREMENTS = (2, 3, 4, 5, 10)
RESPONSES = (1, 2, 3, 6)
SPREADS = (0.3, 1.0, 3.0)
"""Standard deviation of a measurement over that of a run."""

FITS, DRAWS = 4_000, 20
"""Fitted surfaces, and measured targets for each."""

SHARED = 0.8
"""Correlation of the errors of the responses of one run, where they hang together."""

CURVED = {
    "plane": (1.0, -0.8, 0.0, 0.0, 0.0),
    "curved": (1.0, -0.8, 0.5, 0.9, -0.7),
    "faint": (0.6, 0.3, 0.3, 0.4, 0.2),
}
"""True slopes, interaction and squares over the standard deviation of a run."""

PAIRS, JOINT_TRIALS = ((2, 2), (2, 6), (3, 2), (3, 3), (3, 6), (5, 3), (10, 3)), 600
"""Measurements and responses of the directions, and trials of each."""


def surfaces() -> Iterator[Figure]:
    """Yield the coverage of regions of one and more responses, of predictions, and of directions."""
    for number, name in enumerate(CURVED):
        yield from _reduced(name, number)
    for number, correlation in enumerate((0.0, SHARED)):
        yield from _joint(correlation, 10 + number)
    for number, (count, responses) in enumerate(PAIRS):
        yield _direction(count, responses, 20 + number)


def _true_mean(coded: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    a, b = coded.T
    return np.column_stack([a, b, a * b, a**2, b**2]) @ np.array(CURVED[name])


def _reduced(name: str, number: int) -> Iterator[Figure]:
    """Yield what a surface covers after backward elimination at .05, as every campaign fits it."""
    rng = generator("surfaces", number)
    mean, truth = _true_mean(DESIGN.points.to_numpy(), name), _true_mean(POINT, name)[0]
    point = dict(zip(DESIGN.names, POINT[0], strict=True))
    hits = {spread: np.zeros(len(MEASUREMENTS)) for spread in SPREADS}
    inside, fits = np.zeros(2), FITS // 2
    for _ in range(fits):
        surface = fit_surface(DESIGN, mean + rng.standard_normal(len(mean))).reduce(0.05)
        row = surface.predict(point, coded=True).iloc[0]
        fresh = truth + rng.standard_normal()
        inside += [
            row["confidence_low"] <= truth <= row["confidence_high"],
            row["prediction_low"] <= fresh <= row["prediction_high"],
        ]
        basis = surface.unselected
        fitted, se = (float(values[0]) for values in basis.evaluate(POINT))
        for spread, found in hits.items():
            for place, count in enumerate(MEASUREMENTS):
                agreed = _agreeing(rng, fitted - truth, se, basis.residual_df, count, spread, 0.05)
                found[place] += agreed.mean()
    yield Figure("predict, mean", f"{name}, reduced", 0.95, EXACT, inside[0] / fits, fits)
    yield Figure("predict, observation", f"{name}, reduced", 0.95, EXACT, inside[1] / fits, fits)
    for spread, found in hits.items():
        for count, share in zip(MEASUREMENTS, found / fits, strict=True):
            case = f"{name}, reduced, n = {count}, spread {spread:g}"
            promise = AT_LEAST if count < 4 else EXACT
            yield Figure("compatible_region", case, 0.95, promise, share, fits)


def _agreeing(
    rng: np.random.Generator,
    error: float | NDArray[np.float64],
    se: float | NDArray[np.float64],
    df: float,
    count: int,
    spread: float,
    alpha: float,
) -> NDArray[np.bool_]:
    """Return in which of the draws a measured target does not contradict the true setting.

    ``error`` is the fitted less the true mean, ``se`` its standard error; the target's mean and standard
    deviation are drawn, and compared by the region's rule.
    """
    shape = (DRAWS, *np.shape(error))
    target = spread * rng.standard_normal(shape) / np.sqrt(count)
    variance = spread**2 * rng.chisquare(count - 1, shape) / (count - 1) / count
    total = se**2 + variance
    critical = TwoErrors(df, count - 1.0).critical(variance / total, alpha)
    return np.abs(error - target) <= critical * np.sqrt(total)


def _joint(correlation: float, number: int) -> Iterator[Figure]:
    """Yield what a joint region covers: six responses by run, independent or hanging together."""
    rng = generator("surfaces", number)
    runs, most = len(DESIGN.coded), max(RESPONSES)
    surface = fit_surface(DESIGN, rng.standard_normal(runs))
    matrix, df = surface.fit.model.exog, surface.residual_df
    row = np.array([[1.0, *POINT[0], POINT[0].prod(), *POINT[0] ** 2]])
    solver, leverage = (
        np.linalg.pinv(matrix),
        float((row @ surface.fit.normalized_cov_params.to_numpy() @ row.T).item()),
    )
    own = rng.standard_normal((FITS, most, runs))
    noise = np.sqrt(correlation) * rng.standard_normal((FITS, 1, runs)) + np.sqrt(1.0 - correlation) * own
    left = noise - noise @ solver.T @ matrix.T
    error, se = noise @ solver.T @ row[0], np.sqrt(leverage * (left**2).sum(axis=-1) / df)
    kind = "independent" if correlation == 0.0 else f"correlated {correlation:g}"
    for count in MEASUREMENTS:
        for responses in RESPONSES:
            shares = [
                _agreeing(rng, error[:, :responses], se[:, :responses], df, count, spread, 0.05 / responses)
                .all(axis=-1)
                .mean()
                for spread in SPREADS
            ]
            for spread, share in zip(SPREADS, shares, strict=True):
                case = f"{responses} responses, {kind}, n = {count}, spread {spread:g}"
                promise = EXACT if responses == 1 and count >= 4 else AT_LEAST
                yield Figure("joint_fit", case, 0.95, promise, float(share), FITS)


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
    inside = 0.0
    for _ in range(JOINT_TRIALS):
        goals = {}
        for name in range(responses):
            angle = np.pi * (name + rng.uniform()) / responses
            true = 12.0 * np.array([0.0, np.cos(angle), np.sin(angle)])
            response = matrix @ true + rng.standard_normal(len(matrix))
            found = inverse @ matrix.T @ response
            variance = float(((response - matrix @ found) ** 2).sum()) / df
            target = POINT[0] @ true[1:] + rng.standard_normal(count)
            goals[str(name)] = Goal(_Plane(found, variance * inverse, df), Sample.of(target))
        fit = joint_fit(goals, resolution=12)
        vectors = fit.directions[DESIGN.names].to_numpy()
        away = np.abs(vectors @ (POINT[0] - fit.coded_point))
        reach = fit.directions["half_width"].to_numpy()
        inside += float((away <= reach).mean())
    case = f"{responses} responses, n = {count}"
    return Figure("directions.half_width", case, 0.95, AT_LEAST, inside / JOINT_TRIALS, JOINT_TRIALS)
