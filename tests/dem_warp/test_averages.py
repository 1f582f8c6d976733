"""Means over time: their intervals hold the truth as often as they say, whatever the series remembers."""

import numpy as np
import pytest
from scipy import stats

from dem_warp.scenes.averages import mean_over_time

SERIES = 1500
LEVEL = 0.95


def remembering(memory: float, looks: int, seed: int) -> np.ndarray:
    """Return stationary series of mean 0 that keep a part of each value to the next, (SERIES, looks)."""
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(SERIES, looks))
    values[:, 0] /= np.sqrt(1.0 - memory**2)
    for look in range(1, looks):
        values[:, look] += memory * values[:, look - 1]
    return values


@pytest.mark.parametrize(("memory", "looks"), [(0.0, 300), (0.8, 300), (0.95, 1000)])
def test_intervals_of_a_mean_over_time_cover_it_as_often_as_they_say(memory: float, looks: int) -> None:
    hits = 0
    for series in remembering(memory, looks, seed=looks):
        mean = mean_over_time(series)
        assert mean is not None
        hits += abs(mean.mean) <= stats.t.ppf(0.5 + LEVEL / 2, mean.freedom) * mean.standard_error
    # The coverage of 1,500 intervals is itself good to half a percent; three times that, and a little.
    assert 0.93 < hits / SERIES < 0.97


def test_the_memory_is_the_integrated_autocorrelation_time() -> None:
    found = [mean_over_time(series).memory for series in remembering(0.8, 1000, seed=2)[:300]]
    # (1 + f) / (1 - f) / 2 of a series that keeps the part f, 4.5 looks; the rule's window cuts off 1 %.
    assert np.mean(found) == pytest.approx(4.5, rel=0.05)


def test_a_series_too_short_for_an_error_has_no_mean() -> None:
    assert mean_over_time([1.0, 2.0, 1.0]) is None
    still = mean_over_time(np.full(20, 3.0))
    assert (still.mean, still.standard_error) == (3.0, 0.0)
