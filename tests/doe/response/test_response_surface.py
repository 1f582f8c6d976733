"""Response surfaces: agreement with statsmodels formulas, invariances, reduction, prediction."""

import numpy as np
import pandas as pd
import pytest
import statsmodels.api as sm
import statsmodels.formula.api as smf

from doe import Design, DesignError, Factor, central_composite, fit_surface

FACTORS = [Factor("A", 2.0, 5.0), Factor("B", -0.3, 0.9), Factor("C", 10.0, 80.0)]
FORMULA = "y ~ A + B + C + A:B + A:C + B:C + I(A**2) + I(B**2) + I(C**2)"


@pytest.fixture
def design() -> Design:
    return central_composite(FACTORS, center=4)


@pytest.fixture
def response(design) -> np.ndarray:
    a, b, c = design.points.to_numpy().T
    mean = 30.0 + 2.0 * a - b + 0.5 * c + 0.7 * a * b - 0.4 * a**2 + 0.2 * c**2
    return mean + np.random.default_rng(11).normal(scale=0.3, size=len(mean))


def test_natural_coefficients_are_those_of_a_natural_fit(design, response):
    surface = fit_surface(design, response)
    fit = smf.ols(FORMULA, design.natural.assign(y=response)).fit()
    # The natural fit is the ill-conditioned one of the two: 1e-7 is its accuracy.
    assert surface.coefficients.to_numpy() == pytest.approx(fit.params.to_numpy(), rel=1e-7, abs=1e-9)
    assert surface.r2 == pytest.approx(fit.rsquared, rel=1e-10)


def test_partial_tests_are_type_three_of_the_coded_fit(design, response):
    surface = fit_surface(design, response)
    fit = smf.ols(FORMULA, design.points.assign(y=response)).fit()
    table = sm.stats.anova_lm(fit, typ=3)
    ours = surface.anova.iloc[1:-4]
    theirs = table.iloc[1:-1]
    assert ours["sum_sq"].to_numpy() == pytest.approx(theirs["sum_sq"].to_numpy(), rel=1e-8)
    assert ours["p"].to_numpy() == pytest.approx(theirs["PR(>F)"].to_numpy(), rel=1e-8)


def test_lack_of_fit_compares_with_one_mean_a_setting(design, response):
    surface = fit_surface(design, response)
    coded = design.points.round(6).assign(y=response)
    coded["setting"] = coded.groupby(["A", "B", "C"]).ngroup()
    nested = sm.stats.anova_lm(surface.fit, smf.ols("y ~ C(setting)", coded.drop(columns="C")).fit())
    row = surface.anova.loc["lack of fit"]
    assert row["F"] == pytest.approx(nested["F"].iloc[1], rel=1e-9)
    assert row["p"] == pytest.approx(nested["Pr(>F)"].iloc[1], rel=1e-9)


def test_prediction_is_that_of_statsmodels(design, response):
    surface = fit_surface(design, response)
    points = pd.DataFrame({"A": [2.5, 4.0], "B": [0.0, 0.5], "C": [20.0, 90.0]}, index=["p", "q"])
    fit = smf.ols(FORMULA, design.natural.assign(y=response)).fit()
    expected = fit.get_prediction(points).summary_frame(alpha=0.10)
    ours = surface.predict(points, alpha=0.10)
    assert list(ours.index) == ["p", "q"]
    # The natural fit's conditioning again.
    assert ours.to_numpy() == pytest.approx(expected.to_numpy(), rel=1e-6)


def test_replicates_as_columns_or_as_rows_are_the_same_fit(design, response):
    pair = np.column_stack([response, response[::-1]])
    columns = fit_surface(design, pair, "interaction")
    rows = fit_surface(design.select(np.tile(design.coded.index, 2)), pair.T.ravel(), "interaction")
    pd.testing.assert_frame_equal(columns.anova, rows.anova)
    # 15 settings: 14 once and the center four times, each in pairs.
    assert columns.pure_error.df == 2 * len(design.coded) - 15


def test_elimination_keeps_the_hierarchy(design):
    a, b, _ = design.points.to_numpy().T
    response = 3.0 * a * b + np.random.default_rng(12).normal(scale=0.1, size=len(a))
    reduced = fit_surface(design, response).reduce(0.01)
    assert list(reduced.coded_coefficients.index) == ["intercept", "A", "B", "A:B"]
    assert reduced.anova.loc["A", "p"] > 0.01
    with pytest.raises(DesignError, match="hierarchical: A is part of A:B, which stays"):
        reduced.drop("A")
    assert list(reduced.drop("A", "B:A").terms) == [("B",)]


def test_prediction_intervals_cover():
    """Monte Carlo: 95 % intervals hold the true mean and a new observation in 95 % of experiments."""
    design = central_composite(FACTORS[:2])
    a, b = design.points.to_numpy().T
    mean = 30.0 + a + 2.0 * b + 0.5 * a * b
    rng = np.random.default_rng(14)
    point = {"A": 4.0, "B": 0.7}
    coded = [f.to_coded(point[f.name]) for f in FACTORS[:2]]
    truth = 30.0 + coded[0] + 2.0 * coded[1] + 0.5 * coded[0] * coded[1]
    hits = np.zeros(2)
    trials = 80
    for _ in range(trials):
        row = fit_surface(design, mean + rng.normal(size=len(mean))).predict(point).iloc[0]
        fresh = truth + rng.normal()
        hits += [
            row["confidence_low"] <= truth <= row["confidence_high"],
            row["prediction_low"] <= fresh <= row["prediction_high"],
        ]
    # 3.5 binomial standard deviations of 80 trials: 0.085.
    assert hits / trials == pytest.approx(0.95, abs=3.5 * np.sqrt(0.95 * 0.05 / trials))
