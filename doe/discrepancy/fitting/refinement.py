"""Fresh runs around an optimum, and the model that they correct.

An emulator of the whole range errs at the optimum, and it knows only the sum of two mechanisms. Fresh runs
show its misses there (`misses`): a shift of its parameters, errors of its coefficients, as large as it states
them, and a smooth function, as large as makes the runs most likely.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from doe.discrepancy.emulation.bank import sobol_points
from doe.discrepancy.emulation.correction import condition_on
from doe.discrepancy.emulation.run_noise import repeat_deviations
from doe.discrepancy.fitting.fitted_model import Model
from doe.discrepancy.fitting.misses import AMPLITUDES, Runs, likeliest_shift, misses, with_bank_errors
from doe.discrepancy.fitting.model_fit import Fitted

NOISE_WEIGHT = 20.0
"""Weight of the bank's noise against the scatter of fresh repeats, in repeats."""
SPREAD_RANGE = (0.12, 0.3)
"""Least and largest standard deviation of the fresh points, in coded units."""
MOVED = 1.5
"""Distance of an optimum in those standard deviations from which on it is simulated again."""


def point_spread(fitted: Fitted) -> np.ndarray:
    """Return the standard deviations of fresh points around an optimum, (parameters,)."""
    return np.sqrt(np.diag(fitted.spread)).clip(*SPREAD_RANGE)


def points_around(fitted: Fitted, count: int, seed: int) -> np.ndarray:
    """Return normal Sobol points around an optimum, as uncertain as the fit; the first is the optimum."""
    normal = stats.norm.ppf(sobol_points(count, len(fitted.x), seed).clip(0.01, 0.99))
    sd = np.sqrt(np.diag(fitted.spread))
    triangle = np.linalg.cholesky(fitted.spread / np.outer(sd, sd) + 1e-9 * np.eye(len(sd)))
    x = fitted.x + (normal @ triangle.T) * point_spread(fitted)
    x[0] = fitted.x
    return np.clip(x, fitted.model.lower, fitted.model.upper)


def has_moved(fitted: Fitted, centre: np.ndarray) -> bool:
    """Return True if an optimum is outside the fresh points around a centre."""
    return bool((np.abs(fitted.x - centre) > MOVED * point_spread(fitted)).any())


def correct(model: Model, runs: Runs, centre: np.ndarray) -> Model:
    """Correct a model by fresh runs around an optimum, the centre (parameters,)."""
    plain = replace(model, shift=None, corrections={}, heading=0.0, views={})  # as runs are
    names = [c for c in model.emulator.surfaces if np.sum(runs.conditions == c) >= 2]
    ratio = _noise_ratio(plain, runs, names)
    shift = likeliest_shift(plain, runs, centre, ratio)
    moved = replace(plain, shift=shift)
    shift = with_bank_errors(shift, [misses(moved, runs, centre, ratio, name) for name in names], plain)
    shifted = replace(plain, shift=shift)
    seen = {name: misses(shifted, runs, centre, ratio, name) for name in names}
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


def _noise_ratio(model: Model, runs: Runs, conditions: Sequence[str]) -> np.ndarray:
    """Return the variance of fresh repeats over the emulator's, pooled over conditions, (observables,)."""
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
