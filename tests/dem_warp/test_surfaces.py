"""Level and slopes of beds: on drawn beds whose surface is known."""

import math

import numpy as np
import pytest

from dem_warp.scenes.drum import surface_angles
from dem_warp.scenes.surfaces import bed_level, column_tops, flank_angle, profile

REACH = 1e-3


def lattice(inside) -> np.ndarray:
    """Return places of a cubic lattice, far finer than a grain, that lie in a region [m]."""
    axis = np.arange(-0.03, 0.03, 0.25 * REACH)
    x, z = (grid.ravel() for grid in np.meshgrid(axis, axis))
    kept = inside(x, z)
    return np.column_stack([x[kept], np.zeros(kept.sum()), z[kept]])


def test_the_level_of_a_bed_is_the_mean_height_of_its_surface():
    # Two grains of half height 1 in a tube of radius 2, over different cells, and one below the first.
    places = np.array([[-1.0, -1.0, 3.0], [1.0, 1.0, 5.0], [-1.0, -1.0, 1.0]])
    assert bed_level(places, (2.0, 2.0), 1.0) == 4.0 + 0.5
    assert bed_level(np.empty((0, 3)), (2.0, 2.0), 1.0) == 0.0


def test_columns_come_in_order_of_appearance_each_with_its_highest_centre():
    places = np.array([[2.5, 0.5], [-0.5, 0.5], [2.9, 0.1], [-0.1, 1.5]])
    columns, tops = column_tops(places, np.array([1.0, -2.0, 4.0, 3.0]), 1.0)
    assert columns.tolist() == [[2, 0], [-1, 0], [-1, 1]]
    assert tops.tolist() == [4.0, -2.0, 3.0]


def test_a_profile_averages_the_highest_centres_along_y():
    places = np.array([[1.0, 0.0, 2.0], [1.0, 0.0, 5.0], [1.5, 3.0, 7.0], [-3.0, 0.0, -1.0]])
    x, z = profile(places, 1.0)
    assert x.tolist() == [-3.0, 1.0]
    assert z.tolist() == [-1.0, 6.0]


@pytest.mark.parametrize("degrees", [5.0, 60.0])
def test_a_flank_is_measured_without_its_foot_and_its_flat_top(degrees):
    rise = math.tan(math.radians(degrees))
    x = np.arange(40.0)
    z = np.clip(rise * (x - 8.0), 0.0, rise * 20.0)
    # The foot ends at 0 and the top at 20 rises, of which 10 to 90 % are 2 to 18: on the straight part alone.
    assert flank_angle(x, z, 0.1) == pytest.approx(degrees, rel=1e-12)
    assert flank_angle(x, z[::-1], 0.1) == pytest.approx(degrees, rel=1e-12)


def test_a_surface_without_a_flank_has_no_angle():
    assert flank_angle(np.empty(0), np.empty(0), REACH) is None
    x = np.arange(9.0)
    assert flank_angle(x[:2], x[:2], 0.1) is None
    # A bed of one layer, whose surface is rough by less than two grains.
    assert flank_angle(x, 0.4 * x, 1.0) is None
    # A step, of which nothing lies between 10 and 90 %.
    assert flank_angle(x, 9.0 * (x > 4.0), 1.0) is None


def test_a_bed_that_is_steep_above_and_flat_below_has_two_angles():
    radius, upper, lower = 0.025, math.radians(45.0), math.radians(25.0)
    # The bend is in the middle of the chord of a bed that is tilted by the mean of both.
    bend_x, bend_z = -0.008 * math.sin(math.radians(35.0)), -0.008 * math.cos(math.radians(35.0))

    def inside(x, z):
        surface = bend_z - np.where(x < bend_x, math.tan(upper), math.tan(lower)) * (x - bend_x)
        return (z < surface) & (x**2 + z**2 < radius**2)

    angles = surface_angles(lattice(inside), 0.02, REACH)
    # The lattice's step is an eighth of a column: heights are off by at most that, 0.25 mm, which is 1.2
    # degrees of a line at most; a column next to the bend may hold a little of the other slope.
    assert angles.upper_angle == pytest.approx(45.0, abs=2.0)
    assert angles.lower_angle == pytest.approx(25.0, abs=2.0)
    assert angles.dynamic_angle == pytest.approx(35.0, abs=2.0)


def test_no_angle_is_seen_of_a_bed_that_is_not_there():
    assert surface_angles(np.empty((0, 3)), 0.02, REACH) is None
    assert surface_angles(np.array([[0.0, 0.0, -0.02]]), 0.02, REACH) is None
