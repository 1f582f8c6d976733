"""Designs: published tables, resolution, orthogonality, optimality."""

import itertools

import numpy as np
import pandas as pd
import pytest

import doe
from doe import DesignError, Factor, alias_structure, fractional_factorial, full_factorial, optimal_design

# Word lengths of the catalogue's first designs (Chen, Sun and Wu 1993): resolution by runs and factors.
RESOLUTIONS = {
    8: {4: 4, 5: 3, 6: 3, 7: 3},
    16: {5: 5, 6: 4, 7: 4, 8: 4, 9: 3, 10: 3, 11: 3, 12: 3, 13: 3, 14: 3, 15: 3},
    32: {6: 6, 7: 4, 8: 4, 9: 4, 10: 4, 11: 4, 12: 4, 16: 4},
    64: {7: 7, 8: 5, 9: 4, 10: 4, 11: 4},
    128: {8: 8, 9: 6, 10: 5, 11: 5, 12: 4},
}
SIZES = [(runs, count, r) for runs, table in RESOLUTIONS.items() for count, r in table.items()]


def factors(count: int) -> list[Factor]:
    return [Factor(f"x{number}", 10.0 * number, 10.0 * number + 4.0) for number in range(1, count + 1)]


@pytest.mark.parametrize(("runs", "count", "resolution"), SIZES)
def test_fractions_have_the_published_resolution(runs, count, resolution):
    design = fractional_factorial(factors(count), runs)
    matrix = design.coded.to_numpy()
    assert np.array_equal(matrix.T @ matrix, runs * np.eye(count))
    assert alias_structure(design, order=1).resolution == resolution


def test_fraction_of_a_resolution_is_the_smallest():
    sizes = [len(fractional_factorial(factors(7), resolution=r).coded) for r in (3, 4, 5, 7)]
    assert sizes == [8, 16, 64, 64]


def test_generators_and_their_aliases_in_words():
    design = fractional_factorial(factors(5), generators=["x4 = -x1:x2", "x5 = x1:x3"])
    text = str(alias_structure(design))
    assert "Resolution III" in text
    assert "-x1:x2:x4, x1:x3:x5" in text
    assert "Inseparable: x1 = -x2:x4 = x3:x5" in text


def test_partial_aliases_of_plackett_burman():
    structure = alias_structure(doe.plackett_burman(factors(5)))
    assert structure.resolution == pytest.approx(3.0 + 2.0 / 3.0)
    assert structure.chains == []
    assert structure.of("x1:x2").abs().max() == pytest.approx(1.0 / 3.0)


@pytest.mark.parametrize(
    ("count", "runs", "note"),
    [(5, 16, "resolution V"), (8, 16, "resolution IV"), (11, 24, "foldover"), (8, 12, "33 % of it")],
)
def test_plackett_burman_says_what_does_better(count, runs, note):
    assert note in " ".join(doe.plackett_burman(factors(count), runs).notes)


@pytest.mark.parametrize(("count", "blocks"), [(3, 2), (4, 2), (4, 4), (5, 4), (6, 8)])
def test_blocks_of_a_factorial_cost_no_main_effect(count, blocks):
    design = full_factorial(factors(count), blocks=blocks)
    means = design.coded.groupby(design.blocks.to_numpy()).mean()
    assert np.array_equal(means.to_numpy(), np.zeros((blocks, count)))
    if (count, blocks) != (3, 2):
        pairs = [design.coded[a] * design.coded[b] for a, b in itertools.combinations(design.names, 2)]
        moved = sum(bool(pair.groupby(design.blocks.to_numpy()).mean().abs().max() > 0) for pair in pairs)
        # Montgomery, table 7.9: only 4 factors in 4 blocks must lose an interaction of two.
        assert moved == (1 if (count, blocks) == (4, 4) else 0)
    with pytest.raises(DesignError, match=r"2, 4, \.\.\. and fewer than"):
        full_factorial(factors(count), blocks=3)


@pytest.mark.parametrize(("count", "blocks"), [(2, 2), (3, 3), (4, 3), (5, 2), (6, 2)])
def test_blocks_of_a_composite_design_do_not_disturb_the_model(count, blocks):
    design = doe.central_composite(factors(count), "blocks", center=2, blocks=blocks)
    response = np.random.default_rng(3).normal(size=len(design.coded))
    response += 5.0 * design.blocks.to_numpy()
    with_blocks = doe.fit_surface(design, response)
    without = doe.fit_surface(doe.Design(design.factors, design.coded), response)
    ours, theirs = (surface.coded_coefficients.iloc[1:].to_numpy() for surface in (with_blocks, without))
    assert ours == pytest.approx(theirs, abs=1e-10)  # rounding of the two solutions


@pytest.mark.parametrize("count", [3, 4, 5, 6, 7, 8, 10, 16, 22])
def test_definitive_screening_keeps_main_effects_clear(count):
    design = doe.definitive_screening(factors(count))
    points = design.points.to_numpy()
    second = np.column_stack(
        [points[:, i] * points[:, j] for i, j in itertools.combinations_with_replacement(range(count), 2)]
    )
    assert np.array_equal(points.T @ points, (points[:, 0] ** 2).sum() * np.eye(count))
    assert np.abs(points.T @ second).max() == 0.0
    assert len(points) == 2 * {3: 4, 5: 6, 7: 8, 22: 24}.get(count, count) + 1


def test_foldover_clears_main_effects():
    design = fractional_factorial(factors(7), 8)
    whole = doe.foldover(design)
    assert alias_structure(design).resolution == 3
    assert alias_structure(whole).resolution == 4
    assert whole.blocks.value_counts().to_list() == [8, 8]
    single = alias_structure(doe.foldover(design, ["x1"]))
    assert [name for name in single.of("x1").index if name.count(":") == 1] == []


