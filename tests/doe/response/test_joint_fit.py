"""Several responses together: joint regions of planes with closed forms."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy import stats

from doe import Design, Factor, Goal, Sample, central_composite, joint_fit
from doe.response.quadratic import QuadraticForm
from doe.response.region import compatible_region

FACTORS = (Factor("E", 0.3, 0.5), Factor("F", 0.2, 0.6))
DESIGN = central_composite(FACTORS, "rotatable", 5)
EXPLORED = np.pi * 2.0
"""Area of the disc out to the farthest runs, at a coded distance of sqrt(2)."""

LARGE = 10**6
"""Number of measurements from which t is normal."""

SLOPES = ((1.0, 0.5), (0.2, -1.0), (0.7, 0.7))
"""Three planes no two of which are parallel."""


@dataclass(frozen=True)
class Plane:
    """An exact plane, whose fitted mean has the same standard error everywhere."""

    slopes: tuple[float, ...]
    se: float = 0.0
    design: Design = DESIGN
    residual_df: float = np.inf

    @property
    def quadratic_form(self) -> QuadraticForm:
        count = len(self.slopes)
        return QuadraticForm(0.0, np.array(self.slopes), np.zeros((count, count)))

    def evaluate(self, coded):
        points = np.atleast_2d(coded)
        return points @ np.array(self.slopes), np.full(len(points), self.se)


def goal(*slopes: float, target: float = 0.0, se: float = 0.1) -> Goal:
    """Return a plane through the centre, and a target of a known standard error."""
    return Goal(Plane(slopes), Sample(target, se * np.sqrt(LARGE), LARGE))


def half_width(se: float, responses: int) -> float:
    """Return the half width of the band of one among several responses at 95 %."""
    return float(stats.norm.isf(0.025 / responses)) * se


def test_two_bands_that_cross_leave_their_parallelogram() -> None:
    fit = joint_fit({"a": goal(1.0, 1.0), "b": goal(1.0, -1.0, se=0.05)})
    # |x + y| <= w and |x - y| <= v enclose a rectangle of sides w sqrt(2) and v sqrt(2): area 2 w v.
    area = 2.0 * half_width(0.1, 2) * half_width(0.05, 2)
    # Of 160,000 cells over the box of side 2 sqrt(2), a perimeter of less than 1.2 passes some 170 of area
    # 5e-5; each may fall on either side.
    assert fit.share() * EXPLORED == pytest.approx(area, abs=2e-3)
    np.testing.assert_array_equal(fit.region().mask, fit.band("a").mask & fit.band("b").mask)
    assert fit.coded_point == pytest.approx([0.0, 0.0], abs=1e-6)
    assert fit.agrees()


def test_one_response_leaves_a_band_and_the_second_cuts_it() -> None:
    fit = joint_fit({"a": goal(1.0, 1.0), "b": goal(1.0, -1.0, se=0.05)})
    alone, both = fit.shrinkage["share"]
    # Chord of the disc times the width of the band, which is thin: 2 sqrt(2) by sqrt(2) w.
    chord = 2.0 * np.sqrt(2.0) * np.sqrt(2.0) * half_width(0.1, 1)
    assert alone * EXPLORED == pytest.approx(chord, rel=0.01)
    assert both < 0.25 * alone
    assert fit.shrinkage["ratio"]["b"] == both / alone


def test_the_point_solves_crossing_planes() -> None:
    fit = joint_fit({"a": goal(2.0, 1.0, target=0.5), "b": goal(1.0, -1.0, target=0.4)})
    solved = np.linalg.solve([[2.0, 1.0], [1.0, -1.0]], [0.5, 0.4])
    # The pull toward the centre moves it by less than PULL times the covariance, 1e-3 * 0.1^2.
    np.testing.assert_allclose(fit.coded_point, solved, atol=1e-4)
    natural = [f.to_natural(x) for f, x in zip(FACTORS, fit.coded_point, strict=True)]
    assert list(fit.point.values()) == pytest.approx(natural)


def test_a_factor_by_itself_is_known_to_the_error_that_its_planes_give() -> None:
    fit = joint_fit({"a": goal(2.0, 1.0, target=0.5), "b": goal(1.0, -1.0, target=0.4)})
    # x = (a + b) / 3 and y = (a - 2 b) / 3 have errors of 0.1 sqrt(2) / 3 and 0.1 sqrt(5) / 3, coded.
    for (name, row), error in zip(fit.intervals.iterrows(), np.sqrt([2.0, 5.0]) / 30.0, strict=True):
        scale = fit.region().factors[["E", "F"].index(name)].half_range
        ends = np.array([row["low"], row["high"]]) - row["value"]
        # to the edges of cells of sqrt(2) / 200, and a quantile of 4,096 draws
        np.testing.assert_allclose(ends / scale, [-1.96 * error, 1.96 * error], atol=0.016)
        assert not row["low_open"]
        assert not row["high_open"]


def test_parallel_planes_leave_the_same_direction_open() -> None:
    fit = joint_fit({"a": goal(1.0, 1.0, target=0.6), "b": goal(2.0, 2.0, target=1.2)})
    pinned, free = (row for _, row in fit.directions.iterrows())
    np.testing.assert_allclose(np.abs(pinned[["E", "F"]]), np.sqrt(0.5), rtol=1e-9)
    assert free["E"] == pytest.approx(-free["F"])
    # A step d along (1, 1) / sqrt(2) changes a by sqrt(2) d and b by 2 sqrt(2) d: together they weigh
    # (2 + 8) / 0.1^2. The quantile is drawn; cells of sqrt(2) / 200 end at most one inside the interval.
    reach = half_width(0.1, 1) / np.sqrt(10.0)
    assert pinned["span"] == pytest.approx(reach / np.sqrt(2.0), abs=0.01)
    # The band about x + y = 0.6 cuts the disc of radius sqrt(2); its longest chord is the one nearest to the
    # centre.
    chord = np.sqrt(2.0 - (0.6 - np.sqrt(2.0) * reach) ** 2 / 2.0)
    assert free["span"] == pytest.approx(chord / np.sqrt(2.0), abs=0.01)
    assert fit.intervals[["low_open", "high_open"]].to_numpy().all()
    # Of the line x + y = 0.6 the point is the one nearest to the centre.
    np.testing.assert_allclose(fit.coded_point, [0.3, 0.3], atol=1e-3)


def test_a_response_that_tells_nothing_costs_a_little_and_comes_last() -> None:
    goals = {"a": goal(1.0, 1.0), "flat": goal(0.0, 0.0), "b": goal(1.0, -1.0)}
    table = joint_fit(goals).shrinkage
    assert list(table.index) == ["a", "b", "flat"]
    # With a third response each is held to 0.05 / 3 instead of 0.05 / 2: bands as much wider, squared.
    wider = (half_width(1.0, 3) / half_width(1.0, 2)) ** 2
    assert table["ratio"]["flat"] == pytest.approx(wider, rel=0.02)  # cells on the edge, as above
    assert table["alone"]["flat"] == 1.0


def test_one_response_alone_is_its_own_compatible_region() -> None:
    design = central_composite(FACTORS, 1.0, 5)  # face-centred: the disc of the runs holds the whole box
    plane, aim = Plane((3.0, 2.0), se=0.2, design=design, residual_df=7.0), Sample(0.4, 0.5, 5)
    np.testing.assert_array_equal(
        joint_fit({"a": Goal(plane, aim)}).region().mask, compatible_region(plane, aim).mask
    )


def test_nothing_beyond_the_farthest_run_is_compatible() -> None:
    fit = joint_fit({"flat": goal(0.0, 0.0)})
    far = np.linalg.norm(fit.cells, axis=1) > np.sqrt(2.0) * (1.0 + 1e-9)
    assert far.any()
    assert not fit.region().mask[far].any()
    assert fit.share() == 1.0
    outward = joint_fit({"a": goal(1.0, 0.0, target=9.0)})
    np.testing.assert_allclose(outward.coded_point, [np.sqrt(2.0), 0.0], atol=1e-4)


def test_the_true_setting_is_compatible_as_often_as_promised() -> None:
    rng = np.random.default_rng(5)
    count, inside = 100, 0
    for _ in range(count):
        aims = (Sample.of(rng.normal(0.0, 1.0, 5)) for _ in range(3))
        goals = {str(i): Goal(Plane(s), aim) for i, (s, aim) in enumerate(zip(SLOPES, aims, strict=True))}
        inside += joint_fit(goals, resolution=3).agrees({"E": 0.4, "F": 0.4})
    expected = 0.95  # to three standard errors of the count
    assert abs(inside / count - expected) < 3.0 * np.sqrt(expected * (1.0 - expected) / count)


def test_of_two_crossings_the_one_with_the_smaller_chi2_is_chosen() -> None:
    @dataclass(frozen=True)
    class Bowl(Plane):
        """x^2 + y^2 in coded units."""

        def evaluate(self, coded):
            points = np.atleast_2d(coded)
            return np.sum(points**2, axis=1), np.zeros(len(points))

    bowl = Goal(Bowl((0.0, 0.0)), Sample(1.0, 0.1 * np.sqrt(LARGE), LARGE))
    # The circle of radius 1 meets x = 0.6 at y = +-0.8; a third plane prefers the lower one by a little.
    fit = joint_fit({"a": bowl, "b": goal(1.0, 0.0, target=0.6), "c": goal(0.0, 0.1, target=-0.08, se=1.0)})
    np.testing.assert_allclose(fit.coded_point, [0.6, -0.8], atol=1e-3)
