"""Fresh runs around an optimum, and the model that they correct.

An emulator of the whole range is never quite right at the optimum, and of two mechanisms together it knows
only the sum. What it misses there is a smooth function of the parameters, which the fresh runs show: how
large it is, relative to the error that the emulator states, is what makes them most likely.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from experiments.discover.bank import sobol
from experiments.discover.fitting import Fitted
from experiments.discover.kriging import krige, squared_exponential
from experiments.discover.model import Correction, Model
from experiments.discover.noise import repeat_deviations

LENGTH = 0.7
"""Length over which the emulator's error changes, in half ranges: what a quadratic leaves over."""
AMPLITUDES = 2.0 ** np.arange(8)
"""Variances of that error tried, in units of what the emulator states."""
LEAST_AMPLITUDE = 0.01
"""Least stated variance of that error, in units of the noise of one run."""
NOISE_WEIGHT = 20.0
"""Weight of the bank's noise beside the scatter of fresh repeats, in repeats."""
SPREAD_RANGE = (0.06, 0.3)
"""Least and largest standard deviation of the fresh points, in coded units."""
MOVED = 1.5
"""An optimum that has moved by more of those standard deviations is simulated again."""


@dataclass(frozen=True, eq=False)
class Runs:
    """Fresh runs of one model that finished.

    Attributes
    ----------
    x : (n, parameters) array
        Coded.
    conditions : (n,) array of str
    values : (n, observables) array
        Of the emulator's observables.
    """

    x: np.ndarray
    conditions: np.ndarray
    values: np.ndarray

    def joined(self, other: Runs) -> Runs:
        """These and other runs."""
        return Runs(
            np.concatenate([self.x, other.x]),
            np.concatenate([self.conditions, other.conditions]),
            np.concatenate([self.values, other.values]),
        )


def point_spread(fitted: Fitted) -> np.ndarray:
    """Standard deviations that fresh points have around an optimum, (parameters,)."""
    return np.sqrt(np.diag(fitted.spread)).clip(*SPREAD_RANGE)


def points_around(fitted: Fitted, count: int, seed: int) -> np.ndarray:
    """Normal Sobol points around an optimum as uncertain as the fit, the first at it, (count, parameters)."""
    normal = stats.norm.ppf(sobol(count, len(fitted.x), seed).clip(0.01, 0.99))
    sd = np.sqrt(np.diag(fitted.spread))
    triangle = np.linalg.cholesky(fitted.spread / np.outer(sd, sd) + 1e-9 * np.eye(len(sd)))
    x = fitted.x + (normal @ triangle.T) * point_spread(fitted)
    x[0] = fitted.x
    return np.clip(x, fitted.model.lower, fitted.model.upper)


def has_moved(fitted: Fitted, centre: np.ndarray) -> bool:
    """Whether an optimum lies outside the fresh points around a centre."""
    return bool((np.abs(fitted.x - centre) > MOVED * point_spread(fitted)).any())


def correct(model: Model, runs: Runs, centre: np.ndarray) -> Model:
    """Correct a model by fresh runs.

    Parameters
    ----------
    model : Model
    runs : Runs
    centre : (parameters,) array
        Optimum that they lie around.
    """
    plain = replace(model, corrections={})
    names = [c for c in model.emulator.surfaces if np.sum(runs.conditions == c) >= 2]
    factors = len(model.emulator.space.factors)
    # Sizes run from 0 to 1, factors from -1 to 1.
    length = np.where(np.arange(len(centre)) < factors, LENGTH, LENGTH / 2.0)
    ratio = _noise_ratio(plain, runs, names)
    local = {name: _local(plain, runs, centre, length, ratio, name) for name in names}
    amplitude = _likeliest(list(local.values()))
    corrections = {}
    for name, part in local.items():
        parts = [
            krige(
                part.x,
                part.missed[:, j],
                np.full(len(part.x), part.noise[j]),
                amplitude * part.prior[j],
                length,
            )
            for j in range(len(ratio))
        ]
        correlation = model.emulator.surfaces[name].noise.correlation
        corrections[name] = Correction(tuple(parts), correlation, np.sqrt(ratio))
    return replace(model, corrections=corrections)


@dataclass(frozen=True, eq=False)
class _Local:
    """What the emulator misses in one condition: runs, residuals, noise and stated error a run, kernel."""

    x: np.ndarray
    missed: np.ndarray
    noise: np.ndarray
    prior: np.ndarray
    kernel: np.ndarray


def _local(
    model: Model, runs: Runs, centre: np.ndarray, length: np.ndarray, ratio: np.ndarray, condition: str
) -> _Local:
    here = runs.conditions == condition
    x = runs.x[here]
    surfaces = model.emulator.surfaces[condition]
    noise = np.diag(surfaces.noise_covariance(centre, model.mechanisms)) * ratio
    stated = np.diag(surfaces.error(centre, model.mechanisms))
    prior = np.maximum(stated, LEAST_AMPLITUDE * noise)
    missed = runs.values[here] - model.predict(x, condition)
    return _Local(x, missed, noise, prior, squared_exponential(x / length, x / length))


def _likeliest(parts: Sequence[_Local]) -> float:
    """Amplitude, common to all conditions and observables, of largest likelihood."""
    likelihood = np.zeros(len(AMPLITUDES))
    for part in parts:
        spectrum, vectors = np.linalg.eigh(part.kernel)
        squares = (vectors.T @ part.missed) ** 2
        for index, amplitude in enumerate(AMPLITUDES):
            variance = np.maximum(spectrum, 0.0)[:, None] * (amplitude * part.prior) + part.noise
            likelihood[index] -= 0.5 * float(np.sum(np.log(variance) + squares / variance))
    return float(AMPLITUDES[int(np.argmax(likelihood))])


def _noise_ratio(model: Model, runs: Runs, conditions: Sequence[str]) -> np.ndarray:
    """Variance of fresh repeats over the emulator's, pooled over conditions, (observables,)."""
    total, count = np.full(len(model.emulator.observables), NOISE_WEIGHT), NOISE_WEIGHT
    for name in conditions:
        here = np.flatnonzero(runs.conditions == name)
        _, groups = np.unique(runs.x[here], axis=0, return_inverse=True)
        rows, deviations = repeat_deviations(groups.reshape(-1), runs.values[here])
        for x, deviation in zip(runs.x[here][rows], deviations, strict=True):
            known = np.diag(model.emulator.surfaces[name].noise_covariance(x, model.mechanisms))
            total = total + deviation**2 / known
        count += len(rows)
    return total / count
