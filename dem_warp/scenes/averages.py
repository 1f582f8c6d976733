"""Means over time of a fluctuating quantity, with standard errors that include its autocorrelation."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

WINDOW = 5.0
"""Window of the autocorrelation sum over the integrated autocorrelation time (Sokal's rule)."""

LEAST_LOOKS = 4
"""Least length of a series with a standard error."""


class MeanOverTime(NamedTuple):
    """Mean of a stationary series with its standard error."""

    mean: float
    standard_error: float
    freedom: float
    """Degrees of freedom of the standard error, for Student's t."""
    memory: float
    """Integrated autocorrelation time, in looks; 0.5 for a series without memory."""


def mean_over_time(series: ArrayLike) -> MeanOverTime | None:
    """Average a stationary series of equally spaced looks; return None for fewer than LEAST_LOOKS.

    The variance of the mean is 2 tau / n times that of a look, with the integrated autocorrelation time tau
    (Sokal, Monte Carlo methods in statistical mechanics, 1996, section 3), corrected for using the mean of
    the same series (Wolff, Computer Physics Communications 156, 2004, 143-153, equation 49).
    """
    values = np.asarray(series, dtype=np.float64)
    count = len(values)
    if count < LEAST_LOOKS:
        return None
    mean, away = float(values.mean()), values - values.mean()
    spectrum = np.fft.rfft(away, 2 * count)
    covariance = np.fft.irfft(np.abs(spectrum) ** 2, 2 * count)[:count] / count
    if not covariance[0] > 0.0:
        return MeanOverTime(mean, 0.0, count - 1.0, 0.5)
    times = 0.5 + np.cumsum(covariance[1:]) / covariance[0]
    lags = np.arange(1, count)
    window = int(lags[np.argmax(lags >= WINDOW * times)])
    memory = max(float(times[window - 1]), 0.5) * (1.0 + (2 * window + 1) / count)
    variance = covariance[0] * 2.0 * memory / count
    return MeanOverTime(mean, float(np.sqrt(variance)), max(count / (2 * window + 1), 1.0), memory)
