"""Populations of shapes and sizes: their draws, weights, rain and refusals."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from worlds import BALL, BOOT, GRAIN, PYRAMID, small_case, spheres_of

from dem_warp import CaseResult, GrainPopulation, ShapeMixture, SizeClasses
from dem_warp.clumps import stack_spheres
from dem_warp.device import resolve_device
from dem_warp.population import SIZE_VARIANCE, DrawnGrains, size_of_mean_mass
from dem_warp.scenes.rain import CrossSection, Rain, place_rain

BOTH = ShapeMixture((PYRAMID, BOOT), (0.3, 0.7))
COUNT = 4000


def mixed(shape: ShapeMixture = BOTH) -> GrainPopulation:
    return GrainPopulation(shape, GRAIN, size_mean=1.1, size_sd=0.1)


def test_shapes_come_out_binomially():
    # In 400 draws of 50 grains the count of a shape has the mean and the variance of a binomial, within four
    # standard errors: sqrt(np(1-p) / 400), and for the variance, of nearly normal counts, sqrt(2 / 400).
    p, n, draws = 0.3, 50, 400
    counts = np.array([np.count_nonzero(mixed().draw(n, seed).shapes == 0) for seed in range(draws)])
    variance = n * p * (1.0 - p)
    assert counts.mean() == pytest.approx(n * p, abs=4.0 * np.sqrt(variance / draws))
    assert counts.var() == pytest.approx(variance, rel=4.0 * np.sqrt(2.0 / draws))


def test_a_seed_draws_the_same_grains_and_the_sizes_of_one_shape():
    drawn, again, other = (mixed().draw(50, seed) for seed in (5, 5, 6))
    np.testing.assert_array_equal(drawn.shapes, again.shapes)
    np.testing.assert_array_equal(drawn.sizes, again.sizes)
    assert not np.array_equal(drawn.shapes, other.shapes)
    np.testing.assert_array_equal(drawn.sizes, replace(mixed(), shape=PYRAMID).draw(50, 5).sizes)


@pytest.mark.parametrize("spread", [0.0, 0.25])
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


def test_a_shape_of_fraction_0_is_absent():
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
    # The mean of one shape is its value to the last bit, so that its cases keep their bits.
    assert GrainPopulation(PYRAMID, GRAIN).grain_reach == PYRAMID.bounding_radius


def test_a_world_has_the_mass_and_inertia_of_its_parts():
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
    """Return the grains of a rain as a result, which places their spheres."""
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
        poses = {"positions": both.positions[one], "orientations": both.orientations[one]}
        centers, radii = spheres_of(shape, poses, drawn.sizes[one])
        spheres = one[both.sphere_grain]
        # Two ways to turn a vector differ by rounding.
        np.testing.assert_allclose(both.sphere_centers[spheres], centers, atol=1e-15)
        np.testing.assert_array_equal(both.sphere_radii[spheres], radii)


def fall(bodies: Sequence[DrawnGrains], seeds: Sequence[int]) -> list[Rain]:
    """Return dense rains into tubes of 24 mm."""
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


SPREAD = 0.3


def lognormal(count: int = 10) -> SizeClasses:
    """Return classes of equal numbers of a lognormal distribution, of mean cube 1."""
    middles = stats.lognorm.ppf((np.arange(count) + 0.5) / count, SPREAD)
    sizes = middles / np.cbrt(np.mean(middles**3))
    return SizeClasses(tuple(sizes.tolist()), (1.0 / count,) * count)


CLASSES = lognormal()
POPULATION = GrainPopulation.of_classes(PYRAMID, GRAIN, CLASSES)


@pytest.mark.parametrize(("count", "tolerance"), [(50, 0.015), (1000, 0.0005)])
def test_a_world_keeps_the_mean_mass_of_the_distribution(count: int, tolerance: float) -> None:
    # The stated tolerance holds for every seed; most independent draws are further off.
    errors = np.array([np.mean(POPULATION.draw(count, seed).sizes ** 3) - 1.0 for seed in range(40)])
    assert np.abs(errors).max() < tolerance
    rng = np.random.default_rng(1)
    independent = [np.mean(rng.choice(CLASSES.sizes, count) ** 3) - 1.0 for _ in range(200)]
    assert errors.std() < 0.1 * np.std(independent)


def test_the_first_grains_of_a_world_keep_it_too() -> None:
    # A container takes as many as fill it: of 1,000 kept ready the first 400.
    errors = [np.mean(POPULATION.draw(1000, seed).sizes[:400] ** 3) - 1.0 for seed in range(20)]
    # 400 are 25 whole groups of grains that changed places: as good as a world of 400.
    assert np.abs(errors).max() < 0.001


def test_every_class_has_its_share_and_neighbours_are_independent() -> None:
    sizes = POPULATION.draw(1000, 3).sizes
    found, counts = np.unique(sizes, return_counts=True)
    assert found.tolist() == list(CLASSES.sizes)
    # A class has its share of 100 within two grains or three.
    assert np.abs(counts - 100).max() <= 3
    places = np.searchsorted(found, sizes)
    # Rank correlation of neighbours: 1 / sqrt(1000) is one standard error.
    assert abs(stats.spearmanr(places[:-1], places[1:]).statistic) < 0.1


def test_a_seed_draws_the_same_sizes_after_other_draws() -> None:
    first = POPULATION.draw(50, 5).sizes
    POPULATION.draw(70, 6)
    assert np.array_equal(POPULATION.draw(50, 5).sizes, first)
    assert not np.array_equal(POPULATION.draw(50, 6).sizes, first)


TUBE = 0.012
SPACING = 1.0e-4
RAINED = 150
# The device places in float32, whose rounding of 0.1 m is 4e-9 m; spheres keep 2 % of their radii apart.
ROUNDING = 1e-8


def rain(seeds=(1,), spacing: float = SPACING, radius: float = TUBE) -> list[Rain]:
    """Return rains of grains whose sizes follow from their seeds."""
    n = len(seeds)
    one = np.zeros(RAINED, dtype=int)
    bodies = [
        DrawnGrains((PYRAMID,), one, np.random.default_rng(seed).uniform(0.85, 1.15, RAINED))
        for seed in seeds
    ]
    return place_rain(bodies, seeds, [CrossSection.circle(radius)] * n, [spacing] * n, resolve_device("cpu"))


def test_grains_arrive_in_order_and_at_their_rate_at_most():
    heights = rain()[0].positions[:, 2]
    assert (np.diff(heights) > SPACING - ROUNDING).all()
    # This dense a rain delays some grains.
    assert heights[-1] > (RAINED - 1) * SPACING + ROUNDING


def test_a_sparse_rain_keeps_its_rate():
    spacing = 3.0 * PYRAMID.bounding_radius
    heights = rain(spacing=spacing)[0].positions[:, 2]
    np.testing.assert_allclose(heights, np.arange(RAINED) * spacing, rtol=1e-6)


def test_grains_are_turned_and_spread_evenly():
    fall = rain(spacing=3.0 * PYRAMID.bounding_radius)[0]
    np.testing.assert_allclose(np.linalg.norm(fall.orientations, axis=1), 1.0, rtol=1e-12)
    # Four standard errors of a mean of 150: a uniform quaternion's component has variance 1/4, and a place in
    # a disc has variance r^2 / 4 in each direction.
    assert (np.abs(fall.orientations.mean(axis=0)) < 4 * 0.5 / np.sqrt(RAINED)).all()
    assert (np.abs(fall.positions[:, :2].mean(axis=0)) < 4 * 0.5 * TUBE / np.sqrt(RAINED)).all()


def test_a_tube_too_narrow_for_the_grains_is_refused():
    with pytest.raises(
        ValueError, match=r"grains of \d\.\d\d mm in a container of 2\.00 mm; lower rain_rate"
    ):
        rain(radius=0.5e-3 * 2)


def test_the_scene_releases_each_grain_at_its_plane():
    case = small_case()
    setup = case.scene.prepare([case], resolve_device("cpu"))[0]
    bodies = setup.grains
    reach = setup.bounding_radii.max()
    plane = case.scene.height + PYRAMID.bounding_radius * bodies.sizes.max()
    released = bodies.positions[:, 2] - bodies.release_steps * case.time_step * case.scene.rain_speed
    # At the first step at or below the plane: a step of fall below it at most.
    assert (released <= plane + 1e-12).all()
    assert (released > plane - case.time_step * case.scene.rain_speed - 1e-12).all()
    assert plane >= case.scene.height + reach
    np.testing.assert_array_equal(
        bodies.velocities, np.tile([0.0, 0.0, -case.scene.rain_speed], (bodies.count, 1))
    )
    # Every grain that the tube may hold, and more, is kept ready within the domain.
    assert bodies.count * PYRAMID.volume > 0.55 * case.scene.volume
    assert (np.abs(bodies.positions - setup.origin) < setup.half_extent).all()
