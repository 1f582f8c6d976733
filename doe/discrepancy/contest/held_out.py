"""Forecasts of the conditions outside a fit, and their score."""

from dataclasses import dataclass

import numpy as np

from doe.discrepancy.fitting.fitted_model import Stack
from doe.discrepancy.fitting.measured_means import Block
from doe.discrepancy.fitting.model_fit import Fitted, Interval, whiten


@dataclass(frozen=True, eq=False)
class Forecast:
    """Predicted means of some conditions, with the covariance of their errors."""

    measured: np.ndarray
    predicted: np.ndarray
    """(means,)."""
    covariance: np.ndarray
    """Covariance of their difference: noise, emulator and the fitted parameters, (means, means)."""
    noise: np.ndarray
    """Covariance of the measured means alone, (means, means)."""

    def log_score(self, measured: np.ndarray) -> np.ndarray:
        """Return the log density predicted for measured means (..., means), but for a constant."""
        whitening = whiten(self.covariance)
        residual = (measured - self.predicted) @ whitening.T
        return np.asarray(np.log(np.diag(whitening)).sum() - 0.5 * (residual**2).sum(axis=-1))


def forecast(fitted: Fitted, blocks: tuple[Block, ...]) -> Forecast:
    """Predict conditions from a fit to others; common errors that the fit shows apply there too."""
    seen, stack = fitted.stack, Stack(fitted.model, blocks)
    shared = stack.common.T @ seen.common @ fitted.whitening.T
    slopes = stack.jacobian(fitted.x[None])[0]
    slopes = slopes - shared @ fitted.whitening @ seen.jacobian(fitted.x[None])[0]
    covariance = stack.covariance(fitted.x) - shared @ shared.T + slopes @ fitted.spread @ slopes.T
    predicted = stack.predict(fitted.x[None])[0] + shared @ fitted.residuals
    return Forecast(stack.target, predicted, covariance, stack.noise(fitted.x))


def held_out_gain(
    base: Fitted, fitted: Fitted, blocks: tuple[Block, ...], draws: int, seed: int
) -> Interval | None:
    """Compute the gain of the log score over the base, with its 90 % interval over the replicates' noise.

    It is None where no held-out condition was measured.
    """
    if not blocks:
        return None
    before, after = forecast(base, blocks), forecast(fitted, blocks)
    value = float(after.log_score(after.measured) - before.log_score(after.measured))
    normal = np.random.default_rng(seed).standard_normal((draws, len(after.measured)))
    drawn = after.measured + normal @ np.linalg.cholesky(after.noise).T
    gains = after.log_score(drawn) - before.log_score(drawn)
    # Measured means have been drawn once already: only the spread of a second draw is of interest.
    low, high = np.quantile(gains - gains.mean(), [0.05, 0.95])
    return Interval(value + float(low), value, value + float(high))
