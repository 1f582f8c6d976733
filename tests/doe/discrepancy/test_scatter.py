"""Scatter of replicates: that of the runs, and that of their readings."""

import numpy as np

from doe.discrepancy.fitting.scatter import Scatter

FREEDOM = 40.0


def scatter_of(moments: np.ndarray) -> Scatter:
    """Scatter of a condition with the given mean products of deviations."""
    return Scatter({"base": FREEDOM * moments}, {"base": np.full(moments.shape, FREEDOM)})


def test_readings_are_told_from_runs() -> None:
    model = np.array([[1.0, 0.8, 0.5], [0.8, 1.0, 0.4], [0.5, 0.4, 1.0]])
    excess = scatter_of(model + np.diag([0.0, 0.0, 2.0])).excess({"base": model}, 1e6, 3)
    assert excess.runs == 1.0
    # Of two variances that 40 degrees of freedom know to a quarter each, most is left where they are.
    assert 1.2 < excess.reading[2] < 2.0
    assert excess.reading[:2].max() < 0.5


def test_what_has_no_scatter_at_all_is_no_excess() -> None:
    for moments in (np.diag([1.0, 0.0]), np.zeros((2, 2))):
        excess = scatter_of(moments).excess({"base": np.eye(2)}, 1e6, 2)
        assert excess.runs == 1.0
        assert excess.reading[1] == 0.0
        assert np.isfinite(excess.reading).all()


def test_readings_that_scatter_less_than_the_model_lend_others_no_excess() -> None:
    # four of five below the model's scatter: the mean excess is nothing, and the fifth has none of its own
    excess = scatter_of(np.diag([0.4, 0.4, 0.4, 0.4, 0.9])).excess({"base": np.eye(5)}, 1e6, 5)
    np.testing.assert_array_equal(excess.reading, np.zeros(5))


def test_readings_are_drawn_towards_the_mean_that_is_left() -> None:
    moments = np.array([3.0, 3.0, 1.0, 1.0, 1.0])
    reading = scatter_of(np.diag(moments)).excess({"base": np.eye(5)}, 1e6, 5).reading
    # each lies between its own excess and one mean, so all have the same ratio of distances
    shares = (reading[0] - reading[2]) / (moments[0] - moments[2])
    centre = (reading[0] - shares * 2.0) / (1.0 - shares)
    assert 0.0 < centre < np.mean(moments - 1.0)
    np.testing.assert_allclose(reading[2:], (1.0 - shares) * centre)
