"""Factors and designs: coding, orthogonality, rotatability, and what is refused."""

import itertools

import numpy as np
import pandas as pd
import pytest

from doe import (
    Design,
    DesignError,
    Factor,
    central_composite,
    design_quality,
    fit_surface,
    full_factorial,
    plackett_burman,
)
from doe.design.families.central_composite import two_level_part
from doe.design.families.hadamard import screening_matrix, worst_alias

CONSTRUCTIBLE = [n for n in range(4, 129, 4) if n not in (92, 116)]


def factors(count: int) -> list[Factor]:
    return [Factor(f"x{number}", 0.1 * number, 0.3 * number + 1.0) for number in range(1, count + 1)]


def test_coding_returns_the_levels_exactly():
    factor = Factor("mu", 0.1, 0.7)
    assert factor.to_natural(-1.0) == 0.1
    assert factor.to_natural(1.0) == 0.7
    assert factor.center == pytest.approx(0.4, rel=1e-15)
    values = np.linspace(-2.0, 2.0, 9)
    # Two roundings each way.
    assert factor.to_coded(factor.to_natural(values)) == pytest.approx(values, abs=1e-14)


@pytest.mark.parametrize("runs", CONSTRUCTIBLE)
def test_screening_columns_are_orthogonal_and_balanced(runs):
    matrix = np.column_stack([np.ones(runs), screening_matrix(runs)])
    assert np.array_equal(matrix.T @ matrix, runs * np.eye(runs))
    assert set(np.unique(matrix)) == {-1.0, 1.0}
    assert (matrix[-1, 1:] == -1.0).all()


@pytest.mark.parametrize(
    ("runs", "factor_count", "worst"),
    [
        (12, 11, 1 / 3), (28, 27, 3 / 7), (36, 35, 1 / 3), (40, 19, 0.0), (40, 38, 0.6), (44, 43, 3 / 11),
        (52, 25, 1 / 13), (52, 50, 5 / 13), (56, 27, 0.0), (56, 54, 3 / 7), (64, 62, 0.25), (76, 37, 1 / 19),
        (88, 86, 3 / 11), (112, 108, 3 / 7),
    ],
)  # fmt: skip
def test_interactions_fall_no_more_than_so_far_onto_a_factor(runs, factor_count, worst):
    """The sums of the entries' products are integers over N: no rounding."""
    assert worst_alias(screening_matrix(runs, factor_count)[:, :factor_count]) <= worst + 1e-12


@pytest.mark.parametrize(
    ("count", "runs"), [(1, 12), (8, 12), (11, 12), (12, 16), (15, 16), (16, 20), (88, 96)]
)
def test_default_size_is_the_smallest_that_holds_the_factors(count, runs):
    design = plackett_burman(factors(count))
    assert design.coded.shape == (runs, runs - 1)
    assert len(design.dummies) == runs - 1 - count
    assert list(design.natural.columns) == design.names


def test_run_order_is_a_seeded_permutation():
    first, again, other = (plackett_burman(factors(8), seed=seed) for seed in (1, 1, 2))
    assert list(first.run_order) == list(again.run_order)
    assert list(first.run_order) != list(other.run_order)
    assert sorted(first.run_order) == list(range(1, 13))
    assert list(plackett_burman(factors(8)).run_order) == list(range(1, 13))
    pd.testing.assert_frame_equal(first.coded, other.coded)


@pytest.mark.parametrize("count", range(1, 11))
def test_two_level_part_keeps_effects_and_interactions_apart(count):
    part = two_level_part(count)
    pairs = [part[:, i] * part[:, j] for i, j in itertools.combinations(range(count), 2)]
    columns = np.array([np.ones(len(part)), *part.T, *pairs])
    assert np.array_equal(columns @ columns.T, len(part) * np.eye(len(columns)))


def test_composite_of_two_factors():
    design = central_composite(factors(2), alpha=1.414, center=5)
    expected = [[-1, -1], [1, -1], [-1, 1], [1, 1], [-1.414, 0], [1.414, 0], [0, -1.414], [0, 1.414]]
    assert np.array_equal(design.coded.to_numpy(), np.array(expected + [[0, 0]] * 5))


@pytest.mark.parametrize(
    ("alpha", "distance"), [("rotatable", 8**0.25), ("face", 1.0), ("spherical", 3**0.5)]
)
def test_axial_distance_by_name(alpha, distance):
    assert central_composite(factors(3), alpha).coded.to_numpy().max() == pytest.approx(distance, rel=1e-15)


@pytest.mark.parametrize("count", [2, 3, 4, 6])
def test_rotatable_prediction_variance_depends_on_the_radius_alone(count):
    design = central_composite(factors(count))
    response = np.random.default_rng(1).normal(size=len(design.coded))
    surface = fit_surface(design, response)
    directions = np.random.default_rng(2).normal(size=(50, count))
    points = 0.8 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    _, se = surface.evaluate(points)
    # Exact in theory; the solution of the normal equations rounds.
    assert se == pytest.approx(se[0], rel=1e-10)
    _, face_se = fit_surface(central_composite(factors(count), "face"), response).evaluate(points)
    assert np.ptp(face_se) > 1e-3 * face_se.mean()


def test_table_in_natural_units_is_the_same_design():
    design = central_composite(factors(3))
    again = Design.from_table(design.natural, design.factors, coded=False)
    # Coding and back: a few roundings.
    assert again.coded.to_numpy() == pytest.approx(design.coded.to_numpy(), abs=1e-13)


def test_dummies_are_named_and_factor_order_is_the_factors():
    design = plackett_burman(factors(4))
    shuffled = design.coded[design.coded.columns[::-1]]
    with pytest.raises(DesignError, match="column 'dummy7' is no factor: name it among the dummies"):
        Design.from_table(shuffled, design.factors)
    again = Design.from_table(shuffled, design.factors, dummies=design.dummies)
    assert again.names == design.names
    assert set(again.dummies) == set(design.dummies)


def test_selection_renumbers_and_repeats():
    design = central_composite(factors(2)).select([9, 1, 1])
    assert list(design.coded.index) == [1, 2, 3]
    assert design.coded.to_numpy().tolist() == [[0, 0], [-1, -1], [-1, -1]]


def test_design_does_not_share_the_callers_table():
    table = central_composite(factors(2)).coded
    design = Design.from_table(table, factors(2))
    table.iloc[0, 0] = 99.0
    assert design.coded.iloc[0, 0] == -1.0


def test_predictions_of_a_factorial_have_the_variances_of_its_plane():
    """(1 + x'x) / 8 at x: between 1/8 and 4/8, on average 2/8, by 2,048 even points to 1e-3."""
    design = full_factorial([Factor(name, 0.0, 1.0) for name in "abc"])
    variances = design_quality(design, "first-order").variances
    assert variances.mean() == pytest.approx(0.25, rel=1e-3)
    assert 1 / 8 <= variances[0] < variances[-1] <= 4 / 8
