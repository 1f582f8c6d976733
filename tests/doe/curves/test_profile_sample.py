"""Profiles as data: generalised least squares, few repeats, and what an outline tells beyond an angle."""

import numpy as np
import pytest
from scipy import stats

import doe
from doe import Factor, Goal, ProfileSample, Sample, central_composite, fit_surface, joint_fit

PLACES = np.linspace(-1.0, 1.0, 9)


def covariance(length: float = 0.4, noise: float = 0.1) -> np.ndarray:
    """Neighbouring heights scatter together."""
    return np.exp(-0.5 * ((PLACES[:, None] - PLACES) / length) ** 2) + noise * np.eye(len(PLACES))


def drawn(count: int, seed: int, scale: float = 1.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return scale * rng.multivariate_normal(np.zeros(len(PLACES)), covariance(), count)


def test_modes_make_generalised_least_squares_of_ordinary_ones() -> None:
    sample = ProfileSample.of(3.0 * PLACES**2 + drawn(12, 1))
    heights = 2.0 * PLACES
    away = heights - sample.mean
    general = away @ np.linalg.solve(sample.covariance, away)
    ordinary = sum(
        ((mode.weights @ heights - mode.target.mean) / mode.target.sd) ** 2 for mode in sample.modes
    )
    assert ordinary == pytest.approx(general, rel=1e-9)
    assert all(mode.target.n == 12 for mode in sample.modes)
    spreads = [mode.target.sd for mode in sample.modes]
    assert spreads == sorted(spreads, reverse=True)


def test_many_profiles_give_their_covariance_and_few_a_shrunk_one() -> None:
    true = covariance()
    many = ProfileSample.of(drawn(4000, 2))
    # Elements of a covariance of 4,000 rows are good to sqrt(2 / 4000) of the variances.
    assert many.covariance == pytest.approx(true, abs=5.0 * np.sqrt(2.0 / 4000) * true.max())
    assert many.shrinkage < 0.05
    rows = [drawn(5, seed) for seed in range(60)]
    shrunk = [np.linalg.norm(ProfileSample.of(each).covariance - true) for each in rows]
    plain = [np.linalg.norm(np.cov(each.T) - true) for each in rows]
    assert np.mean(shrunk) < 0.9 * np.mean(plain)
    # Five rows span four directions of nine; shrinkage leaves no direction without a scatter.
    assert min(np.linalg.eigvalsh(ProfileSample.of(each).covariance)[0] for each in rows) > 0.0


FACTORS = (Factor("friction", 0.1, 0.9), Factor("rolling", 0.0, 0.4))


def surface_of(friction: float, rolling: float) -> np.ndarray:
    """Heights of a bed: its slope goes with the sum of both frictions, its S with rolling alone."""
    slope = 0.4 + 0.5 * friction + 1.0 * rolling
    return -slope * PLACES - 0.8 * rolling * (PLACES**3 - 0.6 * PLACES)


def test_canonical_directions_are_independent_and_take_all_that_the_settings_move() -> None:
    rng = np.random.default_rng(12)
    sample = ProfileSample.of(drawn(30, 3))
    slopes = rng.normal(size=(9, 3))
    modes = sample.canonical(slopes, 5)
    weights = np.array([mode.weights for mode in modes])
    assert weights.shape == (3, 9)
    assert np.linalg.norm(weights, axis=1) == pytest.approx(1.0)
    together = weights @ sample.covariance @ weights.T
    spreads = np.sqrt(np.diag(together))
    assert together == pytest.approx(np.diag(spreads**2), abs=1e-9)
    # The information on the settings is that of all places: generalised least squares loses nothing.
    moved = weights @ slopes / spreads[:, None]
    assert moved.T @ moved == pytest.approx(slopes.T @ np.linalg.solve(sample.covariance, slopes), rel=1e-8)
    strengths = np.linalg.norm(moved, axis=1)
    assert strengths == pytest.approx(sorted(strengths, reverse=True))
    assert [mode.target.mean for mode in modes] == pytest.approx(weights @ sample.mean)


def test_a_direction_chosen_for_its_small_scatter_is_not_taken_to_be_so_quiet() -> None:
    """Intervals of 95 % of eight profiles hold the truth: 160 of them, each 1.7 % to either side."""
    slopes, held = np.column_stack([PLACES, PLACES**2 - 0.4]), []
    for seed in range(80):
        for mode in ProfileSample.of(drawn(8, 2000 + seed)).canonical(slopes, 2):
            held.append(abs(mode.target.mean) <= stats.t.ppf(0.975, 7) * mode.target.se)
    assert 0.91 <= np.mean(held) <= 0.99


def test_canonical_directions_pin_what_single_modes_leave_open() -> None:
    """Twin data of eight profiles: less than half of what an angle leaves."""
    design, scatter, rng = central_composite(FACTORS), 0.02, np.random.default_rng(41)
    runs = np.array([surface_of(*row) for row in design.natural.to_numpy()])
    runs += scatter * rng.multivariate_normal(np.zeros(9), covariance(), len(runs))
    measured = surface_of(0.5, 0.2) + drawn(8, 6, scatter)
    slopes = np.array([fit_surface(design, column).coded_coefficients[design.names] for column in runs.T])
    goals = {
        f"direction {number}": Goal(fit_surface(design, runs @ mode.weights), mode.target)
        for number, mode in enumerate(ProfileSample.of(measured).canonical(slopes, 2), 1)
    }
    line = PLACES / (PLACES @ PLACES)
    angle = joint_fit({"angle": Goal(fit_surface(design, runs @ line), Sample.of(measured @ line))})
    found = joint_fit(goals)
    assert found.agrees({"friction": 0.5, "rolling": 0.2})
    assert 0.0 < found.share() < 0.5 * angle.share()


def test_few_profiles_are_shrunk_to_the_scatter_of_their_views() -> None:
    true, worse, better = covariance(), [], []
    for seed in range(40):
        # Five heaps, four views of each, whose scatter is alike but smaller.
        own = drawn(5, 500 + seed)
        views = [heap + drawn(4, 900 + 10 * seed + number, 0.4) for number, heap in enumerate(own)]
        profiles = np.array([heap.mean(axis=0) for heap in views])
        between = true * (1.0 + 0.4**2 / 4)
        for found, target in ((worse, None), (better, doe.scatter_of_views(views))):
            found.append(np.linalg.norm(ProfileSample.of(profiles, target).covariance - between))
    assert np.mean(better) < 0.9 * np.mean(worse)
