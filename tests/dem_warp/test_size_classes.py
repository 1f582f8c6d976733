"""Classes of size: what a world of few grains keeps of them, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from worlds import GRAIN, PYRAMID, STEEL, ball_case, run_batch

from dem_warp import ClumpShape, Drum, GrainPopulation, SizeClasses

SPREAD = 0.3


def lognormal(count: int = 10) -> SizeClasses:
    """Classes of equal numbers of a lognormal distribution, of mean cube 1."""
    middles = stats.lognorm.ppf((np.arange(count) + 0.5) / count, SPREAD)
    sizes = middles / np.cbrt(np.mean(middles**3))
    return SizeClasses(tuple(sizes.tolist()), (1.0 / count,) * count)


CLASSES = lognormal()
POPULATION = GrainPopulation.of_classes(PYRAMID, GRAIN, CLASSES)


@pytest.mark.parametrize(("count", "tolerance"), [(50, 0.015), (1000, 0.0005)])
def test_a_world_keeps_the_mean_mass_of_the_distribution(count: int, tolerance: float) -> None:
    """The stated tolerance: of 200 seeds, none is further off; independent draws are, mostly."""
    errors = np.array([np.mean(POPULATION.draw(count, seed).sizes ** 3) - 1.0 for seed in range(200)])
    assert np.abs(errors).max() < tolerance
    rng = np.random.default_rng(1)
    independent = [np.mean(rng.choice(CLASSES.sizes, count) ** 3) - 1.0 for _ in range(200)]
    assert errors.std() < 0.1 * np.std(independent)


def test_the_first_grains_of_a_world_keep_it_too() -> None:
    # A container takes as many as fill it: of 1,000 kept ready the first 400.
    errors = [np.mean(POPULATION.draw(1000, seed).sizes[:400] ** 3) - 1.0 for seed in range(100)]
    # 400 are 25 whole groups of grains that changed places: as good as a world of 400.
    assert np.abs(errors).max() < 0.001


def test_every_class_comes_out_with_its_share_and_neighbours_are_strangers() -> None:
    sizes = POPULATION.draw(1000, 3).sizes
    found, counts = np.unique(sizes, return_counts=True)
    assert found.tolist() == list(CLASSES.sizes)
    # A class has its share of 100 within two grains or three.
    assert np.abs(counts - 100).max() <= 3
    places = np.searchsorted(found, sizes)
    # Rank correlation of neighbours: 1 / sqrt(1000) is one standard error.
    assert abs(stats.spearmanr(places[:-1], places[1:]).statistic) < 0.1


def test_a_seed_draws_the_same_sizes_whatever_is_drawn_beside() -> None:
    first = POPULATION.draw(50, 5).sizes
    POPULATION.draw(70, 6)
    assert np.array_equal(POPULATION.draw(50, 5).sizes, first)
    assert not np.array_equal(POPULATION.draw(50, 6).sizes, first)


def test_a_world_of_classes_weighs_what_it_should() -> None:
    drum = Drum(0.05, 0.018, STEEL, rotation_rate=1.0, grain_count=60, start_up=0.0, revolutions=0.05)
    case = replace(
        ball_case(drum, 0.3), grains=GrainPopulation.of_classes(ClumpShape.sphere(2e-3), GRAIN, CLASSES)
    )
    run = run_batch([case])[0]
    assert (run.status, len(run.sizes)) == ("finished", 60)
    assert set(run.sizes) <= set(CLASSES.sizes)
    # As of a world of 50.
    assert np.mean(run.sizes**3) == pytest.approx(1.0, abs=0.015)


@pytest.mark.parametrize(
    ("sizes", "fractions", "message"),
    [
        ((), (), r"SizeClasses.fractions: must be one for each of 0 sizes, got 0"),
        ((1.0,), (0.5, 0.5), r"SizeClasses.fractions: must be one for each of 1 sizes, got 2"),
        (
            (1.0, 0.9),
            (0.5, 0.5),
            r"SizeClasses.sizes: must be positive, finite and increasing, got \(1.0, 0.9\)",
        ),
        ((0.0, 0.9), (0.5, 0.5), r"SizeClasses.sizes: must be positive"),
        ((0.9, np.inf), (0.5, 0.5), r"SizeClasses.sizes: must be positive, finite"),
        (
            (0.9, 1.1),
            (0.5, 0.4),
            r"SizeClasses.fractions: must add up to 1, got \(0.5, 0.4\)",
        ),
        ((0.9, 1.1), (1.0, 0.0), r"SizeClasses.fractions: must be positive"),
    ],
)
def test_bad_classes_are_refused_with_rule_and_value(sizes, fractions, message) -> None:
    with pytest.raises(ValueError, match=message):
        SizeClasses(sizes, fractions)


def test_another_mean_than_that_of_the_classes_is_refused() -> None:
    with pytest.raises(ValueError, match=r"size_mean: must be that of the classes, .* got 1.0"):
        GrainPopulation(PYRAMID, GRAIN, 1.0, 0.05, CLASSES)
