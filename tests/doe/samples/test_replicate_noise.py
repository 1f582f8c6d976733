"""Noise floor, variance ratio, curvature and power."""

import numpy as np
import pytest
from scipy import stats
from statsmodels.stats.power import TTestIndPower

import doe
from doe import Sample, detectable_effect, effect_power


def test_noise_floor_of_five_by_tables():
    floor = doe.noise_floor(Sample(30.0, 2.0, 5))
    # Tables: t(0.975, 4) = 2.7764, chi2(4) quantiles 0.4844 and 11.1433.
    assert floor.mean_interval == pytest.approx(
        (30.0 - 2.7764 * 2.0 / np.sqrt(5.0), 30.0 + 2.7764 * 2.0 / np.sqrt(5.0)), abs=1e-4
    )
    assert floor.sd_interval == pytest.approx(
        (2.0 * np.sqrt(4.0 / 11.1433), 2.0 * np.sqrt(4.0 / 0.4844)), rel=1e-4
    )


def test_power_is_that_of_a_two_sample_test():
    """Two levels of six runs each are two samples of six; the effect in standard deviations is Cohen's d."""
    expected = TTestIndPower().power(effect_size=1.5, nobs1=6, alpha=0.05)
    # Two evaluations of the noncentral t distribution.
    assert effect_power(3.0, 2.0, 12, error_df=10) == pytest.approx(expected, rel=1e-6)
    assert effect_power(0.0, 2.0, 12, error_df=10, alpha=0.05) == pytest.approx(0.05, rel=1e-9)


def test_detectable_effect_has_its_power():
    effect = detectable_effect(1.3, 12, error_df=3, alpha=0.10, power=0.8)
    assert effect_power(effect, 1.3, 12, error_df=3, alpha=0.10) == pytest.approx(0.8, abs=1e-9)
    # With very many degrees of freedom: (z_0.95 + z_0.8) standard errors (the far tail is below 1e-4).
    z = stats.norm.isf(0.05) + stats.norm.isf(0.2)
    assert detectable_effect(1.0, 400, error_df=1e6, alpha=0.10) == pytest.approx(0.1 * z, rel=1e-3)
