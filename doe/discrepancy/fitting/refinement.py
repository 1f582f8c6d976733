"""Fresh runs around an optimum, and the model that they correct.

An emulator of the whole range is never quite right at the optimum, and of two mechanisms together it knows
only the sum. Fresh runs show what it misses there: a shift of its parameters, errors of its coefficients, as
large as it states them, and a smooth function of the parameters, as large as makes the runs most likely.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from doe.discrepancy.emulation.bank import sobol_points
from doe.discrepancy.emulation.correction import Prior, condition_on, log_likelihood
from doe.discrepancy.emulation.noise import repeat_deviations
from doe.discrepancy.fitting.fit import Fitted, whiten
from doe.discrepancy.fitting.model import STEP, Model, Shift

LENGTH = 0.7
"""Length over which the smooth function changes, in half ranges: what the emulator's terms leave over."""
AMPLITUDES = 0.04 * 4.0 ** np.arange(6)
"""Variances of the smooth function tried, in units of the noise of one run."""
NOISE_WEIGHT = 20.0
"""Weight of the bank's noise beside the scatter of fresh repeats, in repeats."""
SPREAD_RANGE = (0.12, 0.3)
"""Least and largest standard deviation of the fresh points, in coded units."""
SHIFT_SD = 0.15
"""Prior standard deviation of a shift of parameters, in their ranges."""
SHIFT_STEPS = 4
"""Steps of Gauss and Newton that find it."""
MOVED = 1.5
"""An optimum that has moved by more of those standard deviations is simulated again."""


@dataclass(frozen=True, eq=False)
class Runs:
    """Fresh runs of one model that finished."""

    x: np.ndarray
    """Coded, (n, parameters)."""
    conditions: np.ndarray
    """(n,)."""
    values: np.ndarray
    """Of the emulator's observables, (n, observables)."""

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
    normal = stats.norm.ppf(sobol_points(count, len(fitted.x), seed).clip(0.01, 0.99))
    sd = np.sqrt(np.diag(fitted.spread))
    triangle = np.linalg.cholesky(fitted.spread / np.outer(sd, sd) + 1e-9 * np.eye(len(sd)))
    x = fitted.x + (normal @ triangle.T) * point_spread(fitted)
    x[0] = fitted.x
    return np.clip(x, fitted.model.lower, fitted.model.upper)


def has_moved(fitted: Fitted, centre: np.ndarray) -> bool:
    """Say if an optimum lies outside the fresh points around a centre."""
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
    plain = replace(model, shift=None, corrections={}, heading=0.0, views={})  # as runs are
    names = [c for c in model.emulator.surfaces if np.sum(runs.conditions == c) >= 2]
    ratio = _noise_ratio(plain, runs, names)
    shifted = replace(plain, shift=likeliest_shift(plain, runs, centre, ratio))
    seen = {name: _seen(shifted, runs, centre, ratio, name) for name in names}
    amplitude = max(AMPLITUDES, key=lambda tried: sum(one.log_likelihood(tried) for one in seen.values()))
    surfaces = model.emulator.surfaces
    corrections = {
        name: condition_on(
            one.prior(amplitude),
            one.x,
            one.missed,
            one.noise,
            surfaces[name].correlation(centre, model.mechanisms),
            np.sqrt(ratio),
        )
        for name, one in seen.items()
    }
    return replace(shifted, corrections=corrections, heading=model.heading, views=model.views)


def likeliest_shift(model: Model, runs: Runs, centre: np.ndarray, ratio: np.ndarray) -> Shift:
    """Find by how much the emulator's parameters are off, by least squares over fresh runs of all conditions.

    What its terms lack of one response they lack of all, as if a parameter were another. Seen in all
    observables together that is far beyond the noise where it is nothing in any of them.

    Parameters
    ----------
    model : Model
        Not corrected.
    runs : Runs
    centre : (parameters,) array
        Where the noise is taken.
    ratio : (observables,) array
        Variance of one run over the emulator's.
    """
    prior, sd = (SHIFT_SD * (model.upper - model.lower)) ** -2.0, np.sqrt(ratio)
    whitenings = {}
    for name in np.unique(runs.conditions):
        noise = model.emulator.surfaces[name].noise_covariance(centre, model.mechanisms)
        whitenings[name] = whiten(sd[:, None] * noise * sd)
    value = np.zeros(len(prior))
    for _ in range(SHIFT_STEPS):
        normal, descent = np.diag(prior), -prior * value
        for name, whitening in whitenings.items():
            here = runs.conditions == name
            x = runs.x[here] + value
            missed = (runs.values[here] - model.predict(x, name)) @ whitening.T
            slopes = np.array([_slope(model, x, step, name) @ whitening.T for step in np.eye(len(value))])
            normal = normal + np.einsum("pij,qij->pq", slopes, slopes)
            descent = descent + np.einsum("pij,ij->p", slopes, missed)
        value = value + np.linalg.solve(normal, descent)
    return Shift(value, np.linalg.inv(normal))


def _slope(model: Model, x: np.ndarray, direction: np.ndarray, condition: str) -> np.ndarray:
    """Derivatives in a direction at coded parameters (n, parameters), (n, observables)."""
    ahead, behind = (model.predict(x + side * STEP * direction, condition) for side in (1.0, -1.0))
    return np.asarray((ahead - behind) / (2.0 * STEP))


@dataclass(frozen=True, eq=False)
class _Seen:
    """Misses of the emulator in one condition."""

    x: np.ndarray
    """Points, each once, (n, parameters)."""
    missed: np.ndarray
    noise: np.ndarray
    """Mean of its runs less the emulated, and the variance of its noise, (n, observables)."""
    coefficients: np.ndarray
    """Covariances of the emulator's errors, (observables, terms, terms)."""
    misfit: np.ndarray
    variance: np.ndarray
    """Its statement of what no coefficient follows, and variance of one run, both where symmetry lets it act,
    (observables,)."""
    factors: int
    """Number of the factors; the other parameters are sizes."""

    def prior(self, amplitude: float) -> Prior:
        """Knowledge without the runs."""
        # Sizes run from 0 to 1, factors from -1 to 1.
        length = np.where(np.arange(self.x.shape[1]) < self.factors, LENGTH, LENGTH / 2.0)
        return Prior(self.factors, self.coefficients, self.misfit + amplitude * self.variance, length)

    def log_likelihood(self, amplitude: float) -> float:
        """Of what was missed."""
        return log_likelihood(self.prior(amplitude), self.x, self.missed, self.noise)


def _seen(model: Model, runs: Runs, centre: np.ndarray, ratio: np.ndarray, condition: str) -> _Seen:
    here = runs.conditions == condition
    surfaces, factors = model.emulator.surfaces[condition], len(model.emulator.space.factors)
    x, groups, counts = np.unique(runs.x[here], axis=0, return_inverse=True, return_counts=True)
    missed = np.zeros((len(x), len(ratio)))
    np.add.at(missed, groups.reshape(-1), runs.values[here])
    variance = np.diag(surfaces.noise_covariance(centre, model.mechanisms)) * ratio
    return _Seen(
        x,
        missed / counts[:, None] - model.predict(x, condition),
        variance / counts[:, None],
        surfaces.coefficient_errors(centre[:factors], model.mechanisms),
        surfaces.misfit_variance(centre, model.mechanisms),
        variance * surfaces.moved(model.mechanisms),
        factors,
    )


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
