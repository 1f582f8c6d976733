"""Analysis beyond the fit: shape, optima, desirability, diagnostics, formulas, effects."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import doe
from doe import Design, DesignError, Factor, Wish, canonical, central_composite, fit_surface, ridge_path

FACTORS = [Factor("a", 0.0, 2.0), Factor("b", 10.0, 20.0)]


def drawn(seed: int = 1, sd: float = 0.05) -> tuple[Design, np.ndarray]:
    """Return a composite design and a response with its maximum of 10 at coded (.3, -.2)."""
    design = central_composite(FACTORS, center=5)
    a, b = design.points.to_numpy().T
    mean = 10.0 - 2.0 * (a - 0.3) ** 2 - 1.0 * (b + 0.2) ** 2 + 0.5 * (a - 0.3) * (b + 0.2)
    return design, mean + np.random.default_rng(seed).normal(scale=sd, size=len(a))


def test_blocks_are_a_term_and_dummies_are_named():
    design, response = drawn()
    labels = ["day 1"] * 6 + ["day 2"] * 7
    shifted = response + 3.0 * (np.array(labels) == "day 2")
    plain = fit_surface(design, shifted)
    table = design.points.assign(block=labels)
    blocked = fit_surface(Design.from_table(table, design.factors, coded=True, block="block"), shifted)
    assert blocked.residual_ms < 0.01 < plain.residual_ms
    assert blocked.anova.loc["blocks", "df"] == 1
    assert blocked.anova.loc["blocks":"model", "sum_sq"].sum() + blocked.anova.loc["residual", "sum_sq"] == (
        pytest.approx(blocked.anova.loc["total", "sum_sq"], rel=1e-12)
    )
    with pytest.raises(DesignError, match=r"column 'block' is no factor.*block='block'"):
        Design.from_table(table, design.factors, coded=True)


def test_canonical_analysis_finds_the_drawn_shape():
    analysis = canonical(fit_surface(*drawn()))
    assert analysis.stationary.kind == "maximum"
    assert analysis.stationary.coded.to_numpy() == pytest.approx([0.3, -0.2], abs=0.05)
    assert analysis.axes.to_numpy().T @ analysis.axes.to_numpy() == pytest.approx(np.eye(2), abs=1e-12)
    assert not analysis.table["flat"].any()
    assert analysis.notes == ()
    assert "Maximum at a = " in str(analysis)


def test_a_ridge_is_said():
    design = central_composite(FACTORS, center=5)
    a, b = design.points.to_numpy().T
    response = 5.0 - 2.0 * (a + b) ** 2 + 0.4 * a + np.random.default_rng(3).normal(scale=0.1, size=len(a))
    analysis = canonical(fit_surface(design, response))
    assert analysis.table["flat"].to_list() == [False, True]
    assert "the curvature may be 0: the surface is a ridge" in analysis.notes[0]


def test_curvature_errors_cover():
    """The curvature of the true first axis lies in its interval in 95 % of draws, within 3 se of 60."""
    design = central_composite(FACTORS, center=5)
    a, b = design.points.to_numpy().T
    rng = np.random.default_rng(12)
    hits = 0
    for _ in range(60):
        response = -3.0 * a**2 - 1.0 * b**2 + rng.normal(scale=0.3, size=len(a))
        row = canonical(fit_surface(design, response)).table.iloc[0]
        hits += row["low"] <= -3.0 <= row["high"]
    assert hits / 60 == pytest.approx(0.95, abs=0.085)


def test_ridge_path_beats_every_other_point_of_its_sphere():
    surface = fit_surface(*drawn())
    radii = [0.0, 0.2, 0.8, 1.3]
    up, down = ridge_path(surface, radii), ridge_path(surface, radii, descend=True)
    angles = np.linspace(0.0, 2.0 * np.pi, 721)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    for radius in radii:
        values = surface.evaluate(radius * circle)[0]
        assert np.linalg.norm(up.filter(like="coded ").loc[radius]) == pytest.approx(radius, rel=1e-9)
        assert up["mean"][radius] >= values.max() - 1e-9
        assert down["mean"][radius] <= values.min() + 1e-9


def test_region_of_the_optimum_covers_it():
    """Exact by theory: 95 % of draws, within 3 standard errors of 60."""
    hits = 0
    for seed in range(60):
        design, response = drawn(seed, sd=0.4)
        surface = fit_surface(design, response)
        region = doe.stationary_region(surface, resolution=41)
        nearest = (region.coded - [0.3, -0.2]).pow(2).sum(axis=1).argmin()
        hits += bool(region.mask[nearest])
    assert hits / 60 == pytest.approx(0.95, abs=0.085)


def test_largest_and_smallest_response():
    surface = fit_surface(*drawn())
    best = doe.maximize(surface)
    assert best.coded.to_numpy() == pytest.approx(canonical(surface).stationary.coded.to_numpy(), abs=1e-6)
    assert best.at_edge == ()
    worst = doe.minimize(surface)
    corners = surface.evaluate([[x, y] for x in (-1.0, 1.0) for y in (-1.0, 1.0)])[0]
    assert worst.responses.loc["response", "mean"] == pytest.approx(corners.min(), rel=1e-12)
    assert worst.at_edge == ("a", "b")
    held = doe.maximize(surface, constraints=["a < 0.5"])
    assert held.natural["a"] < 0.5
    assert held.natural["a"] == pytest.approx(0.5, abs=1e-6)
    ring = doe.minimize(surface, radius=0.5)
    assert np.linalg.norm(ring.coded) == pytest.approx(0.5, rel=1e-6)
    path = ridge_path(surface, [0.5], descend=True)["mean"].iloc[0]
    assert ring.responses.loc["response", "mean"] == pytest.approx(path, rel=1e-9)


def test_wishes_are_those_of_derringer_and_suich():
    up, down = Wish(0.0, 10.0), Wish(0.0, 10.0, larger=False, weight=2.0)
    between = Wish(0.0, 10.0, target=4.0, weight=(1.0, 0.5))
    values = np.array([-1.0, 0.0, 4.0, 8.5, 10.0, 11.0])
    assert up.of(values) == pytest.approx([0, 0, 0.4, 0.85, 1, 1])
    assert down.of(values) == pytest.approx([1, 1, 0.36, 0.0225, 0, 0])
    assert between.of(values) == pytest.approx([0, 0, 1, 0.5, 0, 0])


def test_most_desirable_setting_is_that_of_a_fine_grid():
    design, response = drawn()
    cost = 1.0 + design.points["a"] + 0.01 * response
    surfaces = {"yield": fit_surface(design, response), "cost": fit_surface(design, cost)}
    wishes = {"yield": Wish(5.0, 11.0), "cost": Wish(0.0, 3.0, larger=False, importance=2.0)}
    best = doe.most_desirable(surfaces, wishes)
    axis = np.linspace(-1.0, 1.0, 201)
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    shares = {name: wish.of(surfaces[name].evaluate(grid)[0]) for name, wish in wishes.items()}
    overall = shares["yield"] ** (1 / 3) * shares["cost"] ** (2 / 3)
    assert best.desirability >= overall.max() - 1e-9
    # The grid's best lies within half a cell of the true one.
    assert best.desirability == pytest.approx(overall.max(), abs=1e-3)
    with pytest.raises(DesignError, match="no setting of the region meets every wish"):
        doe.most_desirable(surfaces, {**wishes, "yield": Wish(50.0, 60.0)})
    with pytest.raises(DesignError, match="wishes must be for every surface"):
        doe.most_desirable(surfaces, {"yield": Wish(0.0, 1.0)})


def test_influence_names_the_run_that_is_wrong():
    design, response = drawn()
    response[6] += 2.0
    table = doe.influence(fit_surface(design, response))
    assert "outlier" in table["remark"].iloc[6]
    assert (table["remark"].drop(index=table.index[6]).str.contains("outlier")).sum() == 0
    assert table["leverage"].sum() == pytest.approx(6.0, rel=1e-12)


def test_box_cox_finds_the_scale_that_was_drawn():
    design, response = drawn(sd=0.0)
    noise = np.random.default_rng(6).normal(scale=0.02, size=len(response))
    for power, transform, advice in ((0.0, np.exp, "log(y)"), (0.5, np.square, "sqrt(y)")):
        scaled = transform(response + noise)
        found = doe.box_cox(fit_surface(design, scaled))
        assert found.low < power < found.high
        assert found.advice == advice
    with pytest.raises(DesignError, match="must be positive"):
        doe.box_cox(fit_surface(design, response - 20.0))


def test_terms_may_be_written():
    design = doe.full_factorial([Factor(name, 0.0, 1.0) for name in "abc"], levels=3)
    x = design.points
    response = 1.0 + x["a"] + 2.0 * x["a"] * x["b"] * x["c"] - x["c"] ** 2
    response = response + np.random.default_rng(3).normal(scale=1e-9, size=len(response))
    terms = ["a", "b", "c", "a:b", "a:c", "b:c", "a:b:c", "c^2"]
    surface = fit_surface(design, response.to_numpy(), terms)
    assert surface.coded_coefficients[["a", "a:b:c", "c^2"]].to_list() == pytest.approx([1, 2, -1], abs=1e-7)
    natural = surface.predict({"a": 0.25, "b": 0.9, "c": 0.4})["mean"].iloc[0]
    a, b, c = -0.5, 0.8, -0.2
    assert natural == pytest.approx(1.0 + a + 2.0 * a * b * c - c**2, abs=1e-7)
    at = surface.coefficients
    assert at["intercept"] + at["a"] * 0.25 + at["b"] * 0.9 + at["c"] * 0.4 + at["a:b"] * 0.225 + at[
        "a:c"
    ] * 0.1 + at["b:c"] * 0.36 + at["a:b:c"] * 0.09 + at["c^2"] * 0.16 == pytest.approx(natural, abs=1e-7)
    with pytest.raises(DesignError, match="second degree, got a:b:c"):
        surface.stationary_point()
    refused = {"needs": ["a:b"], "no factor is named 'q'": ["q"], "twice": ["a", "a"], "one power": ["a:b^2"]}
    for message, bad in refused.items():
        with pytest.raises(DesignError, match=message):
            fit_surface(design, response.to_numpy(), bad)


def test_formulas_take_categories_and_blocks():
    variety = doe.Category("variety", ["old", "new", "wild"])
    design = doe.full_factorial([Factor("t", 20.0, 30.0), variety], levels=3)
    design = replace(design, blocks=pd.Series(["m", "n", "m"] * 3, index=design.coded.index))
    shift = design.natural["variety"].map({"old": 0.0, "new": 2.0, "wild": -1.0}).to_numpy()
    response = 5.0 + 1.5 * design.points["t"].to_numpy() + shift + 4.0 * (design.blocks == "n").to_numpy()
    response = response + np.random.default_rng(2).normal(scale=0.01, size=9)
    fit = doe.fit_formula(design, response, "t + C(variety)")
    table = fit.coefficient_table["estimate"]
    assert table["C(variety)[T.new]"] == pytest.approx(2.0, abs=0.05)
    assert table["C(block)[T.n]"] == pytest.approx(4.0, abs=0.05)
    assert "C(variety)" in fit.summary()
    row = fit.predict({"t": 0.0, "variety": "wild", "block": "m"}).iloc[0]
    assert row["mean"] == pytest.approx(4.0, abs=0.05)
    with pytest.raises(DesignError, match="a formula takes them by name"):
        fit_surface(design, response)
    for bad in ("t ~ variety", "t +", "t + nonsense"):
        with pytest.raises(DesignError):
            doe.fit_formula(design, response, bad)


def test_scheffe_polynomial_returns_pure_blends():
    mixture = doe.simplex_lattice(["x", "y", "z"], 2)
    truth = (
        mixture.shares["x"] * 3.0
        + mixture.shares["y"] * 5.0
        + mixture.shares["x"] * mixture.shares["y"] * 8.0
    )
    replicates = np.column_stack([truth + 1e-9, truth - 1e-9])
    fit = doe.fit_mixture(mixture, replicates)
    assert fit.coefficient_table["estimate"].to_numpy() == pytest.approx([3, 5, 0, 8, 0, 0], abs=1e-7)


def test_lenth_names_the_active_effects_of_a_saturated_fraction():
    design = doe.fractional_factorial([Factor(name, 0.0, 1.0) for name in "abcdefg"], 16)
    x = design.points
    response = 4.0 * x["a"] - 3.0 * x["b"] * x["d"] + np.random.default_rng(4).normal(scale=0.3, size=16)
    result = doe.two_level_effects(design, response.to_numpy())
    assert result.table.index[0] == "a"
    name = result.table.index[1]
    assert "b:d" in {name, *result.table.loc[name, "mixed with"].split(", ")}
    assert result.significant(0.05) == ["a", name]
    assert result.limit(together=True) > result.limit()


def test_summary_and_repr_can_be_read():
    design, response = drawn()
    surface = fit_surface(design, response)
    text = surface.summary()
    for word in ("Coefficients", "pure quadratic", "lack of fit", "predicted", "in natural units"):
        assert word in text
    assert repr(design) == "Design of 13 runs in a 0..2, b 10..20; 4 repeated settings"
    assert repr(surface).startswith("Surface in a, b, a:b, a^2, b^2: 13 observations, R2 0.9")
    assert "chosen by the data" in surface.reduce(1e-9).summary()
