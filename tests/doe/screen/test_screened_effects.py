"""Screening: effects, the choice of the error, replicates, missing runs, Lenth, aliases."""

import numpy as np
import pytest
import statsmodels.formula.api as smf

from doe import DesignError, Factor, box_behnken, plackett_burman, screen

FACTORS = [Factor(name, 0.0, 1.0) for name in "ABCDEFGH"]
EFFECTS = np.array([4.0, 0.0, -2.0, 0.0, 0.0, 1.0, 0.0, 0.0])


def noisy(design, seed: int, shape: tuple[int, ...] = (12,), sd: float = 1.0) -> np.ndarray:
    signal = 20.0 + design.points.to_numpy() @ (0.5 * EFFECTS)
    noise = np.random.default_rng(seed).normal(scale=sd, size=shape)
    return signal.reshape(-1, *[1] * (len(shape) - 1)) + noise


def test_effects_are_differences_of_level_means():
    design = plackett_burman(FACTORS)
    response = noisy(design, 1)
    result = screen(design, response)
    for name in design.names:
        high = design.coded[name] > 0.0
        # Sums of twelve numbers near 20: rounding.
        assert result.table.loc[name, "effect"] == pytest.approx(
            response[high].mean() - response[~high].mean(), abs=1e-12
        )


def test_effects_without_noise_are_exact_and_other_columns_empty():
    design = plackett_burman(FACTORS)
    result = screen(design, noisy(design, 1, sd=0.0))
    assert result.table["effect"].to_numpy() == pytest.approx(EFFECTS, abs=1e-12)
    assert result.effects[list(design.dummies)].to_numpy() == pytest.approx(0.0, abs=1e-12)


def test_coefficients_predict_alike_in_both_units():
    factors = [Factor("A", 3.0, 8.0), Factor("B", -1.0, 0.5)]
    design = plackett_burman(factors)
    result = screen(design, np.random.default_rng(3).normal(size=12))
    natural, coded = result.coefficients, result.coded_coefficients
    by_natural = natural["intercept"] + design.natural @ natural[["A", "B"]]
    by_coded = coded["intercept"] + design.points @ coded[["A", "B"]]
    assert by_natural.to_numpy() == pytest.approx(by_coded.to_numpy(), abs=1e-12)


def test_incomplete_and_replicated_runs_agree_with_statsmodels():
    design = plackett_burman(FACTORS)
    runs = [1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 2, 5, 5]
    table = design.points.loc[runs].assign(y=np.random.default_rng(4).normal(size=len(runs)))
    result = screen(design.select(runs), table["y"].to_numpy(), error="pooled")
    fit = smf.ols("y ~ A + B + C + D + E + F + G + H", table).fit()
    # The same least squares problem through two design matrices.
    assert result.table["t"].to_numpy() == pytest.approx(fit.tvalues.iloc[1:].to_numpy(), rel=1e-9)
    assert result.table["p"].to_numpy() == pytest.approx(fit.pvalues.iloc[1:].to_numpy(), rel=1e-9)


def test_errors_of_a_replicated_design_add_up():
    design = plackett_burman(FACTORS)
    response = noisy(design, 5, (12, 3))
    pooled, dummies, pure = (screen(design, response, error=rule) for rule in ("pooled", "dummies", "pure"))
    assert (pooled.error_df, dummies.error_df, pure.error_df) == (27, 3, 24)
    assert pooled.error.sum_sq == pytest.approx(dummies.error.sum_sq + pure.error.sum_sq, rel=1e-12)
    assert pure.error_ms == pytest.approx(response.var(axis=1, ddof=1).mean(), rel=1e-12)
    # The dummies' sum of squares: runs x replicates x half effect squared.
    inert = 36.0 * (0.5 * pooled.effects[list(design.dummies)]) ** 2
    assert dummies.error.sum_sq == pytest.approx(inert.sum(), rel=1e-9)
    assert pooled.anova.loc["lack of fit", "df"] == 3


def test_false_alarms_come_at_the_stated_rate():
    """Among inert factors, the share with p < 0.10 is 0.10."""
    design = plackett_burman(FACTORS)
    rng = np.random.default_rng(6)
    alarms = [(screen(design, rng.normal(size=12)).table["p"] < 0.10).mean() for _ in range(200)]
    # 200 designs of 8 tests that share an error: at most the binomial spread of 200, times 3.5.
    assert np.mean(alarms) == pytest.approx(0.10, abs=3.5 * np.sqrt(0.1 * 0.9 / 200))


def test_saturated_design_needs_another_error():
    design = plackett_burman([Factor(f"x{i}", 0.0, 1.0) for i in range(11)])
    response = np.random.default_rng(7).normal(size=12)
    with pytest.raises(DesignError, match=r"no degrees of freedom for the error 'pooled'.*error='lenth'"):
        screen(design, response, error="pooled")
    assert screen(design, response).error_rule == "lenth"
    assert screen(design, response).error_df == pytest.approx(11 / 3)
    assert screen(design, np.column_stack([response, response + 0.1]), error="pooled").error_df == 12


def test_a_table_without_dummy_columns_is_not_tested_against_dummies():
    design = box_behnken([Factor(f"x{i}", 0.0, 1.0) for i in range(3)])
    response = design.points["x0"].to_numpy() + np.random.default_rng(8).normal(size=len(design.coded))
    result = screen(design, response)
    assert result.error_rule == "lack of fit"
    assert repr(result).endswith("significant at 0.05 against lack of fit: x0")
    assert "dumm" not in result.summary()
    with_dummies = plackett_burman([Factor(f"x{i}", 0.0, 1.0) for i in range(5)])
    assert "against dummies" in repr(screen(with_dummies, np.random.default_rng(9).normal(size=12)))


def test_lenth_pseudo_error_by_hand():
    design = plackett_burman([Factor(f"x{i}", 0.0, 1.0) for i in range(7)], runs=8)
    effects = np.array([1.0, -2.0, 3.0, 4.0, -5.0, 6.0, 100.0])
    result = screen(design, design.points.to_numpy() @ (0.5 * effects), error="lenth")
    # s0 = 1.5 x median(1..6, 100) = 6; below 2.5 s0 = 15 remain 1..6, median 3.5; PSE = 5.25, df = 7/3.
    assert result.standard_error.to_numpy() == pytest.approx(5.25, rel=1e-12)
    assert result.table.loc["x6", "t"] == pytest.approx(100.0 / 5.25, rel=1e-12)
    # Ye and Hamada's limit of single effects; drawn, to 0.4 % (three standard errors are 1 %).
    assert result.critical_t(0.05) == pytest.approx(2.297, rel=0.01)
    assert result.table.loc["x6", "p"] < 0.002
