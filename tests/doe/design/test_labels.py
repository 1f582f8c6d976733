"""Labels: what carries labels is read by them, in any order, and refused where they differ."""

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

import doe
from doe import Design, DesignError, Factor, agreement, central_composite, fit_surface, pure_error, screen

FACTORS = [Factor("A", 100.0, 200.0), Factor("B", 20.0, 60.0), Factor("C", -1.0, 3.0)]


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(71)


def test_a_screening_sheet_in_run_order_gives_the_factors_of_the_standard_order(rng) -> None:
    design = doe.plackett_burman(FACTORS, 12, seed=5)
    mean = 10.0 + 4.0 * design.coded["A"] - 3.0 * design.coded["C"]
    sheet = design.natural.loc[design.run_order].assign(y=mean + 0.3 * rng.standard_normal(12))
    assert not sheet.index.equals(design.coded.index)
    assert screen(design, sheet["y"]).significant() == ["A", "C"]
    # By position it would be noise: the same numbers in the order of the sheet.
    assert screen(design, sheet["y"].to_numpy()).significant() != ["A", "C"]


def test_replicates_of_a_table_align_too(rng) -> None:
    design = central_composite(FACTORS, seed=3)
    table = pd.DataFrame(rng.standard_normal((len(design.coded), 2)), index=design.coded.index)
    shuffled = table.loc[design.run_order]
    pd.testing.assert_frame_equal(fit_surface(design, shuffled).anova, fit_surface(design, table).anova)
    long = shuffled.rename_axis("run").reset_index().melt("run", var_name="replicate", value_name="y")
    wide = long.set_index(["run", "replicate"])["y"].unstack("replicate")  # noqa: PD010
    pd.testing.assert_frame_equal(fit_surface(design, wide).anova, fit_surface(design, table).anova)


def test_two_responses_are_no_replicates(rng) -> None:
    design = central_composite(FACTORS)
    table = pd.DataFrame({"yield": rng.standard_normal(len(design.coded))}, index=design.coded.index)
    assert fit_surface(design, table).residual_df > 0.0
    with pytest.raises(DesignError, match="yield, viscosity of a table are different responses"):
        fit_surface(design, table.assign(viscosity=1.0))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: s.reset_index(drop=True), "lacks 15 of the labels 1, 2, 3"),
        (lambda s: s.set_axis([f"run {label}" for label in s.index]), "lacks 1 of"),
        (lambda s: s.iloc[:-1], "lacks 15 of"),
        (lambda s: pd.concat([s, s.iloc[:1]]), "1 comes again"),
        (lambda s: pd.concat([s, pd.Series([1.0], index=[99])]), "has 99 besides"),
    ],
)
def test_other_labels_are_refused(change: Callable, message: str) -> None:
    design = central_composite(FACTORS, center=1)
    response = pd.Series(np.arange(15.0), index=design.coded.index)
    with pytest.raises(DesignError, match=message):
        fit_surface(design, change(response))


def test_a_climb_and_its_pure_error_align(rng) -> None:
    design = doe.plackett_burman(FACTORS, 12)
    path = doe.steepest_path(screen(design, rng.standard_normal(12)), 3)
    response = pd.Series([1.0, 2.0, 3.0, 4.0], index=path.coded.index)
    pd.testing.assert_frame_equal(
        doe.climb_table(path, response[::-1], 2.5), doe.climb_table(path, response, 2.5)
    )
    settings = pd.DataFrame({"E": [0.0, 0.0, 1.0, 1.0]}, index=path.coded.index)
    assert pure_error(settings, response[::-1]) == pure_error(settings, response)
    # By label 1, 2 and 3, 4 are pairs: (1/2)^2 twice each.
    assert pure_error(settings, response[::-1]).sum_sq == pytest.approx(1.0, rel=1e-12)
    with pytest.raises(DesignError, match="lacks 1 of the labels"):
        pure_error(settings, response.set_axis([5, 6, 7, 8]))


def test_agreement_aligns_every_labelled_argument(rng) -> None:
    runs = pd.Index(list("abcdef"))
    reference = pd.Series(rng.standard_normal(6), index=runs)
    values = reference + 0.1 * rng.standard_normal(6)
    variance = pd.Series(np.arange(6.0), index=runs)
    plain, mixed = agreement(values, reference, variance), agreement(values, reference[::-1], variance[::-1])
    np.testing.assert_array_equal(plain.reference, mixed.reference)
    np.testing.assert_array_equal(plain.value_variance, mixed.value_variance)
    with pytest.raises(DesignError, match="reference is labelled and aligns by label: it lacks 'a'"):
        agreement(values, reference.set_axis(list("uvwxyz")))


def test_a_natural_table_is_not_taken_as_coded(rng) -> None:
    design = central_composite(FACTORS)
    with pytest.raises(
        DesignError, match=r"not clear whether the table is coded .* 'A' has the levels 100 and"
    ):
        Design.from_table(design.natural, FACTORS)
    read = Design.from_table(design.natural, FACTORS, coded=False)
    # Coding and decoding round to the last bits of values near 100 / 50.
    np.testing.assert_allclose(read.coded, design.coded, atol=1e-12)
    np.testing.assert_array_equal(Design.from_table(design.coded, FACTORS).coded, design.coded)


def test_a_table_that_could_be_either_is_refused() -> None:
    table = pd.DataFrame({"A": [-1.0, 1.0, 3.0]})
    with pytest.raises(DesignError, match="not clear"):
        Design.from_table(table, [Factor("A", -1.0, 3.0)])
    assert Design.from_table(table, [Factor("A", -1.0, 3.0)], coded=True).coded["A"].max() == 3.0
    assert Design.from_table(table[:2], [Factor("A", -1.0, 1.0)]).coded["A"].tolist() == [-1.0, 1.0]
