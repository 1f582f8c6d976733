"""Agreement of two sets of numbers: closed forms, and noise that is removed again."""

import math

import numpy as np
import pytest
from scipy import stats

from doe import agreement

TRUTH = np.linspace(10.0, 34.0, 31)


def noisy(rng: np.random.Generator, sd: float, values: np.ndarray = TRUTH) -> np.ndarray:
    return values + sd * rng.standard_normal(values.shape)


def test_a_shifted_and_stretched_copy_has_the_closed_forms() -> None:
    found = agreement(2.0 * TRUTH - 3.0, TRUTH)
    difference = TRUTH - 3.0
    # Sums of 31 numbers: rounding.
    assert found.bias.value == pytest.approx(difference.mean(), rel=1e-14)
    assert found.rmse.value == pytest.approx(math.sqrt((difference**2).mean()), rel=1e-14)
    assert found.slope.value == pytest.approx(2.0, rel=1e-13)
    assert (found.spearman.value, found.spearman_ceiling.value) == pytest.approx((1.0, 1.0), rel=1e-13)
    assert found.rmse_without_noise == found.rmse


def test_the_rank_correlation_is_that_of_scipy() -> None:
    values, reference = np.array([3.0, 1.0, 2.0, 2.0, 5.0]), np.array([1.0, 2.0, 2.0, 4.0, 3.0])
    expected = stats.spearmanr(values, reference).statistic
    assert agreement(values, reference).spearman.value == pytest.approx(expected, rel=1e-14)


def test_noise_is_taken_out_of_the_mean_square_and_of_the_slope() -> None:
    rng = np.random.default_rng(3)
    own, other, trials = 1.2, 2.0, 200
    squares, slopes = [], []
    for _ in range(trials):
        found = agreement(
            noisy(rng, own, 0.8 * TRUTH + 6.0), noisy(rng, other), own**2, other**2, confidence=0.5
        )
        mean_square = (found._difference**2).mean()
        squares.append(mean_square - own**2 - other**2)
        slopes.append(found.slope.value)
    misfit = ((0.8 * TRUTH + 6.0 - TRUTH) ** 2).mean()
    # Four standard errors of the mean of the trials.
    assert np.mean(squares) == pytest.approx(misfit, abs=4.0 * np.std(squares) / math.sqrt(trials))
    # The ratio's own bias is of second order in the noise of the spread, 0.3 % here.
    assert np.mean(slopes) == pytest.approx(0.8, abs=4.0 * np.std(slopes) / math.sqrt(trials) + 0.003)


def test_the_interval_of_the_bias_is_that_of_a_mean() -> None:
    rng = np.random.default_rng(4)
    found = agreement(noisy(rng, 2.0), TRUTH)
    # Of n values a resampled mean has the variance s^2 (n - 1) / n^2; an end of the interval of 4,000
    # resamples is known to 3 % of the width.
    error = found._difference.std(ddof=0) / math.sqrt(31)
    width = 2.0 * stats.norm.isf(0.025) * error
    assert found.bias.high - found.bias.low == pytest.approx(width, rel=0.06)
    assert found.bias.low < found.bias.value < found.bias.high


def test_the_ceiling_of_normal_truths_is_the_one_of_a_normal_pair() -> None:
    # Two noisy views of normal truths are a normal pair of correlation r = the geometric mean of their
    # reliabilities, whose rank correlation is 6 / pi asin(r / 2) (Pearson 1907).
    truth = stats.norm.ppf((np.arange(400) + 0.5) / 400)
    truth /= truth.std(ddof=1)
    own, other = 0.5, 0.8
    # The reference is read as truth and noise: it is widened so that drawing together gives the truth back.
    reference = truth * math.sqrt(1.0 + other**2)
    ceiling = agreement(reference, reference, own**2, other**2).spearman_ceiling
    r = 1.0 / math.sqrt((1.0 + own**2) * (1.0 + other**2))
    # The rank correlation of 400 runs is low by order 1 / n; the mean over the draws is known better.
    assert ceiling.value == pytest.approx(6.0 / math.pi * math.asin(0.5 * r), abs=0.005)
    assert ceiling.low < ceiling.value < ceiling.high


def test_runs_of_one_setting_have_one_truth() -> None:
    reference = np.array([1.0, 2.0, 3.0, 4.0])
    found = agreement(reference, reference, 1.0, 1.0, settings=["x"] * 4)
    # Nothing to rank but noise: 0, within four standard errors, 1 / sqrt(n - 1) over sqrt(draws).
    assert found.spearman_ceiling.value == pytest.approx(0.0, abs=4.0 / math.sqrt(3 * 4000))


def test_a_reference_that_is_all_noise_has_no_slope() -> None:
    assert math.isnan(agreement(TRUTH, TRUTH, reference_variance=1e3).slope.value)