def test_a_factorial_that_ran_becomes_composite():
    design = doe.add_axial(doe.add_center(full_factorial(factors(2)), 2), 2.0**0.5, center=2)
    assert len(design.coded) == 12
    assert design.blocks.to_list() == ["factorial"] * 6 + ["axial"] * 6
    response = np.random.default_rng(1).normal(size=12)
    assert doe.fit_surface(design, response).anova.loc["blocks", "df"] == 1


def test_joined_designs_keep_the_first_coding():
    first = full_factorial([Factor("a", 0.0, 2.0)])
    second = full_factorial([Factor("a", 2.0, 6.0)])
    both = doe.join(first, second, blocks=["old", "new"])
    assert both.natural["a"].to_list() == [0.0, 2.0, 2.0, 6.0]
    assert both.coded["a"].to_list() == [-1.0, 1.0, 1.0, 5.0]


def test_center_runs_show_curvature_in_a_screening():
    design = doe.add_center(doe.plackett_burman(factors(4)), 4)
    response = 3.0 * design.points["x1"].to_numpy() + 5.0 * (design.points["x2"] == 0.0).to_numpy()
    noise = np.random.default_rng(5).normal(scale=0.1, size=16)
    result = doe.screen(design, response + noise)
    assert result.anova.loc["curvature", "sum_sq"] == pytest.approx(75.0, rel=0.1)  # 12 x 4 / 16 x 5^2
    assert result.significant(0.01) == ["x1"]


def test_latin_hypercube_has_one_run_in_every_slice():
    design = doe.latin_hypercube(factors(3), 20, seed=4)
    slices = np.floor((design.coded.to_numpy() + 1.0) * 10.0)
    assert (np.sort(slices, axis=0) == np.arange(20)[:, None]).all()
    pd.testing.assert_frame_equal(design.coded, doe.latin_hypercube(factors(3), 20, seed=4).coded)


def test_sobol_is_balanced():
    design = doe.sobol(factors(4), 16)
    assert (np.sort(np.floor((design.coded.to_numpy() + 1.0) * 8.0), axis=0) == np.arange(16)[:, None]).all()


def test_optimal_designs_are_the_known_ones():
    # First order in a box: the full factorial, D = 100 %; a quadratic in 9 runs of 2 factors: the 3 x 3 grid.
    assert doe.design_quality(optimal_design(factors(3), 8, "interaction"), "interaction").d_efficiency == (
        pytest.approx(100.0)
    )
    grid = optimal_design(factors(2), 9, "quadratic", levels=3)
    assert len(grid.coded.drop_duplicates()) == 9
    # Atkinson, Donev and Tobias (2007), chapter 11: |X'X|^(1/p) / N of exact D-optimal designs, k = 2.
    for runs, efficiency in ((6, 0.8915), (9, 0.9740)):
        design = optimal_design(factors(2), runs, "quadratic", levels=41, starts=10)
        d = doe.design_quality(design).d_efficiency / 100.0
        # Relative to the continuous optimum, |M| = 1.14e-2 of six coefficients.
        assert d / 1.14e-2 ** (1.0 / 6.0) == pytest.approx(efficiency, abs=2e-3), runs


def test_constraints_are_kept():
    speeds = [Factor(name, 0.0, 10.0) for name in ("v0", "v1", "v2")]
    rules = ["v0 < v1 < v2", lambda table: table["v2"] < 9.9]
    design = optimal_design(speeds, 12, constraints=rules, levels=7)
    natural = design.natural
    assert ((natural["v0"] < natural["v1"]) & (natural["v1"] < natural["v2"]) & (natural["v2"] < 9.9)).all()


def test_optimal_design_adds_to_what_ran():
    ran = full_factorial(factors(2))
    design = optimal_design(factors(2), 5, existing=ran)
    pd.testing.assert_frame_equal(design.points.iloc[:4], ran.points)
    assert design.blocks.to_list() == ["existing"] * 4 + ["added"] * 5
    assert doe.design_quality(design).vif.max() < 3.0


def test_categories_enter_where_the_design_allows():
    variety = doe.Category("variety", ["old", "new", "wild"])
    design = full_factorial([Factor("t", 20.0, 30.0), variety], levels=3)
    assert design.natural["variety"].value_counts().to_list() == [3, 3, 3]
    balanced = optimal_design([Factor("t", 20.0, 30.0), variety], 12, "interaction")
    assert balanced.natural.value_counts().to_list() == [2] * 6
    assert doe.Category("kind", ["a", "b"]).to_natural(-1.0) == "a"
    two = doe.plackett_burman([*factors(3), doe.Category("kind", ["a", "b"])])
    assert set(two.natural["kind"]) == {"a", "b"}


def test_power_is_that_of_a_balanced_effect():
    design = full_factorial(factors(3))
    table = doe.power_table(design, [1.0, 2.0], sd=0.8, replicates=2)
    assert (table["vif"] == 1.0).all()
    assert table["df"].iloc[0] == 12
    assert table["power at 2"].to_numpy() == pytest.approx(doe.effect_power(2.0, 0.8, 16, 12), rel=1e-12)


def test_mixtures():
    assert len(doe.simplex_lattice(list("abcd"), 3).shares) == 20
    assert len(doe.simplex_centroid(list("abcd")).shares) == 15
    design = doe.simplex_lattice(list("abc"), 2, interior=True, lower={"a": 0.1, "b": 0.2})
    assert design.shares.sum(axis=1).to_numpy() == pytest.approx(1.0)
    assert design.shares.min().to_list() == pytest.approx([0.1, 0.2, 0.0])
