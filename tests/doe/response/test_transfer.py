"""Surfaces carried over to another process: recovered, honest about their errors, and well placed."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from doe import (
    Factor,
    Sample,
    Surface,
    central_composite,
    fit_surface,
    full_factorial,
    spread_points,
    transfer,
    transfer_points,
)

E, F = Factor.around("E", 0.4, 0.1), Factor.around("F", 0.05, 0.02)
DESIGN = central_composite((E, F), "rotatable", 5)
LEVEL, SHIFT, SCALE = 28.5, -2.0, 0.9


def truth(points: pd.DataFrame) -> np.ndarray:
    x, y = (factor.to_coded(points[factor.name]).to_numpy() for factor in (E, F))
    return 28.0 + 2.5 * x + 1.2 * y - 0.4 * x**2 + 0.2 * x * y


def there(points: pd.DataFrame, noise: np.ndarray | float = 0.0) -> np.ndarray:
    """Response of the other process."""
    return LEVEL + SHIFT + SCALE * (truth(points) - LEVEL) + noise


def source(noise: float, rng: np.random.Generator) -> Surface:
    return fit_surface(DESIGN, truth(DESIGN.natural) + rng.normal(0.0, noise, len(DESIGN.coded)))


def nearest(surface: Surface) -> dict[str, float]:
    return dict(surface.nearest(LEVEL, extent=1.4))


def test_shift_and_scale_are_recovered_from_runs_with_next_to_no_noise() -> None:
    rng = np.random.default_rng(0)
    surface = source(1e-5, rng)
    runs = transfer_points(surface, nearest(surface), 6)
    found = transfer(surface, runs, there(runs, rng.normal(0.0, 1e-5, 6)), LEVEL)
    # A few standard errors of noise of 1e-5.
    assert (found.shift, found.scale) == pytest.approx((SHIFT, SCALE), abs=1e-4)
    points = pd.DataFrame({"E": [0.3, 0.45], "F": [0.06, 0.04]})
    coded = np.column_stack([factor.to_coded(points[factor.name]) for factor in (E, F)])
    assert found.evaluate(coded)[0] == pytest.approx(there(points), abs=1e-3)


def test_the_polynomial_is_the_mean() -> None:
    rng = np.random.default_rng(1)
    surface = source(0.6, rng).reduce(0.05)
    runs = transfer_points(surface, nearest(surface), 12)
    found = transfer(surface, runs, there(runs, rng.normal(0.0, 0.7, 12)), LEVEL)
    points = rng.uniform(-1.0, 1.0, (7, 2))
    np.testing.assert_allclose(found.evaluate(points)[0], found.quadratic_form.value(points), rtol=1e-12)
    point = found.nearest(LEVEL + found.shift)
    coded = [[factor.to_coded(point[factor.name]) for factor in (E, F)]]
    assert found.evaluate(coded)[0][0] == pytest.approx(LEVEL + found.shift, abs=1e-6)


def test_without_an_error_of_the_surface_it_is_least_squares() -> None:
    rng = np.random.default_rng(2)
    surface = source(1e-9, rng)
    runs = transfer_points(surface, nearest(surface), 10)
    response = there(runs, rng.normal(0.0, 0.5, 10))
    found = transfer(surface, runs, response, LEVEL, scale_sd=np.inf)
    columns = np.column_stack([np.ones(10), truth(runs) - LEVEL])
    expected, squares, *_ = np.linalg.lstsq(columns, response - LEVEL, rcond=None)
    assert (found.shift, found.scale) == pytest.approx(tuple(expected), abs=1e-6)
    assert found.noise == pytest.approx(np.sqrt(squares[0] / 8), rel=1e-3), "restricted likelihood: n - 2"


def test_intervals_and_errors_hold_their_level() -> None:
    rng, inside, misses, errors = np.random.default_rng(3), [], [], []
    for _ in range(24):
        surface = source(0.6, rng)
        at = nearest(surface)
        runs = transfer_points(surface, at, 12, extent=1.4)
        found = transfer(surface, runs, there(runs, rng.normal(0.0, 0.7, 12)), LEVEL)
        ends = found.intervals()
        inside.append(
            [ends["shift"][0] < SHIFT < ends["shift"][1], ends["scale"][0] < SCALE < ends["scale"][1]]
        )
        coded = [[factor.to_coded(at[factor.name]) for factor in (E, F)]]
        mean, error = found.evaluate(coded)
        misses.append(mean[0] - there(pd.DataFrame([at]))[0])
        errors.append(error[0])
    # The number that 24 trials of .95 fall short of in one case of a thousand.
    assert (np.sum(inside, axis=0) >= stats.binom.ppf(1e-3, 24, 0.95)).all()
    # A standard deviation of 24 values is known to 15 %; three of those.
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(np.std(misses), rel=0.45)


def test_the_region_of_the_carried_surface_holds_its_contour() -> None:
    rng = np.random.default_rng(4)
    surface = source(0.3, rng)
    runs = transfer_points(surface, nearest(surface), 12)
    found = transfer(surface, runs, there(runs, rng.normal(0.0, 0.3, 12)), LEVEL)
    region = found.compatible_region(Sample(LEVEL + SHIFT, 0.3, 5), extent=1.4)
    point = found.nearest(LEVEL + SHIFT, extent=1.4)
    ranges = region.ranges
    assert (ranges["low"] <= point).all()
    assert (point <= ranges["high"]).all()


def test_runs_that_tell_nothing_of_the_scale_leave_it_near_one() -> None:
    rng = np.random.default_rng(8)
    surface = source(0.6, rng)
    runs = transfer_points(surface, nearest(surface), 6)
    scales = [transfer(surface, runs, 26.0 + rng.normal(0.0, 5.0, 6), LEVEL).scale for _ in range(8)]
    # A run of such noise says next to nothing against a standard deviation of a quarter about 1.
    assert scales == pytest.approx([1.0] * 8, abs=0.25)


def test_runs_lie_there_across_and_along_inside_the_box() -> None:
    surface = source(1e-9, np.random.default_rng(5))
    at = nearest(surface)
    runs = transfer_points(surface, at, 7, step=0.5)
    coded = np.column_stack([factor.to_coded(runs[factor.name]) for factor in (E, F)])
    assert np.abs(coded).max() <= 1.0 + 1e-12
    moves = coded - coded[0]
    slope = surface.quadratic_form.gradient(coded[0])
    np.testing.assert_allclose(moves[[0, 5]], 0.0, atol=1e-12)
    assert (moves[1] @ slope > 0.0, moves[2] @ slope < 0.0) == (True, True)
    assert moves[[3, 4]] @ slope == pytest.approx(0.0, abs=1e-9)
    assert np.linalg.norm(moves[1:5], axis=1) == pytest.approx(0.5)


def test_slopes_are_recovered_and_belong_to_the_polynomial() -> None:
    rng = np.random.default_rng(3)
    surface = source(1e-5, rng)
    points = spread_points(surface, DESIGN.points.to_numpy(), 8, np.zeros((0, 2)))
    runs = pd.DataFrame({f.name: f.to_natural(x) for f, x in zip((E, F), points.T, strict=True)})
    tilt = points @ [0.5, -0.3]
    found = transfer(surface, runs, there(runs, tilt + rng.normal(0.0, 1e-5, 8)), LEVEL, slopes=True)
    # Shift, scale and slopes share what is linear; the whole is what is known.
    elsewhere = rng.uniform(-1.0, 1.0, (9, 2))
    natural = pd.DataFrame({f.name: f.to_natural(x) for f, x in zip((E, F), elsewhere.T, strict=True)})
    expected = there(natural, elsewhere @ [0.5, -0.3])
    np.testing.assert_allclose(found.evaluate(elsewhere)[0], expected, atol=2e-3)
    np.testing.assert_allclose(
        found.quadratic_form.value(elsewhere), found.evaluate(elsewhere)[0], rtol=1e-12
    )
    assert found.residual_df == 8 - 4
    one = found.predict(dict(natural.iloc[0])).iloc[0]
    assert one["mean"] == pytest.approx(expected[0], abs=2e-3)
    assert one["prediction_low"] < one["confidence_low"] < one["mean"] < one["confidence_high"]
    assert found.agrees(dict(natural.iloc[0]), Sample(expected[0], 0.4, 5))
    assert not found.agrees(dict(natural.iloc[0]), Sample(expected[0] + 5.0, 0.4, 5))


def test_points_are_spread_as_the_best_of_all_choices() -> None:
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]])
    design = full_factorial((E, F), center=1)
    surface = fit_surface(design, truth(design.natural), "first-order")
    chosen = spread_points(surface, design.points.to_numpy(), 4, np.zeros((0, 2)))
    # A line in two factors is best known from the four corners, each once.
    assert sorted(map(tuple, chosen)) == sorted(map(tuple, corners))
    # Of a place near one corner most is learned there, once the corners are made.
    assert spread_points(surface, [[0.9, 0.9]], 1, corners).tolist() == [[1.0, 1.0]]
