"""Contours, nearest points, stationary points and regions of surfaces with known answers."""

from collections.abc import Callable

import numpy as np
import pytest

from doe import DesignError, Factor, Sample, Surface, TargetError, central_composite, fit_surface


def surface_of(function: Callable, count: int, noise: float = 0.0, seed: int = 0) -> Surface:
    """Return the fit of a polynomial of coded factors x1, x2, ...; natural = 10 + 2 coded."""
    design = central_composite([Factor(f"x{i + 1}", 8.0, 12.0) for i in range(count)])
    response = function(*design.points.to_numpy().T) + np.zeros(len(design.coded))
    return fit_surface(design, response + noise * np.random.default_rng(seed).normal(size=len(response)))


def coded(values) -> np.ndarray:
    return (np.asarray(values) - 10.0) / 2.0


def test_contour_of_a_paraboloid_is_a_circle():
    contour = coded(surface_of(lambda x, y: x**2 + y**2, 2).contour(0.49))
    # Each point solves the fitted equation; the fit of an exact polynomial rounds to about 1e-14.
    assert np.hypot(*contour.T) == pytest.approx(0.7, abs=1e-10)
    angles = np.unwrap(np.arctan2(contour[:, 1], contour[:, 0]))
    assert abs(angles[-1] - angles[0]) == pytest.approx(2.0 * np.pi, abs=1e-9)


def test_contour_numbers_its_pieces():
    contour = surface_of(lambda x, y: x * y, 2).contour(0.25)
    assert contour.index.nunique() == 2
    assert coded(contour).prod(axis=1) == pytest.approx(0.25, abs=1e-10)
    for _, piece in contour.groupby(level=0):
        # A hyperbola's branch keeps to its quadrant and ends on the border.
        assert len({tuple(row) for row in np.sign(coded(piece))}) == 1
        assert np.abs(coded(piece.iloc[[0, -1]])).max(axis=1) == pytest.approx(1.0, abs=1e-9)


def test_contour_of_one_factor_is_its_roots():
    surface = surface_of(lambda x: x + x**2, 1)
    assert coded(surface.contour(0.0))[:, 0] == pytest.approx([-1.0, 0.0], abs=1e-10)
    assert coded(surface.contour(0.75))[:, 0] == pytest.approx([0.5], abs=1e-10)


def test_contour_of_three_factors_is_a_cloud_on_the_sphere():
    contour = coded(surface_of(lambda x, y, z: x**2 + y**2 + z**2, 3).contour(0.25))
    assert len(contour) > 500
    assert np.linalg.norm(contour, axis=1) == pytest.approx(0.5, abs=1e-9)


def test_missed_target_gives_no_contour_and_names_the_range():
    surface = surface_of(lambda x, y: x + y, 2)
    assert surface.contour(5.0).empty
    with pytest.raises(TargetError, match=r"target 5: it runs from -1\.99\d* to 1\.99\d* inside"):
        surface.nearest(5.0)
    assert coded(surface.nearest(5.0, extent=3.0)) == pytest.approx([2.5, 2.5], abs=1e-6)


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_nearest_point_of_a_plane_is_its_foot(count):
    normal = np.array([1.0, -2.0, 0.5, 1.5])[:count]
    surface = surface_of(lambda *x: 3.0 + normal @ np.array(x), count)
    foot = 0.4 * normal / (normal @ normal)
    # SLSQP ends within the square root of its tolerance of 1e-15.
    assert coded(surface.nearest(3.4)) == pytest.approx(foot, abs=1e-7)


@pytest.mark.parametrize(
    ("function", "kind"),
    [
        (lambda x, y: (x - 0.2) ** 2 + 2.0 * (y + 0.3) ** 2 + 7.0, "minimum"),
        (lambda x, y: 7.0 - (x - 0.2) ** 2 - 2.0 * (y + 0.3) ** 2, "maximum"),
        (lambda x, y: 7.0 + (x - 0.2) * (y + 0.3), "saddle"),
    ],
)
def test_stationary_point(function, kind):
    point = surface_of(function, 2).stationary_point()
    assert point.kind == kind
    assert point.coded.to_numpy() == pytest.approx([0.2, -0.3], abs=1e-10)
    assert point.natural.to_numpy() == pytest.approx([10.4, 9.4], abs=1e-10)
    assert point.mean == pytest.approx(7.0, abs=1e-10)
    assert (point.coded.abs() <= 1.0).all()


def test_band_area_of_an_annulus():
    band = surface_of(lambda x, y: x**2 + y**2, 2).band(0.5, 0.25)
    # pi (0.75 - 0.25) / 4 of the square; 400 x 400 cells miss the border by less than 1e-3.
    assert band.fraction == pytest.approx(np.pi * 0.5 / 4.0, abs=1e-3)
    reach = np.sqrt(0.75)
    assert coded(band.ranges) == pytest.approx(np.array([[-reach, reach]] * 2), abs=2.0 / 400)


def test_projection_is_the_shadow_on_two_factors():
    band = surface_of(lambda x, y, z: x**2 + y**2 + z**2, 3).band(0.0, 0.25)
    shadow = band.projection("x1", "x3")
    assert np.array_equal(shadow, shadow.T)
    # A ball of radius 1/2 casts a disc; 54 cells a side: half a cell of its rim.
    assert shadow.mean() == pytest.approx(np.pi * 0.25 / 4.0, abs=np.pi / 4.0 / 54)
    with pytest.raises(DesignError, match="two of x1, x2, x3, got 'x1' and 'x1'"):
        band.projection("x1", "x1")


def test_compatible_region_holds_the_truth_as_often_as_it_says():
    """Monte Carlo: surface and target are both measured with noise; the true setting belongs in 95 %."""
    trials, hits = 60, 0
    rng = np.random.default_rng(21)
    for seed in range(trials):
        surface = surface_of(lambda x, y: 30.0 + x + 2.0 * y + 0.5 * x * y, 2, noise=0.5, seed=seed)
        target = Sample.of(30.0 + 0.4 - 0.8 - 0.08 + rng.normal(scale=0.5, size=5))
        region = surface.compatible_region(target, resolution=5)  # cell centers at multiples of 0.4
        truth = np.isclose(region.coded, [0.4, -0.4]).all(axis=1)
        hits += int(region.mask[truth].item())
    # 3.5 binomial standard deviations of 60 trials: 0.098.
    assert hits / trials == pytest.approx(0.95, abs=3.5 * np.sqrt(0.95 * 0.05 / trials))
