"""Calibration on curves by generalised least squares, and forecasts of further curves.

A measured curve is the emulated one at the true settings, plus a miss of the model, plus the error of its
reading (M. C. Kennedy and A. O'Hagan, J. R. Stat. Soc. B 63 (2001) 425-464). The miss is a smooth random
function of place and condition. Its size and length are those of the largest likelihood, so curves that no
setting meets widen the compatible region and the bands of a forecast.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from doe.arguments import checked_count, checked_kind, checked_list, checked_map, checked_number, real_array
from doe.curves.compatible import compatible_points, even_points
from doe.curves.curve_emulator import CurveEmulator
from doe.errors import RuleError
from doe.numerics.one_thread import in_one_thread

Array = NDArray[np.float64]


class MeasuredCurve(NamedTuple):
    """A curve that was measured under one condition."""

    condition: str
    coordinate: float
    """Place of the condition on a scale on which the model's miss is smooth, e.g. the logarithm of a speed.
    """
    columns: NDArray[np.int_]
    """Numbers of the emulator's places at which it was measured."""
    values: Array
    """Values there."""


@dataclass(frozen=True)
class Miss:
    """Covariance of what a model misses, smooth over places and over coordinates, there of length 1."""

    sd: float
    """Standard deviation, in the unit of the curves."""
    length: float
    """Correlation length, in the unit of the places."""
    reading: float
    """Standard deviation of the error of one reading, independent from place to place."""

    def covariance(self, a: tuple[Array, Array], b: tuple[Array, Array]) -> Array:
        """Return the covariance without the error of reading, between two sets of coordinates and places."""
        apart = a[0][:, None] - b[0], (a[1][:, None] - b[1]) / self.length
        return np.asarray(self.sd**2 * np.exp(-0.5 * (apart[0] ** 2 + apart[1] ** 2)))


class Forecast(NamedTuple):
    """Forecast of a curve that was not measured."""

    expected: Array
    low: Array
    high: Array
    """Ends of the band; a measured value is within it with the requested probability."""


@dataclass(frozen=True, eq=False)
class CurveFit:
    """Settings that measured curves are compatible with."""

    emulators: Mapping[str, CurveEmulator]
    """Emulators by condition."""
    places: Array
    """Places of the emulators' curves."""
    curves: tuple[MeasuredCurve, ...]
    miss: Miss
    settings: Array
    """Coded settings of equal weight, shape (draws, settings)."""
    best: Array
    """Settings of the smallest chi2."""
    chi2: float
    """Generalised least squares of all curves at the best settings."""

    @property
    def count(self) -> int:
        """Number of measured values."""
        return sum(len(curve.values) for curve in self.curves)

    def residuals(self, settings: Array) -> Array:
        """Return measured less emulated values, (points, values)."""
        return np.hstack([
            curve.values - self.emulators[curve.condition].predict(settings)[0][:, curve.columns]
            for curve in self.curves
        ])  # fmt: skip

    def forecast(
        self, condition: str, coordinate: float, level: float, seed: int, draws: int = 4000
    ) -> Forecast:
        """Forecast the curve of a condition, with the band that holds a measured value with a probability.

        The band covers the compatible settings, the error of the emulators, the noise of a run, the model's
        miss given its misses of the measured curves, and the error of reading.
        """
        rng = np.random.default_rng(seed)
        emulator = self.emulators[condition]
        chosen = self.settings[rng.integers(len(self.settings), size=draws)]
        scores, variances = emulator.scores(chosen)
        scores = scores + rng.normal(size=scores.shape) * np.sqrt(variances + emulator.noise(chosen))
        curves = emulator.mean + scores @ emulator.components
        curves += rng.normal(size=curves.shape) * np.sqrt(emulator.remainder)
        here = np.full(len(self.places), coordinate), self.places
        known = _where(self.curves, self.places)
        own = self.miss.covariance(known, known) + _unknown(self, self.best)
        weights = cho_solve(cho_factor(own), self.miss.covariance(known, here)).T
        left = self.miss.covariance(here, here) - weights @ self.miss.covariance(known, here)
        curves += self.residuals(chosen) @ weights.T
        values, directions = np.linalg.eigh(left)
        curves += rng.normal(size=curves.shape) * np.sqrt(np.maximum(values, 0.0)) @ directions.T
        curves += rng.normal(size=curves.shape) * self.miss.reading
        low, middle, high = np.quantile(curves, [(1 - level) / 2, 0.5, (1 + level) / 2], axis=0)
        return Forecast(middle, low, high)


