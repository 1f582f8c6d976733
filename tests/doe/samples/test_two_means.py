"""Comparison of means: scipy's t-tests, the interval, equivalence and its error rate."""

import math

import numpy as np
import pytest
from scipy import stats
from statsmodels.stats.weightstats import ttost_ind

from doe import DesignError, Sample, compare_means

A = np.array([30.1, 31.6, 29.3, 30.4])
B = np.array([29.8, 30.2, 30.0, 30.6, 29.9, 30.1])


@pytest.mark.parametrize(("method", "equal"), [("pooled", True), ("welch", False)])
def test_two_sample_tests_are_those_of_scipy(method, equal):
    ours = compare_means(A, B, method=method)
    theirs = stats.ttest_ind(A, B, equal_var=equal)
    assert (ours.t, ours.p, ours.df) == pytest.approx((theirs.statistic, theirs.pvalue, theirs.df), rel=1e-12)
    assert ours.interval == pytest.approx(tuple(theirs.confidence_interval()), rel=1e-12)


def test_one_sample_test_is_that_of_scipy():
    theirs = stats.ttest_1samp(A, 30.0)
    ours = compare_means(A, 30.0, method="one-sample")
    assert (ours.t, ours.p, ours.df) == pytest.approx((theirs.statistic, theirs.pvalue, 3), rel=1e-12)


def test_a_sample_is_its_values_or_its_summary():
    summaries = compare_means(Sample.of(A), Sample.of(B), margin=1.0)
    assert summaries == compare_means(list(A), B, margin=1.0)


@pytest.mark.parametrize("margin", [0.3, 1.0, 3.0])
def test_equivalence_is_that_of_statsmodels(margin):
    ours = compare_means(A, B, margin=margin, method="pooled")
    p, _, _ = ttost_ind(A, B, -margin, margin)
    assert compare_means(A, B, margin=margin).equivalence_p == pytest.approx(
        ttost_ind(A, B, -margin, margin, usevar="unequal")[0], rel=1e-10
    )
    assert ours.equivalence_p == pytest.approx(p, rel=1e-10)
    assert ours.equivalent == (p < 0.05)


def test_smallest_margin_is_where_equivalence_begins():
    limit = compare_means(A, B).smallest_margin
    assert compare_means(A, B, margin=limit).equivalence_p == pytest.approx(0.05, rel=1e-9)
    assert compare_means(A, B, margin=1.001 * limit).equivalent
    assert not compare_means(A, B, margin=0.999 * limit).equivalent


def test_means_that_differ_by_the_margin_pass_as_equivalent_in_five_percent():
    rng = np.random.default_rng(31)
    trials = 500
    passed = [
        compare_means(1.0 + rng.normal(scale=0.3, size=8), rng.normal(scale=0.3, size=8), 1.0).equivalent
        for _ in range(trials)
    ]
    # At the border of the margin the test's level is exact; 3.5 binomial standard deviations.
    assert np.mean(passed) == pytest.approx(0.05, abs=3.5 * np.sqrt(0.05 * 0.95 / trials))


def test_all_comparisons_show_equivalence_by_chance_at_most_at_the_level_of_each() -> None:
    """One of four means differs by the margin: all four are called equivalent in 5 of 100 at most."""
    rng, trials = np.random.default_rng(8), 1000
    apart = np.array([1.0, 0.0, 0.0, 0.0])
    wrong = 0
    for _ in range(trials):
        samples = zip(rng.normal(apart, 0.4, (9, 4)).T, rng.normal(0.0, 0.4, (15, 4)).T, strict=True)
        tests = [compare_means(a, b, 1.0, alpha=0.0125, equivalence_alpha=0.05) for a, b in samples]
        wrong += all(test.equivalent for test in tests)
    assert wrong / trials < 0.05 + 3.0 * math.sqrt(0.05 * 0.95 / trials)  # three standard errors
    assert wrong / trials > 0.025  # a level shared by four would give .0125 and see less


def test_the_level_of_equivalence_is_the_other_unless_it_is_given() -> None:
    own, given = compare_means(A, B, 1.0, alpha=0.01), compare_means(A, B, 1.0, equivalence_alpha=0.01)
    assert own.smallest_margin == given.smallest_margin
    assert own.interval != given.interval
    with pytest.raises(DesignError, match=r"equivalence must be below 0\.5, got 0\.6"):
        compare_means(A, B, 1.0, equivalence_alpha=0.6)
