"""Populations of several shapes: what is drawn, what it weighs, and how it rains."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from worlds import BALL, BOOT, GRAIN, PYRAMID, small_case

from dem_warp import CaseResult, GrainPopulation, ShapeMixture
from dem_warp.clumps import stack_spheres
from dem_warp.device import resolve_device
from dem_warp.population import SIZE_VARIANCE, DrawnGrains, size_of_mean_mass
from dem_warp.scenes.rain import CrossSection, Rain, place_rain

BOTH = ShapeMixture((PYRAMID, BOOT), (0.3, 0.7))
COUNT = 4000


def mixed(shape: ShapeMixture = BOTH) -> GrainPopulation:
    return GrainPopulation(shape, GRAIN, size_mean=1.1, size_sd=0.1)


@pytest.mark.parametrize(
    ("shapes", "fractions", "message"),
    [
        ((), (), r"ShapeMixture.shapes: must hold at least one shape, got none"),
        ((BALL, BOOT), (1.0,), r"ShapeMixture.fractions: must be one for each of 2 shapes, got 1"),
        ((BALL, BOOT), (1.2, -0.2), r"ShapeMixture.fractions\[1\]: must be finite and 0 or more, got -0.2"),
        ((BALL, BOOT), (np.nan, 1.0), r"ShapeMixture.fractions\[0\]: must be finite .* got nan"),
        ((BALL, BOOT), (0.5, 0.4), r"fractions: must add up to 1, got \(0.5, 0.4\), together 0.9"),
        ((BALL, BOOT), (0.0, 0.0), r"fractions: must add up to 1, got \(0.0, 0.0\), together 0"),
    ],
)
def test_bad_fractions_are_refused_with_rule_and_value(shapes, fractions, message):
    with pytest.raises(ValueError, match=message):
        ShapeMixture(shapes, fractions)


def test_shapes_come_out_binomially():
    # In 400 draws of 50 grains the count of a shape has the mean and the variance of a binomial, within four
    # standard errors: sqrt(np(1-p) / 400), and for the variance, of nearly normal counts, sqrt(2 / 400).
    p, n, draws = 0.3, 50, 400
    counts = np.array([np.count_nonzero(mixed().draw(n, seed).shapes == 0) for seed in range(draws)])
    variance = n * p * (1.0 - p)
    assert counts.mean() == pytest.approx(n * p, abs=4.0 * np.sqrt(variance / draws))
    assert counts.var() == pytest.approx(variance, rel=4.0 * np.sqrt(2.0 / draws))


def test_every_shape_has_the_same_sizes():
    drawn = mixed().draw(COUNT, 5)
    one, other = (drawn.sizes[drawn.shapes == shape] for shape in (0, 1))
    # Four standard errors of the difference of two means and, sqrt(2) smaller each, of two deviations.
    error = 0.1 * np.sqrt(1.0 / len(one) + 1.0 / len(other))
    assert one.mean() == pytest.approx(other.mean(), abs=4.0 * error)
    assert one.std() == pytest.approx(other.std(), abs=4.0 * error / np.sqrt(2.0))


def test_a_seed_draws_the_same_grains_and_the_sizes_of_one_shape():
    drawn, again, other = (mixed().draw(50, seed) for seed in (5, 5, 6))
    np.testing.assert_array_equal(drawn.shapes, again.shapes)
    np.testing.assert_array_equal(drawn.sizes, again.sizes)
    assert not np.array_equal(drawn.shapes, other.shapes)
    np.testing.assert_array_equal(drawn.sizes, replace(mixed(), shape=PYRAMID).draw(50, 5).sizes)


@pytest.mark.parametrize("spread", [0.0, 0.05, 0.25])
def test_a_spread_about_the_mean_mass_leaves_the_mass(spread):
    population = GrainPopulation(BALL, GRAIN, size_mean=size_of_mean_mass(1.1, spread), size_sd=spread)
    sizes = population.draw_sizes(200 * COUNT, np.random.default_rng(1))
    # Four standard errors of the two means.
    assert np.mean(sizes**3) == pytest.approx(
        1.1**3, abs=4.0 * np.std(sizes**3) / np.sqrt(len(sizes)) + 1e-14
    )
    deviations = (sizes - sizes.mean()) ** 2
    assert np.mean(deviations) == pytest.approx(
        SIZE_VARIANCE * spread**2, abs=4.0 * np.std(deviations) / np.sqrt(len(sizes)) + 1e-14
    )


def test_a_shape_of_fraction_0_is_as_good_as_absent():
    alone = mixed(ShapeMixture((BOOT,), (1.0,)))
    for shapes, fractions in (((PYRAMID, BOOT), (0.0, 1.0)), ((BOOT, PYRAMID), (1.0, 0.0))):
        population = mixed(ShapeMixture(shapes, fractions))
        assert population.mixture == alone.mixture
        assert population.sphere_count == BOOT.sphere_count
        assert population.smallest_sphere == alone.smallest_sphere
        assert population.draw(9, 1).clumps == (BOOT,)
        assert not population.draw(COUNT, 1).shapes.any()


def test_means_of_a_mixture_are_those_of_its_parts():
    population = mixed()
    volume = 0.3 * PYRAMID.volume + 0.7 * BOOT.volume
    # A few roundings.
    assert population.mean(lambda shape: shape.volume) == pytest.approx(volume, rel=1e-15)
    reach = 0.3 * PYRAMID.volume * PYRAMID.bounding_radius + 0.7 * BOOT.volume * BOOT.bounding_radius
    assert population.grain_reach == pytest.approx(reach / volume, rel=1e-15)
    assert population.sphere_count == 9
    # The smallest sphere of either is 0.6 mm.
    assert population.smallest_sphere == pytest.approx(0.6e-3 * 0.8, rel=1e-15)
    # Of one shape the mean is its value to the last bit, so that its cases keep theirs.
    assert GrainPopulation(PYRAMID, GRAIN).grain_reach == PYRAMID.bounding_radius


def test_a_world_weighs_what_its_parts_weigh():
    case = replace(small_case(), grains=mixed())
    setup = case.scene.prepare([case], resolve_device("cpu"))[0]
    bodies = setup.grains
    # As many as may fill the tube, by the mean volume.
    assert bodies.count == np.ceil(0.58 * case.scene.volume / case.grains.mean(lambda shape: shape.volume))
    total, moments = 0.0, np.zeros(3)
    for index, shape in enumerate((PYRAMID, BOOT)):
        sizes = bodies.sizes[bodies.shapes == index]
        total += GRAIN.density * shape.volume * (sizes**3).sum()
        moments += GRAIN.density * shape.volume * (sizes**5).sum() * shape.inertia_over_mass
    # Sums of a hundred terms in another order.
    assert setup.masses.sum() == pytest.approx(total, rel=1e-13)
    np.testing.assert_allclose(setup.inertias.sum(axis=0), moments, rtol=1e-13)


def placed(fall: Rain) -> CaseResult:
    """The grains of a rain as a result, which knows where their spheres are."""
    grains = fall.grains
    clumps = stack_spheres(grains.clumps)
    return CaseResult("", "", fall.positions, fall.orientations, grains.sizes, grains.shapes, clumps)


def test_a_result_places_the_spheres_of_each_shape():
    drawn = mixed().draw(40, 1)
    rng = np.random.default_rng(1)
    turns = rng.normal(size=(40, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    both = placed(Rain(drawn, rng.normal(size=(40, 3)), turns))
    assert len(both.sphere_radii) == 9 * (drawn.shapes == 0).sum() + 3 * (drawn.shapes == 1).sum()
    for index, shape in enumerate((PYRAMID, BOOT)):
        one = drawn.shapes == index
        same = DrawnGrains((shape,), np.zeros(one.sum(), dtype=int), drawn.sizes[one])
        part = placed(Rain(same, both.positions[one], both.orientations[one]))
        spheres = one[both.sphere_grain]
        np.testing.assert_array_equal(both.sphere_centers[spheres], part.sphere_centers)
        np.testing.assert_array_equal(both.sphere_radii[spheres], part.sphere_radii)
        np.testing.assert_array_equal(both.sphere_grain[spheres], np.flatnonzero(one)[part.sphere_grain])


def fall(bodies: Sequence[DrawnGrains], seeds: Sequence[int]) -> list[Rain]:
    """Dense rains into tubes of 24 mm."""
    n = len(bodies)
    return place_rain(bodies, seeds, [CrossSection.circle(0.012)] * n, [1e-4] * n, resolve_device("cpu"))


def test_a_mixed_rain_keeps_its_spheres_apart_and_inside():
    mixture = ShapeMixture((PYRAMID, BOOT, BALL), (0.5, 0.45, 0.05))
    drawn = replace(mixed(mixture), size_mean=0.7).draw(150, 2)
    seen = placed(fall([drawn], [2])[0])
    centers, radii, owner = seen.sphere_centers, seen.sphere_radii, seen.sphere_grain
    assert np.bincount(drawn.shapes).min() > 2
    gap = np.linalg.norm(centers[:, None] - centers[None], axis=2) - radii[:, None] - radii[None]
    # Kept apart by 2 % of the sum of two radii, but for 1e-8 m of float32 in 0.1 m.
    assert gap[owner[:, None] != owner[None]].min() > 0.02 * 2.0 * radii.min() - 1e-8
    assert (np.hypot(*centers.T[:2]) + radii < 0.012).all()
