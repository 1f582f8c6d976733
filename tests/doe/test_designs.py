"""Factors and designs: coding, orthogonality, rotatability, and what is refused."""

import itertools

import numpy as np
import pandas as pd
import pytest

from doe import Design, DesignError, Factor, central_composite, fit_surface, plackett_burman
from doe.design.families.central_composite import two_level_part
from doe.design.families.hadamard import hadamard_candidates, screening_matrix, worst_alias

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


def test_label_leaves_out_the_unit_one():
    assert Factor("G", 1.0, 2.0, "MPa").label == "G [MPa]"
    assert Factor("mu", 0.1, 0.7, "1").label == "mu"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("x", 2.0, 1.0), "low must be below high, got 2.0 and 1.0"),
        (("x", 1.0, 1.0), "low must be below high"),
        (("x", float("nan"), 1.0), "factor 'x': low must be finite, got nan"),
        (("x", 0.0, float("inf")), "high must be finite"),
        (("", 0.0, 1.0), "name is not empty"),
        (("a:b", 0.0, 1.0), "'a:b'"),
        (("total", 0.0, 1.0), "names a row of the analysis tables"),
    ],
)
def test_factor_refuses(arguments, message):
    with pytest.raises(DesignError, match=message):
        Factor(*arguments)


@pytest.mark.parametrize("runs", CONSTRUCTIBLE)
def test_screening_columns_are_orthogonal_and_balanced(runs):
    matrix = np.column_stack([np.ones(runs), screening_matrix(runs)])
    assert np.array_equal(matrix.T @ matrix, runs * np.eye(runs))
    assert set(np.unique(matrix)) == {-1.0, 1.0}
    assert (matrix[-1, 1:] == -1.0).all()


@pytest.mark.parametrize("order", [1, 2, 28, 52, 64])
def test_hadamard(order):
    candidates = hadamard_candidates(order)
    assert candidates
    for matrix in candidates:
        assert np.array_equal(matrix.T @ matrix, order * np.eye(order))


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


def test_twelve_runs_are_the_published_cyclic_design():
    first = plackett_burman(factors(11)).coded.iloc[0]
    assert "".join("+" if value > 0 else "-" for value in first) == "++-+++---+-"


@pytest.mark.parametrize(
    ("count", "runs"), [(1, 12), (8, 12), (11, 12), (12, 16), (15, 16), (16, 20), (88, 96)]
)
def test_default_size_is_the_smallest_that_holds_the_factors(count, runs):
    design = plackett_burman(factors(count))
    assert design.coded.shape == (runs, runs - 1)
    assert len(design.dummies) == runs - 1 - count
    assert list(design.natural.columns) == design.names


@pytest.mark.parametrize(
    ("runs", "message"),
    [
        (8, "8 factors need at least 9 runs, got 8"),
        (14, "multiple of 4.*got 14"),
        (92, "got 92"),
    ],
)
def test_screening_design_refuses(runs, message):
    with pytest.raises(DesignError, match=message):
        plackett_burman(factors(8), runs=runs)


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


def test_two_level_part_is_a_fraction_from_five_factors_on():
    assert [len(two_level_part(count)) for count in range(1, 11)] == [2, 4, 8, 16, 16, 32, 64, 64, 128, 128]
    assert len(two_level_part(5, full=True)) == 32
    assert len(central_composite(factors(5), center=6).coded) == 32


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


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"alpha": "corner"},
            "alpha is one of rotatable, face, spherical, orthogonal, blocks or a number, got 'corner'",
        ),
        ({"alpha": 0.0}, "alpha must be positive and finite, got 0"),
        ({"center": -1}, "at least 0, got -1"),
    ],
)
def test_composite_refuses(options, message):
    with pytest.raises(DesignError, match=message):
        central_composite(factors(2), **options)


def test_composite_refuses_too_many_factors():
    with pytest.raises(DesignError, match="1 to 10 factors, got 11"):
        central_composite(factors(11))


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
    with pytest.raises(DesignError, match="no run 4"):
        design.select([4])


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"x1": [1.0, -1.0]}, "no column for factor 'x2'"),
        ({"x1": [1.0, -1.0], "x2": [1.0, float("nan")]}, "nan.* in run 1, column 'x2'"),
        ({"x1": [1.0, -1.0], "x2": [1.0, -1.0], "angle": [9.2, 15.3]}, "column 'angle' is no factor"),
        ({"x1": [1.0, -1.0], "x2": ["a", "b"]}, "holds numbers"),
        ({"x1": [], "x2": []}, "at least one run"),
    ],
)
def test_table_refuses(table, message):
    with pytest.raises(DesignError, match=message):
        Design.from_table(pd.DataFrame(table), factors(2))


def test_table_refuses_a_run_label_twice():
    table = pd.DataFrame({"x1": [1.0, -1.0]}, index=[3, 3])
    with pytest.raises(DesignError, match="run label comes once, got again: 3"):
        Design.from_table(table, factors(1))


def test_design_refuses_no_factor_and_a_name_twice():
    with pytest.raises(DesignError, match="at least one factor"):
        plackett_burman([])
    with pytest.raises(DesignError, match="got twice: x1"):
        central_composite([*factors(1), *factors(1)])


def test_design_does_not_share_the_callers_table():
    table = central_composite(factors(2)).coded
    design = Design.from_table(table, factors(2))
    table.iloc[0, 0] = 99.0
    assert design.coded.iloc[0, 0] == -1.0
