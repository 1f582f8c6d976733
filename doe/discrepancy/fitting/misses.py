"""Misses of an emulator at fresh runs: a shift of its parameters, and the size of the rest.

Residuals of fresh runs contain the noise, errors of the emulator's coefficients, a smooth function that its
terms lack, and the effect of a shift of the parameters in all observables and conditions together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from doe.discrepancy.emulation.correction import Prior, log_likelihood
from doe.discrepancy.fitting.fitted_model import STEP, Model, Shift
from doe.discrepancy.fitting.model_fit import whiten

LENGTH = 0.7
"""Length of the smooth function, in half ranges."""
AMPLITUDES = 0.04 * 4.0 ** np.arange(6)
"""Variances of the smooth function tried, in units of the noise of one run."""
SHIFT_SD = 0.15
"""Prior standard deviation of a shift of parameters, in their ranges."""
SHIFT_STEPS = 4
"""Gauss-Newton steps that find it."""


@dataclass(frozen=True, eq=False)
class Runs:
    """Finished fresh runs of one model."""

    x: np.ndarray
    """Coded parameters, (n, parameters)."""
    conditions: np.ndarray
    """(n,)."""
    values: np.ndarray
    """Values of the emulator's observables, (n, observables)."""

    def joined(self, other: Runs) -> Runs:
        """Return these and other runs."""
        return Runs(
            np.concatenate([self.x, other.x]),
            np.concatenate([self.conditions, other.conditions]),
            np.concatenate([self.values, other.values]),
        )


def likeliest_shift(model: Model, runs: Runs, centre: np.ndarray, ratio: np.ndarray) -> Shift:
    """Find the error of the emulator's parameters, by least squares over fresh runs of all conditions.

    A misfit of its terms affects all responses alike, as if a parameter were another. It may be visible in
    all observables together and in no single one. The noise is that at the centre, times the ratio of
    variances (observables,).
    """
    prior, sd = _precision(model), np.sqrt(ratio)
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
    """Return derivatives in a direction at coded parameters (n, parameters), (n, observables)."""
    ahead, behind = (model.predict(x + side * STEP * direction, condition) for side in (1.0, -1.0))
    return np.asarray((ahead - behind) / (2.0 * STEP))


@dataclass(frozen=True, eq=False)
class Misses:
    """Misses of the emulator in one condition."""

    x: np.ndarray
    """Distinct points, (n, parameters)."""
    missed: np.ndarray
    noise: np.ndarray
    """Mean of its runs less the emulated, and the variance of its noise, (n, observables)."""
    slopes: np.ndarray
    """Change of the emulated by a shift of each parameter, (parameters, n, observables)."""
    correlation: np.ndarray
    """Correlation of the noise, (observables, observables)."""
    stated: Prior
    """Knowledge without the runs, its smooth function the stated variance beyond all coefficients."""
    variance: np.ndarray
    """Variance of one run where symmetry allows an effect, (observables,)."""

    def prior(self, amplitude: float) -> Prior:
        """Return the knowledge without the runs, with more of the smooth function."""
        return replace(self.stated, amplitude=self.stated.amplitude + amplitude * self.variance)

    def log_likelihood(self, amplitude: float) -> float:
        """Return the log-likelihood of the misses."""
        return log_likelihood(self.prior(amplitude), self.x, self.missed, self.noise)

    @property
    def whitened(self) -> tuple[np.ndarray, np.ndarray]:
        """Misses (n, observables) and slopes, whitened by the noise and the errors that the bank leaves.

        Errors of two observables are taken as correlated as their noise.
        """
        open_ = self.prior(0.0).covariance(self.x, self.x)
        whole = np.linalg.cholesky(open_ + self.noise.T[:, :, None] * np.eye(len(self.x)))
        inverse, across = np.linalg.inv(whole), whiten(self.correlation).T
        missed = np.einsum("jmn,nj->mj", inverse, self.missed) @ across
        return missed, np.einsum("jmn,pnj->pmj", inverse, self.slopes) @ across


def misses(model: Model, runs: Runs, centre: np.ndarray, ratio: np.ndarray, condition: str) -> Misses:
    """Collect the misses of a shifted, uncorrected model in one condition (`likeliest_shift`)."""
    here = runs.conditions == condition
    surfaces, factors = model.emulator.surfaces[condition], len(model.emulator.space.factors)
    x, groups, counts = np.unique(runs.x[here], axis=0, return_inverse=True, return_counts=True)
    missed = np.zeros((len(x), len(ratio)))
    np.add.at(missed, groups.reshape(-1), runs.values[here])
    variance = np.diag(surfaces.noise_covariance(centre, model.mechanisms)) * ratio
    stated = Prior(
        factors,
        surfaces.coefficient_errors(centre[:factors], model.mechanisms),
        surfaces.coefficient_chance(centre[:factors], model.mechanisms),
        surfaces.misfit_variance(centre, model.mechanisms),
        # sizes are 0 to 1, factors -1 to 1
        np.where(np.arange(x.shape[1]) < factors, LENGTH, LENGTH / 2.0),
    )
    return Misses(
        x,
        missed / counts[:, None] - model.predict(x, condition),
        variance / counts[:, None],
        np.array([_slope(model, x, step, condition) for step in np.eye(x.shape[1])]),
        surfaces.correlation(centre, model.mechanisms),
        stated,
        variance * surfaces.moved(model.mechanisms),
    )


def with_bank_errors(shift: Shift, seen: Sequence[Misses], model: Model) -> Shift:
    """Find a shift again with the errors that the bank leaves in the emulator, linearised at the first.

    With the noise alone it takes up errors of the coefficients, and its error is understated
    (``trials/record/intervals``). The smooth function has no part in it: it corrects around the optimum.
    """
    precision = _precision(model)
    normal, descent = np.diag(precision), -precision * shift.value
    for one in seen:
        missed, slopes = one.whitened
        normal = normal + np.einsum("pij,qij->pq", slopes, slopes)
        descent = descent + np.einsum("pij,ij->p", slopes, missed)
    spread = np.linalg.inv(normal)
    return Shift(shift.value + spread @ descent, spread)


def _precision(model: Model) -> np.ndarray:
    """Return the prior precision of a shift, (parameters,)."""
    return np.asarray((SHIFT_SD * (model.upper - model.lower)) ** -2.0)
