"""The scatter of runs: variances and correlations from repeats, and weights that hold their level."""

from collections.abc import Sequence

import numpy as np
import pytest
from scipy import stats

from doe.discrepancy.emulation import run_noise
from doe.discrepancy.emulation.condition_surfaces import polynomial
from doe.discrepancy.emulation.run_noise import ALIKE, Noise, fit_noises, shared_correlations
from doe.discrepancy.emulation.surface_fits import BaseRuns, fit_bases, repeats_of, shared_misfits

FLOOR = np.full(6, 1e-9)


def fit_noise(theta: np.ndarray, deviations: np.ndarray, floor: np.ndarray) -> Noise:
    return fit_noises([(theta, deviations)], floor)[0]


def test_deviations_of_repeats_have_the_covariance_of_one_run() -> None:
    rng = np.random.default_rng(1)
    groups = np.repeat(np.arange(400), 3)
    triangle = np.array([[1.0, 0.0], [0.8, 0.6]])
    offsets = 50.0 * rng.standard_normal((400, 2))
    values = offsets[groups] + rng.standard_normal((1200, 2)) @ triangle.T
    _, deviations = run_noise.repeat_deviations(groups, values)
    assert len(deviations) == 800
    # A variance from 800 deviations has a relative error of sqrt(2 / 800); four of those.
    np.testing.assert_allclose(
        deviations.T @ deviations / 800, triangle @ triangle.T, atol=4.0 * np.sqrt(2.0 / 800)
    )


def test_noise_finds_a_variance_that_changes_over_the_factors() -> None:
    rng = np.random.default_rng(2)
    theta = rng.uniform(-1.0, 1.0, (4000, 2))
    deviations = rng.standard_normal((4000, 1)) * np.exp(0.5 * (0.3 + 0.8 * theta[:, :1]))
    noise = fit_noise(theta, deviations, np.array([1e-9]))
    # The information of a slope is n Var(theta) / 2 = 667; four standard errors.
    np.testing.assert_allclose(noise.coefficients[:, 0], [0.3, 0.8, 0.0], atol=4.0 / np.sqrt(667.0))


def test_the_inverse_of_an_estimated_covariance_is_unbiased() -> None:
    rng = np.random.default_rng(3)
    inverses = []
    for _ in range(400):
        noise = fit_noise(np.zeros((40, 1)), rng.standard_normal((40, 6)), np.full(6, 1e-9))
        inverses.append(np.linalg.inv(noise.covariance(np.zeros(1)) * noise.inverse_bias(6)))
    # Without the factor it would be 40 / 33; the identity in the correlation takes 2 %, the rest is 3 errors.
    assert np.trace(np.mean(inverses, axis=0)) / 6.0 == pytest.approx(1.0, abs=0.04)


def test_a_correlation_is_drawn_towards_that_of_all_conditions_the_more_the_fewer_its_repeats() -> None:
    rng = np.random.default_rng(9)
    first = fit_noise(np.zeros((25, 1)), rng.standard_normal((25, 3)), np.full(3, 1e-9))
    second = fit_noise(np.zeros((25, 1)), rng.standard_normal((25, 3)), np.full(3, 1e-9))
    mean = (first.correlation + second.correlation) / 2.0
    shared = shared_correlations([first, second])[0]
    np.testing.assert_allclose(
        shared.correlation - mean, (first.correlation - mean) * 25.0 / (25.0 + ALIKE), atol=1e-12
    )
    assert 25.0 < shared.correlation_freedom <= 50.0
    assert shared_correlations([first])[0].correlation_freedom == pytest.approx(25.0)


def test_conditions_learn_from_one_another_how_a_variance_changes() -> None:
    """Pooled as far as they are alike: two dozen repeats know a slope to .4, all five conditions to .2."""
    rng, alone, together = np.random.default_rng(21), [], []
    for _ in range(20):
        planes = np.array([0.3, 0.8, 0.0, -0.4])[:, None] + _apart(rng, (4, 6))
        repeats, truths = [], []
        for _ in range(5):
            own = planes + np.vstack([0.4 * rng.standard_normal((1, 6)), 0.1 * rng.standard_normal((3, 6))])
            theta = rng.uniform(-1.0, 1.0, (24, 3))
            scatter = np.exp(0.5 * (own[0] + theta @ own[1:]))
            repeats.append((theta, scatter * rng.standard_normal((24, 6))))
            truths.append(own)
        for (theta, deviations), noise, truth in zip(
            repeats, fit_noises(repeats, FLOOR), truths, strict=True
        ):
            together.append((noise.coefficients - truth)[1:])
            alone.append((fit_noise(theta, deviations, FLOOR).coefficients - truth)[1:])
    # .33 and .21 were seen; 300 independent slopes know either to 4 %.
    assert np.std(together) < 0.75 * np.std(alone)


