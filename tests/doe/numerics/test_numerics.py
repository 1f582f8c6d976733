"""Kriging with unknown noise, and a shrunk covariance, against closed forms and kept numbers."""

import numpy as np
import pytest

from doe.numerics.kriging import fit_noisy_kriging
from doe.numerics.shrunk_covariance import shrunk_covariance

ROWS = np.array([[-2, -1, 0], [1, 2, -2], [-1, 0, 1], [2, -2, -1.0], [3, 1, 0]])

# sklearn.covariance.ledoit_wolf(ROWS, assume_centered=True), scikit-learn 1.9.1
SHARE = 1.0
COVARIANCE = np.array(
    [[2.3333333333333335, 0.0, -0.0], [0.0, 2.3333333333333335, -0.0], [-0.0, -0.0, 2.3333333333333335]]
)


def test_a_covariance_is_shrunk_as_scikit_learn_shrinks_it() -> None:
    covariance, share = shrunk_covariance(ROWS)
    assert share == pytest.approx(SHARE, rel=1e-12)
    assert covariance == pytest.approx(COVARIANCE, rel=1e-12)


def test_one_column_and_a_covariance_that_is_the_target_are_not_shrunk() -> None:
    assert shrunk_covariance(ROWS[:, :1])[1] == 0.0
    covariance, share = shrunk_covariance(np.array([[1.0, 1.0], [1.0, -1.0]]))
    assert share == 0.0
    assert covariance == pytest.approx(np.eye(2))


def test_kriging_finds_an_unknown_noise() -> None:
    rng = np.random.default_rng(3)
    points = rng.uniform(-1.0, 1.0, (200, 2))
    fitted, noise = fit_noisy_kriging(points, np.sin(3.0 * points[:, 0]) + 0.2 * rng.standard_normal(200))
    # the variance of 200 normal numbers is known to 10 %
    assert noise == pytest.approx(0.04, rel=0.3)
    assert fitted.covariance.length[1] > 3.0 * fitted.covariance.length[0]
