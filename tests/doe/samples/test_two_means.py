"""Comparison of means: scipy's t-tests, the interval, equivalence and its error rate."""

import numpy as np
import pytest
from scipy import stats
from statsmodels.stats.weightstats import ttost_ind

from doe import Sample, compare_means

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
