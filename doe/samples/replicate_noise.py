"""Noise and power: the noise floor of replicates, curvature, and the effects that a design can see."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from numpy.typing import NDArray
from scipy import optimize, stats

from doe.arguments import checked_count, checked_level, checked_number
from doe.errors import DesignError
from doe.samples.sample import Sample


@dataclass(frozen=True)
class NoiseFloor:
    """Mean and standard deviation of replicates of one setting, with their intervals."""

    sample: Sample
    confidence: float

    @property
    def mean(self) -> float:
        """Mean of the replicates."""
        return self.sample.mean

    @property
    def sd(self) -> float:
        """Standard deviation of a single replicate."""
        return self.sample.sd

    @property
    def mean_interval(self) -> tuple[float, float]:
        """Interval of the mean (Student's t)."""
        reach = float(stats.t.isf(0.5 * (1.0 - self.confidence), self.sample.df)) * self.sample.se
        return self.mean - reach, self.mean + reach

    @property
    def sd_interval(self) -> tuple[float, float]:
        """Interval of the standard deviation (chi square)."""
        tail = 0.5 * (1.0 - self.confidence)
        df = self.sample.df
        low, high = (self.sd * math.sqrt(df / float(stats.chi2.isf(q, df))) for q in (tail, 1.0 - tail))
        return low, high


def noise_floor(values: Sample | Sequence[float] | NDArray, confidence: float = 0.95) -> NoiseFloor:
    """Return the noise floor of replicates of one setting (values, or their Sample)."""
    return NoiseFloor(Sample.of(values), checked_level(confidence, "confidence"))


def effect_power(effect: float, sd: float, observations: int, error_df: float, alpha: float = 0.05) -> float:
    """Return the probability that a two-level effect is found significant.

    Parameters
    ----------
    effect : float
        True difference between the levels.
    sd : float
        Standard deviation of one observation.
    observations : int
        All observations of the balanced design (runs x replicates): the effect's standard error is
        2 sd / sqrt(observations).
    error_df : float
        Degrees of freedom of the test's error.
    """
    checked_count("observations", observations)
    for name, value in (("sd", sd), ("error_df", error_df)):
        checked_number(name, value, above=0.0)
    checked_level(alpha)
    shift = abs(checked_number("effect", effect)) * math.sqrt(observations) / (2.0 * sd)
    critical = float(stats.t.isf(0.5 * alpha, error_df))
    # the lower tail as an upper one: scipy's cdf is NaN far below the centre
    return float(stats.nct.sf(critical, error_df, shift) + stats.nct.sf(critical, error_df, -shift))


def detectable_effect(
    sd: float, observations: int, error_df: float, alpha: float = 0.05, power: float = 0.8
) -> float:
    """Return the smallest effect that is found with a given power (see ``effect_power``)."""
    if not checked_level(alpha) < checked_number("power", power) < 1.0:
        raise DesignError(f"power must be between alpha ({alpha}) and 1, got {power}")
    checked_count("observations", observations)
    for name, value in (("sd", sd), ("error_df", error_df)):
        checked_number(name, value, above=0.0)
    standard_error = 2.0 * sd / math.sqrt(observations)
    top = standard_error
    while effect_power(top, sd, observations, error_df, alpha) < power:
        top *= 2.0
    return float(
        optimize.brentq(lambda e: effect_power(e, sd, observations, error_df, alpha) - power, 0.0, top)
    )