@in_one_thread
def fit_curves(
    emulators: Mapping[str, CurveEmulator],
    places: Array,
    curves: Sequence[MeasuredCurve],
    reading: float,
    seed: int,
    free: Array | None = None,
) -> CurveFit:
    """Find the settings that curves are compatible with, and the model's miss of them.

    Parameters
    ----------
    emulators, places
        Emulators by condition, and the places of their curves.
    curves
        Measured curves; places whose errors are the same one add nothing.
    reading
        Standard deviation of the error of one reading.
    free
        Matrix from free settings to coded settings, shape (settings, free ones), where some settings are tied
        to one another. Default: all are free.

    Raises
    ------
    DesignError
        No curve, or an argument of another kind.
    """
    _check(emulators, curves)
    places, reading = real_array("places", places), checked_number("reading", reading, above=0.0)
    checked_count("seed", seed, least=0)
    tie = np.eye(_settings_of(emulators)) if free is None else np.asarray(free, dtype=np.float64)
    rng = np.random.default_rng(seed)
    first = even_points(tie.shape[1], rng)
    trial = CurveFit(
        emulators, places, tuple(curves), Miss(1.0, 8.0, reading), first, np.zeros(len(tie)), np.nan
    )
    miss = trial.miss
    for _ in range(2):
        nearest = _nearest(trial, first @ tie.T, miss)
        miss = _likeliest(trial, nearest, _misses(reading, places))
        trial = replace(trial, best=nearest)
    found = compatible_points(lambda points: _log_likelihoods(trial, points @ tie.T, miss), first, rng)
    best = found.best @ tie.T
    chi2 = float(_chi2(trial, best[None], miss)[0])
    return CurveFit(emulators, places, tuple(curves), miss, found.likely @ tie.T, best, chi2)


def _check(emulators: Mapping[str, CurveEmulator], curves: Sequence[MeasuredCurve]) -> None:
    """Raise an error for anything but emulators and measured curves of their conditions."""
    for emulator in checked_map("emulators", emulators).values():
        checked_kind("an emulator", emulator, CurveEmulator)
    if not checked_list("curves", curves):
        raise RuleError("curves", "must have at least one measured curve", "an empty list")
    for curve in curves:
        if checked_kind("a measured curve", curve, MeasuredCurve).condition not in emulators:
            raise RuleError("curves", f"must be of conditions {', '.join(emulators)}", curve.condition)


def _settings_of(emulators: Mapping[str, CurveEmulator]) -> int:
    return next(iter(emulators.values())).trends.shape[1] - 1


def _misses(reading: float, places: Array) -> list[Miss]:
    """Return candidates: sizes in steps of a quarter, lengths from a fortieth of the span of places."""
    span = float(np.ptp(places))
    sizes = 0.25 * reading * 1.25 ** np.arange(26)
    return [Miss(float(sd), span / part, reading) for sd in sizes for part in (40, 20, 10, 5, 2.5)]


def _where(curves: Sequence[MeasuredCurve], places: Array) -> tuple[Array, Array]:
    """Return coordinates of conditions, and places, of all measured values."""
    coordinates = [np.full(len(curve.values), curve.coordinate) for curve in curves]
    return np.concatenate(coordinates), np.concatenate([places[curve.columns] for curve in curves])


def _unknown(fit: CurveFit, settings: Array) -> Array:
    """Return the covariance of the errors of reading and of the emulators at settings, (values, values)."""
    size = fit.count
    total, start = fit.miss.reading**2 * np.eye(size), 0
    for curve in fit.curves:
        emulator = fit.emulators[curve.condition]
        variances = emulator.scores(settings)[1][0]
        end = start + len(curve.values)
        total[start:end, start:end] += emulator.covariance(variances, curve.columns)
        start = end
    return total


def _nearest(fit: CurveFit, settings: Array, miss: Miss) -> Array:
    """Return the settings of the smallest chi2."""
    return np.asarray(settings[int(np.argmin(_chi2(fit, settings, miss)))])


def _likeliest(fit: CurveFit, settings: Array, misses: Sequence[Miss]) -> Miss:
    """Return the miss of the largest likelihood at settings."""
    where, unknown = _where(fit.curves, fit.places), _unknown(fit, settings)
    residual = fit.residuals(settings)[0]

    def likelihood(miss: Miss) -> float:
        factor = cho_factor(miss.covariance(where, where) + unknown)
        return float(-0.5 * residual @ cho_solve(factor, residual) - np.log(np.diag(factor[0])).sum())

    return max(misses, key=likelihood)


def _chi2(fit: CurveFit, settings: Array, miss: Miss) -> Array:
    """Return generalised least squares at settings, with the emulators' covariance at the best so far."""
    where = _where(fit.curves, fit.places)
    covariance = miss.covariance(where, where) + _unknown(fit, fit.best)
    residuals = fit.residuals(settings)
    return np.asarray(np.einsum("ij,ij->i", residuals, cho_solve(cho_factor(covariance), residuals.T).T))


def _log_likelihoods(fit: CurveFit, settings: Array, miss: Miss) -> Array:
    """Return log-likelihoods of settings; minus infinity outside the design."""
    inside = (np.abs(settings) <= 1.0).all(axis=1)
    return np.where(inside, -0.5 * _chi2(fit, settings, miss), -np.inf)
