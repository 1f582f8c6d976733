"""Heaps with the roughness of grains: no bias, and intervals with the stated coverage."""

import numpy as np
import pytest
from drawn_heaps import Camera, DrawnHeap, cone_of_spheres, draw
from scipy import stats

from imaging import compare, heap_angle, measure

HEAPS = 60
LEVEL = 0.95
COVERAGE = (0.90, 0.99)
"""Required; 95 % of 60 heaps scatter by 3 % about 0.95, and the correlation length is itself an estimate."""


def test_no_bias_and_true_coverage() -> None:
    inside = []
    for left, right, grain in ((25.0, 35.0, 6.0), (15.0, 15.0, 5.0)):
        angles = [
            measure(draw(DrawnHeap(left, right, 200, grain=grain, seed=seed), Camera(noise=4, seed=seed)))
            for seed in range(HEAPS // 2)
        ]
        errors = np.array([(angle.left - left, angle.right - right) for angle in angles])
        # Required: 0.2 degree. The mean of 30 flanks that scatter by 0.4 to 0.7 is known to 0.07 to 0.13.
        np.testing.assert_allclose(errors.mean(axis=0), 0.0, atol=0.2)
        truth = 0.5 * (left + right)
        inside += [low <= truth <= high for low, high in (angle.interval(LEVEL) for angle in angles)]
    assert COVERAGE[0] <= np.mean(inside) <= COVERAGE[1]


def test_error_of_a_heap_covers_what_other_heaps_give() -> None:
    heaps = [
        heap_angle(*cone_of_spheres(30.0, 0.05, 0.0022, 2500, seed), azimuths=4, pixels=200)
        for seed in range(HEAPS)
    ]
    means = np.array([angle.mean for angle in heaps])
    inside = [low <= means.mean() <= high for low, high in (angle.interval(LEVEL) for angle in heaps)]
    assert COVERAGE[0] <= np.mean(inside) <= COVERAGE[1]
    # A standard deviation from 60 heaps is known to 9 %; the errors' own mean to less.
    assert np.sqrt(np.mean([angle.se**2 for angle in heaps])) == pytest.approx(means.std(ddof=1), rel=0.25)


def test_small_spheres_show_their_cone() -> None:
    angle = heap_angle(*cone_of_spheres(30.0, 0.05, 0.0004, 40_000, seed=1), azimuths=2)
    # The envelope lies a sphere outside the cone at its base and inside at its tip: 0.0004 / 0.05.
    assert angle.mean == pytest.approx(30.0, abs=np.degrees(0.0004 / 0.05))


def test_stray_grains_do_not_count(heap, angle) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 7)[:-1]
    strays = np.column_stack([0.055 * np.cos(turn), 0.055 * np.sin(turn), np.full(6, 0.001)])
    centers, radii = np.vstack([heap.centers, strays]), np.r_[heap.radii, np.full(6, 0.001)]
    with_strays = heap_angle(centers, radii, azimuths=2)
    # Only the scale of the picture may change, by what six spheres of 3600 do to a quantile: 0.1 degree.
    assert compare(with_strays, angle).value == pytest.approx(0.0, abs=0.1)


def test_interval_is_students(angle) -> None:
    low, high = angle.interval(0.9)
    assert high - angle.mean == pytest.approx(stats.t.ppf(0.95, angle.dof) * angle.se, rel=1e-12)
    assert angle.mean - low == pytest.approx(high - angle.mean, rel=1e-9)