def _apart(rng: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    return 0.3 * rng.standard_normal(shape)


def test_the_inverse_of_a_variance_from_few_repeats_is_unbiased() -> None:
    rng = np.random.default_rng(22)
    found = [fit_noise(np.zeros((12, 1)), rng.standard_normal((12, 6)), FLOOR) for _ in range(400)]
    inverses = [1.0 / noise.variance(np.zeros(1)) for noise in found]
    # 1 / chi2_12 scatters by half its mean, in 2400 draws by 1 %; four of those. Untreated it would be 1.2.
    assert np.mean(inverses) == pytest.approx(1.0, abs=0.04)


def test_sums_of_squares_hold_their_level_when_all_is_known_from_two_dozen_repeats() -> None:
    """The noise, its slopes and the surfaces, which have a little of the third order."""
    rng, banks = np.random.default_rng(23), 50
    q = np.concatenate([_squares(rng, _worlds(rng), count=4) for _ in range(banks)])
    # Of 50 banks .025 are beyond, give or take .022; three of those. Each condition by itself gave .10.
    assert np.mean(q > stats.chi2.isf(0.025, 30)) < 0.025 + 3.0 * np.sqrt(0.025 * 0.975 / banks)


World = tuple[np.ndarray, np.ndarray]
"""Coefficients of the planes of log-variances and of the surfaces of a condition."""


def _worlds(rng: np.random.Generator) -> list[World]:
    planes, worlds = np.vstack([np.zeros((1, 6)), _apart(rng, (3, 6))]), []
    for _ in range(5):
        own = np.vstack([0.4 * rng.standard_normal((1, 6)), 0.15 * rng.standard_normal((3, 6))])
        surface = np.vstack([3.0 * rng.standard_normal((10, 6)), 0.2 * rng.standard_normal((10, 6))])
        worlds.append((planes + own, surface))
    return worlds


def _squares(rng: np.random.Generator, worlds: Sequence[World], count: int) -> np.ndarray:
    """Weighted squares of means of eight heaps less what a bank of 24 points and two repeats predicts.

    The number of points is (count,).
    """
    theta, points = rng.uniform(-1.0, 1.0, (24, 3)), rng.uniform(-0.8, 0.8, (count, 3))
    repeats, means = [], []
    for planes, surface in worlds:
        sd = np.exp(0.5 * (planes[0] + theta @ planes[1:]))
        runs = polynomial(theta, 3) @ surface + sd * rng.standard_normal((2, 24, 6))
        repeats.append((theta, (runs[0] - runs[1]) / np.sqrt(2.0)))
        means.append(runs.mean(axis=0))
    noises, twice = fit_noises(repeats, FLOOR), np.full(24, 2)
    runs_of = [BaseRuns(theta, twice, mean, noise) for mean, noise in zip(means, noises, strict=True)]
    q = np.zeros(count)
    for emulated, (planes, surface) in zip(fit_bases(runs_of), worlds, strict=True):
        for number, at in enumerate(points):
            variance = np.exp(planes[0] + at @ planes[1:]) / 8.0
            measured = polynomial(at[None], 3)[0] @ surface + np.sqrt(variance) * rng.standard_normal(6)
            error = measured - emulated.predict(at[None], ())[0]
            scatter = emulated.noise.covariance(at) / 8.0 * emulated.noise.inverse_bias(6)
            q[number] += error @ np.linalg.solve(scatter + emulated.error(at, ()), error)
    return q


@pytest.mark.parametrize("misfit", [0.0, 0.3])
def test_a_misfit_too_small_for_one_observable_is_said_by_all(misfit: float) -> None:
    rng, freedom, degrees = np.random.default_rng(24), np.full((5, 1), 12.0), np.full((5, 1), 24.0)
    found = []
    for _ in range(200):
        residual = (1.0 + misfit) * rng.chisquare(12.0, (5, 12)) / 12.0
        found.append(shared_misfits(residual / (rng.chisquare(24.0, (5, 12)) / 24.0), freedom, degrees))
    # The logarithm of one ratio is open by .5, the mean of 60 by .065: half of that where none is below 0.
    assert np.mean(found) == pytest.approx(misfit, abs=0.045)
    # Seen one by one each would be open by .5: they scatter by little more than their mean does.
    assert np.std(found) < 0.15


def test_runs_without_repeats_show_their_noise():
    rng = np.random.default_rng(4)
    theta = rng.uniform(-1.0, 1.0, (200, 2))
    smooth = np.column_stack([np.sin(3.0 * theta[:, 0]), theta[:, 0] * theta[:, 1] ** 2])
    rows, deviations = repeats_of(theta, smooth + (0.2, 0.1) * rng.standard_normal((200, 2)))
    assert len(rows) == 200
    # a variance of 200 normal numbers is known to 10 %, and the smooth part takes some of them
    assert (deviations**2).mean(axis=0) == pytest.approx([0.04, 0.01], rel=0.3)


def test_terms_of_whole_numbers_are_those_of_the_same_numbers_with_a_point() -> None:
    whole = np.array([[1, 0], [-1, 1]])
    np.testing.assert_array_equal(polynomial(whole, 2), polynomial(whole.astype(float), 2))
    np.testing.assert_array_equal(polynomial(whole, 2)[1], [1, -1, 1, 1, -1, 1])
