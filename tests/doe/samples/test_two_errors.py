"""A difference with two estimated errors: the level that is kept, its limits, and its p values."""

import numpy as np
import pytest
from scipy import stats

from doe.samples.two_errors import MOST, STRAY, TwoErrors, false_alarms

PAIRS = [(1.0, 1.0), (1.0, 11.0), (7.0, 1.0), (7.0, 2.0), (3.0, 11.0), (7.0, 4.0), (30.0, 3.0)]


@pytest.mark.parametrize(("first", "second"), PAIRS)
@pytest.mark.parametrize("alpha", [0.05, 0.05 / 3.0, 0.05 / 6.0])
def test_the_level_is_kept_at_every_ratio_of_the_variances(first: float, second: float, alpha: float) -> None:
    rules = TwoErrors(first, second)
    levels = false_alarms(first, second, alpha, *rules.rule(alpha))
    low, high = levels.min(), levels.max()
    # k and q are interpolated between levels: 2 % of the level in addition to the slack.
    assert high <= 1.02 * MOST * alpha
    if min(first, second) >= 2.0 and max(first, second) >= 7.0 and alpha == 0.05:
        assert low >= 0.98 * (1.0 - STRAY) * alpha  # (7, 2) strays by .135, the least of all k and q
        assert high <= (1.0 + STRAY) * alpha
    # Banerjee's rule is never above the level, and far below it where few degrees of freedom meet.
    banerjee = false_alarms(first, second, alpha, 1.0, 0.5)
    assert banerjee.max() <= 1.0001 * alpha
    assert banerjee.min() < low


def test_the_quadrature_is_the_simulation() -> None:
    rng = np.random.default_rng(81)
    draws, first, second, share = 100_000, 7, 2, 0.7
    s1 = (1.0 - share) * rng.chisquare(first, draws) / first
    s2 = share * rng.chisquare(second, draws) / second
    critical = TwoErrors(first, second).critical(s2 / (s1 + s2), 0.05)
    alarms = np.mean(np.abs(rng.standard_normal(draws)) > critical * np.sqrt(s1 + s2))
    rules = TwoErrors(float(first), float(second))
    grid = np.sin(np.linspace(0.0, 0.5 * np.pi, 33)) ** 2
    exact = np.interp(share, grid, false_alarms(7.0, 2.0, 0.05, *rules.rule(0.05)))
    # Four binomial standard deviations, and the interpolation between 33 ratios.
    assert alarms == pytest.approx(exact, abs=4.0 * np.sqrt(0.05 * 0.95 / draws) + 5e-4)


def test_one_error_alone_is_students_t() -> None:
    rule = TwoErrors(7.0, 4.0)
    expected = stats.t.isf(0.025, [7, 4])
    np.testing.assert_allclose(rule.critical([0.0, 1.0], 0.05), expected, rtol=1e-12)
    assert rule.p(2.0, 0.0) == pytest.approx(2.0 * stats.t.sf(2.0, 7), rel=1e-8)


def test_many_degrees_of_freedom_are_welchs_and_known_errors_are_normal() -> None:
    share = np.linspace(0.0, 1.0, 11)
    df = 1.0 / ((1.0 - share) ** 2 / 40.0 + share**2 / 60.0)
    # q is one of a grid: the limits are within .5 % of Welch's.
    np.testing.assert_allclose(TwoErrors(40.0, 60.0).critical(share, 0.05), stats.t.isf(0.025, df), rtol=5e-3)
    known = TwoErrors(np.inf, np.inf).critical(share, 0.05)
    np.testing.assert_allclose(known, stats.norm.isf(0.025), rtol=1e-9)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 1.0])
def test_p_is_the_level_at_which_t_is_critical(share: float) -> None:
    rule = TwoErrors(7.0, 2.0)
    for alpha in (0.4, 0.05, 1e-3):
        assert rule.p(float(rule.critical(share, alpha)), share) == pytest.approx(alpha, rel=1e-4)
    sizes = [0.0, 0.5, 1.0, 2.0, 5.0, 20.0, 1e4]
    found = [rule.p(size, share) for size in sizes]
    assert found == sorted(found, reverse=True)
    assert found[0] == 1.0
    assert rule.p(-2.0, share) == rule.p(2.0, share)
